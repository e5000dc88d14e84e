// VelocityEstimator: estimates a body's velocities from its samples, and codes how the true ones differ from that. They
// are sent only for bodies that the client predicts itself; for those that it only shows, the estimate serves.
//
//   PackedRecord packed = PackVelocities(estimator.From(base, state, prediction, ticks), state);
//   ...
//   if (!ReadVelocities(reader, estimator.From(base, state, prediction, ticks), state)) return error;
//
// All arithmetic is on integers, so that both ends estimate the same. Thread rule: const; any thread.
#pragma once

#include "core/replication/codec/fast_record.h"

namespace tessera::replication {

struct VelocityEstimate {
  std::array<std::int32_t, 3> linear{}, angular{};  // steps, as in QuantizedState
  int linear_parameter = 0, angular_parameter = 0;  // parameters of the codes (fast_record.h)
};

class VelocityEstimator {
 public:
  explicit VelocityEstimator(const SnapshotSettings& settings);
  // `state` is `ticks` after `base`, and awake; `prediction` is that of its pose. Requires ticks >= 1.
  VelocityEstimate From(const QuantizedState& base, const QuantizedState& state, const Prediction& prediction,
                        std::uint64_t ticks, std::int32_t orientation_limit) const;

 private:
  std::int64_t linear_per_position_;  // times 2^kScaleBits
  std::int64_t angular_per_turn_;     // steps of velocity for the sine of half a turn a tick
  std::int64_t fall_;                 // steps of velocity a tick, times 2^kScaleBits
};

PackedRecord PackVelocities(const VelocityEstimate& estimate, const QuantizedState& state);
// False where a number is out of its range.
bool ReadVelocities(BitReader& reader, const VelocityEstimate& estimate, QuantizedState& state);

}  // namespace tessera::replication
