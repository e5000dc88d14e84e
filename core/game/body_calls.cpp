#include "core/game/body_calls.h"

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "core/game/control_calls.h"
#include "core/game/joint_calls.h"
#include "core/game/message_calls.h"
#include "core/game/motion_calls.h"
#include "core/game/record_calls.h"
#include "core/world/prefab.h"
#include "core/world/state_check.h"

namespace tessera::game {
namespace {

absl::Status PushBody(std::string_view function, const BodyDef& def, const BodyState& state, double tick_rate_hz,
                      GameRecord& record, Vec3d impulse_ns, const Vec3d* point) {
  const double mass_kg = def.mass_kg;
  if (Length(impulse_ns) > mass_kg * kMaxGameSpeed_m_s) {
    return ArgumentFault(
        function, absl::StrCat("makes a body of ", mass_kg, " kg faster by more than ", kMaxGameSpeed_m_s, " m/s"));
  }
  const Vec3f push_ns = record.push_ns + Vec3f(impulse_ns);
  const Vec3f push_nms =
      point == nullptr ? record.push_nms : record.push_nms + Vec3f(Cross(*point - state.position, impulse_ns));
  // It acts as a force over one tick.
  const auto rate = static_cast<float>(tick_rate_hz);
  if (!CheckForce(def.id, push_ns * rate, push_nms * rate).ok())
    return ArgumentFault(function, "turns the body more than can be computed");
  record.push_ns = push_ns;
  record.push_nms = push_nms;
  return absl::OkStatus();
}

absl::Status BodyNotOwned(const Function& function, BodyId id) {
  return absl::FailedPreconditionError(
      absl::StrCat(ViewOf(function.name), ": body ", id.value(), " is not owned by this region"));
}

absl::StatusOr<tessera_game_value> ReadBody(tessera_game_call& call, const Function& function, BodyId id,
                                            const BodyDef& def, CallArguments arguments) {
  const Transaction& world = call.transaction;
  const Scene& scene = world.world().scene();
  switch (function.number) {
    case kBodyMember: {
      const std::int64_t number = arguments[0].as.whole;
      const std::size_t members = IsSpawned(id) ? scene.prefabs[PartsOf(id).prefab].bodies.size() : 0;
      if (number < 1 || static_cast<std::uint64_t>(number) > members) return tessera_game_value{};
      return ToInterface(GameValue(WithMember(id, static_cast<std::size_t>(number) - 1)));
    }
    case kBodyController:
      return ControllerOf(call, function, id);
    case kBodyGet: {
      return GetProperty(call, scene.properties, def.properties, world.PropertiesOf(id), TextGiven(arguments[0]));
    }
    default:
      return absl::InternalError(absl::StrCat(ViewOf(function.name), ": is not there yet"));
  }
}

// Removes a body, now or later.
absl::StatusOr<tessera_game_value> LeaveWorld(tessera_game_call& call, const Function& function, BodyId id,
                                              const BodyDef& def, Transaction::Changes& body, CallArguments arguments) {
  const char* const why_not = def.motion != Motion::kDynamic ? " does not move, and stays"
                              : IsPlayerBody(id)             ? " is a player's, and stays with the player"
                                                             : nullptr;
  if (why_not != nullptr) return ArgumentFault(function.name, absl::StrCat("body ", id.value(), why_not));
  if (function.number == kBodyRemove) {
    call.transaction.Remove(id);
  } else if (arguments[0].as.whole == 0) {
    body.record.expires = Tick();
  } else {
    const auto expires = TicksAhead("expire_after", "ticks", call.tick, arguments[0].as.whole);
    if (!expires.ok()) return expires.status();
    body.record.expires = *expires;
  }
  return tessera_game_value{};
}

absl::StatusOr<tessera_game_value> ChangeBody(tessera_game_call& call, const Function& function, BodyId id,
                                              const BodyDef& def, Transaction::Changes& body, CallArguments arguments) {
  const Transaction& world = call.transaction;
  const Scene& scene = world.world().scene();
  const bool moves = def.motion == Motion::kDynamic && !def.kinematic;
  if (IsMotionCall(function.number)) return CallMotion(call, function, id, def, body, arguments);
  switch (function.number) {
    case kBodySet: {
      const absl::Status status = SetProperty(scene.properties, TextGiven(arguments[0]), arguments[1], body.properties);
      if (!status.ok()) return status;
      return tessera_game_value{};
    }
    case kBodyImpulse: {
      if (!moves) return ArgumentFault("impulse", absl::StrCat("body ", id.value(), " does not move"));
      const Vec3d point = IsGiven(arguments, 1) ? VectorGiven(arguments[1]) : Vec3d();
      const absl::Status status = PushBody("impulse", def, world.StateOf(id), scene.tick_rate_hz, body.record,
                                           VectorGiven(arguments[0]), IsGiven(arguments, 1) ? &point : nullptr);
      if (!status.ok()) return status;
      return tessera_game_value{};
    }
    case kBodySetVelocity: {
      if (!moves) return ArgumentFault("set_velocity", absl::StrCat("body ", id.value(), " does not move"));
      const Vec3d velocity = VectorGiven(arguments[0]);
      if (Length(velocity) > kMaxGameSpeed_m_s) {
        return ArgumentFault("set_velocity", absl::StrCat("`velocity` is above ", kMaxGameSpeed_m_s, " m/s"));
      }
      const BodyState state = world.StateOf(id);
      GameRecord pushed = body.record;
      pushed.push_ns = {};
      const absl::Status status = PushBody("set_velocity", def, state, scene.tick_rate_hz, pushed,
                                           (velocity - Vec3d(state.linear_velocity)) * def.mass_kg, nullptr);
      if (!status.ok()) return status;
      body.record.push_ns = pushed.push_ns;
      if (body.record.teleport) body.record.teleport->velocity_m_s = Vec3f(velocity);
      if (body.record.teleport) body.record.push_ns = {};
      return tessera_game_value{};
    }
    case kBodyAfter: {
      const absl::StatusOr<std::int64_t> timer = SetTimer(call.tick, arguments, body.record);
      if (!timer.ok()) return timer.status();
      return ToInterface(GameValue(*timer));
    }
    case kBodyShowTo: {
      const absl::Status status = ShowTo(scene, def, TextGiven(arguments[0]), body.record);
      if (!status.ok()) return status;
      return tessera_game_value{};
    }
    case kBodyCancel:
      return ToInterface(GameValue(CancelTimer(body.record, arguments[0].as.whole)));
    case kBodyRemove:
    case kBodyExpireAfter:
      return LeaveWorld(call, function, id, def, body, arguments);
    default:
      return absl::InternalError(absl::StrCat(ViewOf(function.name), ": is not there yet"));
  }
}

bool ChangesBody(std::uint32_t function) {
  return function == kBodySet || function == kBodyImpulse || function == kBodySetVelocity || function == kBodyAfter ||
         function == kBodyCancel || function == kBodyRemove || function == kBodyExpireAfter ||
         function == kBodyShowTo || IsMotionCall(function);
}

}  // namespace

bool ReadAtOnce(const tessera_game_call& call, std::uint32_t function, BodyId id, tessera_game_value& result) {
  const Transaction& world = call.transaction;
  const BodyDef* def = world.Find(id);
  if (function == kBodyIsHere) {
    result = FlagResult(def != nullptr);
    return true;
  }
  if (function == kBodyIsOwn) {
    result = FlagResult(world.Owns(id));
    return true;
  }
  if (def == nullptr) return false;
  switch (function) {
    case kBodyKind:
      result = TextResult(world.world().scene().kinds[def->kind]);
      return true;
    case kBodyPosition:
      result = VectorResult(world.StateOf(id).position);
      return true;
    case kBodyRotation:
      result = RotationResult(Quatd(world.StateOf(id).orientation));
      return true;
    case kBodyVelocity:
      result = VectorResult(Vec3d(world.StateOf(id).linear_velocity));
      return true;
    case kBodySpin:
      result = VectorResult(Vec3d(world.StateOf(id).angular_velocity));
      return true;
    case kBodyMass:
      result = RealResult(def->mass_kg);
      return true;
    case kBodyPlayer:
      result = IsPlayerBody(id) ? ToInterface(GameValue(PlayerOf(id))) : tessera_game_value{};
      return true;
    default:
      return false;
  }
}

absl::StatusOr<tessera_game_value> CallBody(tessera_game_call& call, const Function& function, BodyId id,
                                            CallArguments arguments) {
  const BodyDef* def = call.transaction.Find(id);
  if (IsJointCall(function.number)) return CallJoint(call, function, id, arguments);
  if (function.number == kBodySend) return CallSend(call, function, id, arguments);
  const bool foreign = !call.transaction.Owns(id) && !call.transaction.Removed(id) &&
                       (def == nullptr || def->motion == Motion::kDynamic);
  if (foreign && IsVerb(function.number)) {
    return SendVerb(call, function, id, arguments);
  }
  if (def == nullptr)
    return absl::NotFoundError(absl::StrCat(ViewOf(function.name), ": body ", id.value(), " is not here"));
  if (!ChangesBody(function.number)) return ReadBody(call, function, id, *def, arguments);
  Transaction::Changes* body = call.transaction.Own(id);
  if (body == nullptr) {
    return BodyNotOwned(function, id);
  }
  return ChangeBody(call, function, id, *def, *body, arguments);
}

}  // namespace tessera::game
