// PoseModel: what an adaptive coder has learnt of how bodies miss their predictions, and the coding of one body's pose
// with it. The part of the dense coder that knows about motion.
//
// Contexts: how far the body was to move and turn, how well its past fits a steady motion, which way it goes, what its
// other coordinates missed, what a neighbour coded before it missed, and how it would turn if it rolled by what its
// position missed. Thread rule: as bit_model.h.
#pragma once

#include "core/replication/codec/number_model.h"
#include "core/replication/codec/predict.h"

namespace tessera::replication {

// What a body that has been coded in this frame missed its prediction by: a hint for those near it.
struct Miss {
  std::array<std::int64_t, 3> base{};  // position of its baseline
  std::array<std::int64_t, 3> position{};
  FixedQuaternion turn{0, 0, 0, kFixedOne};
};

class PoseModel {
 public:
  explicit PoseModel(std::int32_t orientation_limit) : limit_(orientation_limit) {}

  // Position, orientation and sleep of `state` against `prediction`; velocities are not told. `near` may be null. A
  // decoder gets what an encoder was given; false if it is beyond all range.
  template <class Coder>
  bool Code(Coder& coder, const Prediction& prediction, const QuantizedState& base, const Miss* near,
            QuantizedState& state);
  // Whether anything of the body differs from `base`, as its prediction and the body before it (`moved`) suggest.
  BitModel& Same(const Prediction& prediction, const QuantizedState& base, bool moved);

 private:
  static constexpr std::size_t kPositionViews = 5, kTurnViews = 6;
  template <std::size_t... kSizes>
  struct Table {
    std::array<NumberModel, (kSizes * ...)> models;
    NumberModel& At(const std::array<int, sizeof...(kSizes)>& index) {
      constexpr std::array<std::size_t, sizeof...(kSizes)> kExtents{kSizes...};
      std::size_t at = 0;
      for (std::size_t i = 0; i < kExtents.size(); ++i) {
        at = at * kExtents[i] + std::min(static_cast<std::size_t>(index[i]), kExtents[i] - 1);
      }
      return models[at];
    }
  };

  template <class Coder>
  bool CodePosition(Coder& coder, const Prediction& prediction, const QuantizedState& base, const Miss* near,
                    QuantizedState& state, std::array<std::int64_t, 3>& missed);
  template <class Coder>
  bool CodeOrientation(Coder& coder, const Prediction& prediction, const Miss* near,
                       const std::array<std::int64_t, 3>& missed, QuantizedState& state);

  std::int32_t limit_;
  // First index 1 for the height, 2 for what flies. Sizes are where more learnt too slowly.
  Table<3, 9, 7, 4> by_motion_;
  Table<3, 9, 9> by_course_, by_change_;
  Table<3, 7, 6, 4> by_turn_;
  Table<3, 9, 5, 4> by_neighbour_;
  std::array<NumberMixer<kPositionViews>, 3> position_mixers_;
  Table<8, 7, 5, 4> turn_by_spin_;
  Table<8, 3, 5, 4> turn_by_course_;
  Table<8, 7, 5> turn_by_miss_;
  Table<9, 7, 5> turn_by_motion_;
  Table<8, 5, 5, 4> turn_by_neighbour_;
  Table<8, 3, 5> turn_by_roll_;
  std::array<NumberMixer<kTurnViews>, 2> turn_mixers_;  // second for what flies
  std::array<std::array<BitModel, 4>, 4> largest_;      // by the predicted one
  std::array<std::array<BitModel, 2>, 2> asleep_;
  std::array<BitModel, 12 * 2 * 3 * 2> same_;
};

}  // namespace tessera::replication
