#include "core/game/effect.h"

#include "core/game/motion_calls.h"
#include "game_sdk/api/api.h"

namespace tessera::game {

std::optional<Effect> EffectOf(std::uint32_t function) {
  switch (function) {
    case kWorldSet:
    case kBodySet:
    case kBodyShowTo:
      return Effect::kProperty;
    case kWorldAfter:
    case kWorldCancel:
    case kBodyAfter:
    case kBodyCancel:
    case kBodyExpireAfter:
      return Effect::kTimer;
    case kBodyImpulse:
    case kBodySetVelocity:
      return Effect::kMotion;
    case kWorldSpawn:
      return Effect::kSpawn;
    case kBodyRemove:
      return Effect::kRemoval;
    case kWorldSend:
    case kBodySend:
      return Effect::kMessage;
    case kWorldExplode:
      return Effect::kExplosion;
    case kBodyConnect:
    case kBodyDisconnect:
      return Effect::kJoint;
    case kWorldAskRay:
    case kWorldAskSweep:
    case kWorldAskOverlap:
      return Effect::kQuestion;
    case kPlayerRefuse:
    case kPlayerKick:
    case kPlayerPlace:
    case kPlayerSpectate:
    case kPlayerRespawn:
    case kPlayerControl:
    case kPlayerSetLimits:
      return Effect::kPlayer;
    case kPlayerSend:
    case kWorldBroadcast:
      return Effect::kEvent;
    case kWorldPublish:
      return Effect::kPublished;
    default:
      return IsMotionCall(function) ? std::optional(Effect::kMotion) : std::nullopt;
  }
}

}  // namespace tessera::game
