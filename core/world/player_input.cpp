#include "core/world/player_input.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>

namespace tessera {
namespace {

constexpr std::uint8_t kForce = 1, kTorque = 2, kMove = 4, kLook = 8, kButtons = 16, kShown = 32;
constexpr std::uint8_t kAllFlags = 63;
constexpr double kMoveUnit = 1.0 / 32767;
constexpr double kYawUnit_rad = std::numbers::pi / 32768, kPitchUnit_rad = std::numbers::pi / 65534;
constexpr float kMostYaw_rad = 3.1415928F, kMostPitch_rad = 1.5707964F;  // the floats nearest to pi and pi / 2

// All bits count, so that a -0 comes back as it went in.
bool AllZero(Vec3f v) {
  return (std::bit_cast<std::uint32_t>(v.x) | std::bit_cast<std::uint32_t>(v.y) | std::bit_cast<std::uint32_t>(v.z)) ==
         0;
}

std::int16_t Units(float value, double unit) {
  const double units = std::round(static_cast<double>(value) / unit);
  // One half turn is the other.
  if (units >= 32768) return -32768;
  return static_cast<std::int16_t>(std::max(units, -32768.0));
}

void WriteUnits(ByteWriter& out, float value, double unit) { out.U16(static_cast<std::uint16_t>(Units(value, unit))); }

float ReadUnits(ByteReader& in, double unit) { return static_cast<float>(static_cast<std::int16_t>(in.U16()) * unit); }

float Rounded(float value, double unit) { return static_cast<float>(Units(value, unit) * unit); }

}  // namespace

std::uint64_t ShownAt(double tick) {
  constexpr double kMost = 1e15;  // as many parts as a double tells apart
  const double parts = std::round(tick * static_cast<double>(kShownParts));
  return parts >= 1 && parts < kMost ? static_cast<std::uint64_t>(parts) : 0;
}

const char* WrongField(const PlayerInput& input) {
  if (!IsFinite(input.force_n)) return "force_n is not finite";
  if (!IsFinite(input.torque_nm)) return "torque_nm is not finite";
  const Vec2f move = input.move;
  if (!std::isfinite(move.x) || !std::isfinite(move.y)) return "move is not finite";
  if (std::hypot(move.x, move.y) > 1 + kMoveTolerance) return "move is longer than 1";
  // A comparison with a NaN is false.
  if (!(std::abs(input.yaw_rad) <= kMostYaw_rad)) return "yaw_rad is not within -pi and pi";
  if (!(std::abs(input.pitch_rad) <= kMostPitch_rad)) return "pitch_rad is not within -pi/2 and pi/2";
  return nullptr;
}

PlayerInput AsSent(PlayerInput input) {
  const auto finite = [](float value) { return std::isfinite(value) ? value : 0.0F; };
  Vec2f move{finite(input.move.x), finite(input.move.y)};
  // Rounding makes some vectors of length 1 longer, and they are to stay as they are.
  if (const float length = std::hypot(move.x, move.y); length > 1 + kMoveTolerance / 2)
    move = {move.x / length, move.y / length};
  input.move = {Rounded(move.x, kMoveUnit), Rounded(move.y, kMoveUnit)};
  input.yaw_rad =
      Rounded(std::remainder(finite(input.yaw_rad), static_cast<float>(2 * std::numbers::pi)), kYawUnit_rad);
  input.pitch_rad = Rounded(std::clamp(finite(input.pitch_rad), -kMostPitch_rad, kMostPitch_rad), kPitchUnit_rad);
  return input;
}

void WriteSteering(ByteWriter& out, const PlayerInput& input) {
  const bool force = !AllZero(input.force_n), torque = !AllZero(input.torque_nm);
  const bool move = input.move != Vec2f(), look = input.yaw_rad != 0 || input.pitch_rad != 0;
  out.U8(static_cast<std::uint8_t>((force ? kForce : 0) | (torque ? kTorque : 0) | (move ? kMove : 0) |
                                   (look ? kLook : 0) | (input.buttons != 0 ? kButtons : 0) |
                                   (input.shown_at != 0 ? kShown : 0)));
  if (force) out.V(input.force_n);
  if (torque) out.V(input.torque_nm);
  if (move) {
    WriteUnits(out, input.move.x, kMoveUnit);
    WriteUnits(out, input.move.y, kMoveUnit);
  }
  if (look) {
    WriteUnits(out, input.yaw_rad, kYawUnit_rad);
    WriteUnits(out, input.pitch_rad, kPitchUnit_rad);
  }
  if (input.buttons != 0) out.Varint(input.buttons);
  if (input.shown_at != 0) out.Varint(input.shown_at);
}

void ReadSteering(ByteReader& in, PlayerInput& input) {
  const std::uint8_t flags = in.U8();
  if ((flags & ~kAllFlags) != 0) in.Fail("unknown flags");
  if ((flags & kForce) != 0) input.force_n = in.V3f();
  if ((flags & kTorque) != 0) input.torque_nm = in.V3f();
  if ((flags & kMove) != 0) {
    input.move.x = ReadUnits(in, kMoveUnit);
    input.move.y = ReadUnits(in, kMoveUnit);
  }
  if ((flags & kLook) != 0) {
    input.yaw_rad = ReadUnits(in, kYawUnit_rad);
    input.pitch_rad = ReadUnits(in, kPitchUnit_rad);
  }
  if ((flags & kButtons) != 0) input.buttons = in.Varint32();
  if ((flags & kShown) != 0) input.shown_at = in.Varint();
}

}  // namespace tessera
