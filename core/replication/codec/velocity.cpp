#include "core/replication/codec/velocity.h"

#include <algorithm>
#include <cmath>

namespace tessera::replication {
namespace {

constexpr int kScaleBits = 16;
// Longest zigzag residual of two velocities.
constexpr int kMostVelocityBits = 24;

std::int32_t Held(std::int64_t value) {
  return static_cast<std::int32_t>(std::clamp<std::int64_t>(value, -kMaxVelocity, kMaxVelocity));
}

bool ReadOne(BitReader& reader, std::int32_t estimate, int parameter, std::int32_t& value) {
  std::int64_t residual = 0;
  if (!ReadGolomb(reader, parameter, kMostVelocityBits, residual)) return false;
  const std::int64_t sum = estimate + residual;
  if (sum < -kMaxVelocity || sum > kMaxVelocity) return false;
  value = static_cast<std::int32_t>(sum);
  return true;
}

}  // namespace

VelocityEstimator::VelocityEstimator(const SnapshotSettings& settings)
    : linear_per_position_(std::llround(settings.position_step_m * settings.tick_rate_hz /
                                        settings.linear_velocity_step_m_s * static_cast<double>(1 << kScaleBits))),
      angular_per_turn_(std::llround(2 * settings.tick_rate_hz / settings.angular_velocity_step_rad_s)),
      fall_(std::llround(settings.gravity_m_s2 / settings.tick_rate_hz / settings.linear_velocity_step_m_s *
                         static_cast<double>(1 << kScaleBits))) {}

VelocityEstimate VelocityEstimator::From(const QuantizedState& base, const QuantizedState& state,
                                         const Prediction& prediction, std::uint64_t ticks,
                                         std::int32_t orientation_limit) const {
  VelocityEstimate result;
  const auto elapsed = static_cast<std::int64_t>(std::min(ticks, kMaxPredictedTicks));
  constexpr std::int64_t kFar = std::int64_t{1} << 40;  // keeps the products within 64 bits
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::int64_t moved = std::clamp(state.position[axis] - base.position[axis], -kFar, kFar);
    result.linear[axis] = Held((moved * linear_per_position_ / elapsed) >> kScaleBits);
  }
  // The mean velocity over a span is the velocity at its middle.
  if (prediction.flies) result.linear[1] = Held(result.linear[1] + ((fall_ * elapsed / 2) >> kScaleBits));
  if (!SameTurn(state, base)) {
    const FixedQuaternion& q = prediction.base_orientation;
    FixedQuaternion turn = Multiply(ToFixed(state, orientation_limit), Conjugate(q));
    const std::int64_t sign = turn[3] < 0 ? -1 : 1;
    for (std::size_t i = 0; i < 3; ++i) {
      result.angular[i] = Held(sign * turn[i] * angular_per_turn_ / elapsed >> kFixedBits);
    }
  }
  result.linear_parameter = prediction.flies ? 1 : std::clamp(prediction.move_bits - 2, 1, 5);
  result.angular_parameter = prediction.flies ? 1 : std::clamp(prediction.turn_bits, 1, 5);
  return result;
}

PackedRecord PackVelocities(const VelocityEstimate& estimate, const QuantizedState& state) {
  PackedRecord record;
  for (std::size_t i = 0; i < 3; ++i) {
    AppendGolomb(record, std::int64_t{state.linear[i]} - estimate.linear[i], estimate.linear_parameter);
  }
  for (std::size_t i = 0; i < 3; ++i) {
    AppendGolomb(record, std::int64_t{state.angular[i]} - estimate.angular[i], estimate.angular_parameter);
  }
  return record;
}

bool ReadVelocities(BitReader& reader, const VelocityEstimate& estimate, QuantizedState& state) {
  for (std::size_t i = 0; i < 3; ++i) {
    if (!ReadOne(reader, estimate.linear[i], estimate.linear_parameter, state.linear[i])) return false;
  }
  for (std::size_t i = 0; i < 3; ++i) {
    if (!ReadOne(reader, estimate.angular[i], estimate.angular_parameter, state.angular[i])) return false;
  }
  return true;
}

}  // namespace tessera::replication
