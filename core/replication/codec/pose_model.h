// PoseModel: what an adaptive coder has learnt of how bodies miss their predictions, and the coding of one body's pose
// with it. The part of the dense coder that knows about motion.
//
// Contexts: how far the body was to move and turn, how well its past fits a steady motion, which way it goes, what its
// other coordinates missed, what a neighbour coded before it missed, how it would turn if it rolled by what its
// position missed, and whether it stood on the floor. The height of a box follows from its orientation where it stands.
// Thread rule: as bit_model.h.
#pragma once

#include "core/replication/codec/number_model.h"
#include "core/replication/codec/predict.h"
#include "core/replication/codec/standing_box.h"

namespace tessera::replication {

// How far a body that was coded in this frame missed its prediction: a hint for the bodies near it.
struct Miss {
  std::array<std::int64_t, 3> base{};  // position of its baseline
  std::array<std::int64_t, 3> position{};
  FixedQuaternion turn{0, 0, 0, kFixedOne};
};

class PoseModel {
 public:
  explicit PoseModel(std::int32_t orientation_limit) : limit_(orientation_limit) {}

  // Position, orientation and sleep of `state` against `prediction`; velocities are left out. `near` and `box` may be
  // null. A decoder gets what an encoder was given; false if it is beyond all range.
  template <class Coder>
  bool Code(Coder& coder, const Prediction& prediction, const QuantizedState& base, const Miss* near,
            const StandingBox* box, QuantizedState& state);
  // Whether anything of the body differs from `base`, as its prediction and the body before it (`moved`) suggest.
  BitModel& Same(const Prediction& prediction, const QuantizedState& base, bool moved);

 private:
  static constexpr std::size_t kPositionViews = 5, kHeightViews = 4, kTurnViews = 6;
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
  bool CodeAxis(Coder& coder, const Prediction& prediction, const QuantizedState& base, const Miss* near,
                std::size_t axis, bool stood, int& grade, int order, QuantizedState& state,
                std::array<std::int64_t, 3>& missed);
  template <class Coder>
  bool CodeHeight(Coder& coder, const Prediction& prediction, const QuantizedState& base, const Miss* near,
                  const StandingBox& box, int grade, QuantizedState& state);
  template <class Coder>
  bool CodeOrientation(Coder& coder, const Prediction& prediction, const Miss* near, bool stood,
                       const std::array<std::int64_t, 3>& missed, QuantizedState& state);

  std::int32_t limit_;
  // First index 1 for the height, 2 for a body that flies, 3 for one that stood. Sizes are where more learnt too
  // slowly.
  Table<4, 9, 7, 4> by_motion_;
  Table<4, 9, 9> by_course_, by_change_;
  Table<4, 7, 6, 4> by_turn_;
  Table<4, 9, 5, 4> by_neighbour_;
  std::array<NumberMixer<kPositionViews>, 4> position_mixers_;
  // First index: how the body and the floor are.
  Table<5, 5, 9, 4> height_by_lift_;
  Table<5, 9, 4> height_by_motion_;
  Table<5, 8, 5> height_by_turn_;
  Table<5, 9, 3, 3> height_by_course_;
  std::array<NumberMixer<kHeightViews>, 2> height_mixers_;  // second: bodies that stood
  Table<8, 7, 5, 4> turn_by_spin_;
  Table<8, 3, 5, 4> turn_by_course_;
  Table<8, 7, 5, 3> turn_by_miss_;
  Table<9, 7, 5, 3> turn_by_motion_;
  Table<8, 5, 5, 4> turn_by_neighbour_;
  Table<8, 3, 5, 3> turn_by_roll_;
  std::array<NumberMixer<kTurnViews>, 3> turn_mixers_;  // second: bodies that fly; third: that stood
  std::array<std::array<BitModel, 4>, 4> largest_;      // by the predicted one
  std::array<std::array<BitModel, 2>, 2> asleep_;
  std::array<BitModel, 12 * 2 * 3 * 2> same_;
};

}  // namespace tessera::replication
