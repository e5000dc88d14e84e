// PosePredictor: where a body will be, predicted from states that both ends have.
//
//   PosePredictor predictor(quantizer, gravity_m_s2);
//   Prediction now = predictor.Predict({.base = &b, .older = &p, .oldest = &q, .ticks = 6, .gap = 2, .gap2 = 3});
//
// Velocities come from the states themselves: a body that moved from `older` to `base` moves on. Where two successive
// velocities differ as gravity makes them differ, the body flies along a parabola, which ends on the floor where the
// caller knows one. A body that turned goes on turning. With `base` alone a body stays.
//
// All arithmetic is on integers, so that both ends predict the same bits on every machine. Thread rule: const; any
// thread.
#pragma once

#include <limits>

#include "core/replication/codec/rotation.h"

namespace tessera::replication {

struct Samples {
  const QuantizedState* base = nullptr;
  const QuantizedState* older = nullptr;   // `gap` ticks before base; may be absent
  const QuantizedState* oldest = nullptr;  // `gap2` ticks before older; may be absent, and is if older is
  std::uint64_t ticks = 0;                 // from base to the predicted state
  std::uint64_t gap = 0, gap2 = 0;
  std::int64_t floor = std::numeric_limits<std::int64_t>::min();  // lowest y of the body; it never was below
};

struct Prediction {
  std::array<std::int64_t, 3> position{};
  FixedQuaternion orientation{};
  FixedQuaternion base_orientation{};
  // How much is predicted to happen, as a number's length in bits: the longest coordinate's move in steps, the turn in
  // 1/512 of a half turn's sine. Residuals grow with them, so they choose how those are written.
  int move_bits = 0, turn_bits = 0;
  bool flies = false;  // it falls freely, so it goes as predicted however far
  // From PredictWithFit alone: the same of how far the last two moves differ, but for gravity where it flies, and by
  // axis: the better the past fits, the smaller the residuals.
  int change_bits = 0, wobble_bits = 0;
  std::array<std::int64_t, 3> change{};
};

class PosePredictor {
 public:
  // `gravity_m_s2` along y, usually negative; 0: nothing falls.
  PosePredictor(const Quantizer& quantizer, const SnapshotSettings& settings, double gravity_m_s2);

  Prediction Predict(const Samples& samples) const;
  // The same in two parts, for a reader that seldom needs the second: all but the turn, and then orientation,
  // base_orientation and turn_bits.
  Prediction PredictMove(const Samples& samples) const;
  void PredictTurn(const Samples& samples, Prediction& result) const;
  Prediction PredictWithFit(const Samples& samples) const;
  std::int32_t orientation_limit() const { return orientation_limit_; }
  // Differs, most likely, between settings other than the quantiser's that do not understand each other.
  std::uint32_t fingerprint() const { return static_cast<std::uint32_t>(gravity_); }

  // Whether the three samples lie on a parabola.
  bool Falls(const Samples& samples) const;

 private:
  bool Flies(const Samples& samples) const;

  std::int64_t gravity_;  // steps a tick^2, times 2^kGravityBits
  std::int32_t orientation_limit_;
};

}  // namespace tessera::replication
