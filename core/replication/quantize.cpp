#include "core/replication/quantize.h"

#include <algorithm>
#include <bit>
#include <cassert>
#include <cmath>
#include <numbers>

namespace tessera::replication {
namespace {

// Margin around the bounds, m: a body that rests on or leans over the edge of a world still counts as inside.
constexpr double kMargin_m = 8;

// To the nearest whole number within +-limit; NaN gives -limit.
std::int64_t ToSteps(double value, double step, std::int64_t limit) {
  const double steps = value / step;
  if (!(steps > -static_cast<double>(limit))) return -limit;
  if (steps >= static_cast<double>(limit)) return limit;
  return std::llround(steps);
}

std::array<std::int32_t, 3> VelocityToSteps(Vec3f v, double step) {
  const auto one = [step](float c) { return static_cast<std::int32_t>(ToSteps(double{c}, step, kMaxVelocity)); };
  return {one(v.x), one(v.y), one(v.z)};
}

Vec3f VelocityFromSteps(const std::array<std::int32_t, 3>& v, double step) {
  return Vec3f(Vec3d(v[0] * step, v[1] * step, v[2] * step));
}

// FNV-1a over the bits of everything that both ends must agree on.
std::uint16_t Fingerprint(std::initializer_list<double> values) {
  std::uint64_t hash = 0xcbf29ce484222325;
  for (const double value : values) {
    const auto bits = std::bit_cast<std::uint64_t>(value);
    for (int i = 0; i < 64; i += 8) hash = (hash ^ ((bits >> i) & 0xff)) * 0x100000001b3;
  }
  return static_cast<std::uint16_t>(hash ^ (hash >> 16) ^ (hash >> 32) ^ (hash >> 48));
}

}  // namespace

Quantizer::Quantizer(const Aabb& world_bounds, const SnapshotSettings& settings)
    : origin_(world_bounds.min - Vec3d(kMargin_m, kMargin_m, kMargin_m)),
      position_step_(settings.position_step_m),
      linear_step_(settings.linear_velocity_step_m_s),
      angular_step_(settings.angular_velocity_step_rad_s),
      orientation_bits_(settings.orientation_bits),
      orientation_limit_((1 << (settings.orientation_bits - 1)) - 1),
      fingerprint_(
          Fingerprint({world_bounds.min.x, world_bounds.min.y, world_bounds.min.z, world_bounds.max.x,
                       world_bounds.max.y, world_bounds.max.z, position_step_, linear_step_, angular_step_,
                       settings.tick_rate_hz, settings.gravity_m_s2, static_cast<double>(orientation_bits_)})) {
  assert(settings.orientation_bits >= 3 && settings.orientation_bits <= 16);
  const Vec3d extent = world_bounds.max - world_bounds.min;
  const std::array<double, 3> extents{extent.x, extent.y, extent.z};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto steps = static_cast<std::uint64_t>(ToSteps(extents[axis] + 2 * kMargin_m, position_step_, kMaxPosition));
    position_bits_[axis] = static_cast<int>(std::bit_width(steps));
  }
}

bool Quantizer::InBounds(const QuantizedState& state) const {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (state.position[axis] < 0 || (state.position[axis] >> position_bits_[axis]) != 0) return false;
  }
  return true;
}

void Quantizer::QuantizeOrientation(Quatd orientation, QuantizedState& state) const {
  const Quatd q = Normalized(orientation);
  const std::array<double, 4> components{q.x, q.y, q.z, q.w};
  std::size_t largest = 3;
  for (std::size_t i = 0; i < 3; ++i) {
    if (std::abs(components[i]) > std::abs(components[largest])) largest = i;
  }
  // The others are at most sqrt(1/2). q and -q are the same rotation.
  const double scale = (components[largest] < 0 ? -1 : 1) * orientation_limit_ * std::numbers::sqrt2;
  state.largest = static_cast<std::uint8_t>(largest);
  for (std::size_t i = 0, out = 0; i < 4; ++i) {
    if (i == largest) continue;
    state.smallest[out++] = static_cast<std::int16_t>(ToSteps(components[i] * scale, 1, orientation_limit_));
  }
}

Quatd Quantizer::DequantizeOrientation(const QuantizedState& state) const {
  std::array<double, 4> components{};
  double sum = 0;
  for (std::size_t i = 0, in = 0; i < 4; ++i) {
    if (i == state.largest) continue;
    components[i] = state.smallest[in++] / (orientation_limit_ * std::numbers::sqrt2);
    sum += components[i] * components[i];
  }
  components[state.largest] = std::sqrt(std::max(0.0, 1 - sum));
  return Normalized(Quatd(components[0], components[1], components[2], components[3]));
}

QuantizedState Quantizer::Quantize(const BodyState& state) const {
  QuantizedState result;
  const Vec3d p = state.position - origin_;
  result.position = {ToSteps(p.x, position_step_, kMaxPosition), ToSteps(p.y, position_step_, kMaxPosition),
                     ToSteps(p.z, position_step_, kMaxPosition)};
  QuantizeOrientation(state.orientation, result);
  result.asleep = state.asleep;
  if (!state.asleep) {
    result.linear = VelocityToSteps(state.linear_velocity, linear_step_);
    result.angular = VelocityToSteps(state.angular_velocity, angular_step_);
  }
  return result;
}

Vec3d Quantizer::PositionOf(const QuantizedState& state) const {
  const Vec3d steps(static_cast<double>(state.position[0]), static_cast<double>(state.position[1]),
                    static_cast<double>(state.position[2]));
  return origin_ + steps * position_step_;
}

BodyState Quantizer::Dequantize(const QuantizedState& state) const {
  return {.position = PositionOf(state),
          .orientation = DequantizeOrientation(state),
          .linear_velocity = VelocityFromSteps(state.linear, linear_step_),
          .angular_velocity = VelocityFromSteps(state.angular, angular_step_),
          .asleep = state.asleep};
}

}  // namespace tessera::replication
