#include "core/world/player_limits.h"

#include <algorithm>

#include "core/world/limits.h"

namespace tessera {
namespace {

constexpr std::uint8_t kLimitsForce = 1, kLimitsTorque = 2, kLimitsSpeed = 4, kLimitsAxes = 8;
constexpr Vec3f kAllAxes{1, 1, 1};

// Written so that a NaN fails.
bool LimitWithin(const std::optional<float>& value, double most) { return !value || (*value >= 0 && *value <= most); }
bool IsShare(float share) { return share >= 0 && share <= 1; }

}  // namespace

const char* WrongField(const PlayerLimits& limits) {
  if (!LimitWithin(limits.force_n, kMaxForce)) return "force";
  if (!LimitWithin(limits.torque_nm, kMaxForce)) return "torque";
  if (!LimitWithin(limits.speed_m_s, kMaxSpeed_m_s)) return "speed";
  if (!IsShare(limits.axes.x) || !IsShare(limits.axes.y) || !IsShare(limits.axes.z)) return "axes";
  return nullptr;
}

PlayerRules RulesWith(const PlayerRules& rules, const PlayerLimits& limits) {
  PlayerRules limited = rules;
  if (limits.force_n) limited.max_force_n = static_cast<double>(*limits.force_n);
  if (!limits.speed_m_s) return limited;
  limited.max_speed_m_s = static_cast<double>(*limits.speed_m_s);
  if (limited.character) {
    limited.character->walk_speed_m_s = std::min(limited.character->walk_speed_m_s, limited.max_speed_m_s);
    limited.character->run_speed_m_s = std::min(limited.character->run_speed_m_s, limited.max_speed_m_s);
  }
  return limited;
}

void Write(ByteWriter& out, const PlayerLimits& limits) {
  const bool axes = limits.axes != kAllAxes;
  out.U8(static_cast<std::uint8_t>((limits.force_n ? kLimitsForce : 0) | (limits.torque_nm ? kLimitsTorque : 0) |
                                   (limits.speed_m_s ? kLimitsSpeed : 0) | (axes ? kLimitsAxes : 0)));
  for (const std::optional<float>& value : {limits.force_n, limits.torque_nm, limits.speed_m_s}) {
    if (value) out.F32(*value);
  }
  if (axes) out.V(limits.axes);
}

PlayerLimits ReadPlayerLimits(ByteReader& in) {
  PlayerLimits limits;
  const std::uint8_t flags = in.U8();
  if (flags > (kLimitsForce | kLimitsTorque | kLimitsSpeed | kLimitsAxes)) in.Fail("unknown flags");
  if ((flags & kLimitsForce) != 0) limits.force_n = in.F32();
  if ((flags & kLimitsTorque) != 0) limits.torque_nm = in.F32();
  if ((flags & kLimitsSpeed) != 0) limits.speed_m_s = in.F32();
  if ((flags & kLimitsAxes) != 0) limits.axes = in.V3f();
  return limits;
}

}  // namespace tessera
