// Makes the rules of a character from their message, and the player's body one that a character can move.
//
// For use inside core/world only. Thread rule: one thread.
#pragma once

#include "core/world/faults.h"
#include "core/world/scene.h"
#include "tessera/v1/scene.pb.h"

namespace tessera {

// `body`, the player's, loses its friction, and comes not to tilt.
CharacterRules ResolveCharacter(Faults& faults, const v1::PlayerRules& player, Vec3d gravity_m_s2, BodyDef& body);

}  // namespace tessera
