#include "core/replication/codec/pose_model.h"

namespace tessera::replication {
namespace {

// Steps within which two bodies are likely to touch, and the sine of half the angle by which one of everyday size rolls
// along a step. They only choose contexts: any number codes right, these coded a pile of .4 m cubes shortest.
constexpr std::int64_t kTouching = 256;
constexpr std::int64_t kRollPerStep = kFixedOne / 200;
// Steps above the floor up to which rounding alone may have lifted a body that stands on it.
constexpr std::int64_t kStanding = 3;

int SignOf(std::int64_t value, std::int64_t threshold = 0) {
  return value > threshold ? 1 : value < -threshold ? 2 : 0;
}

// 0 to 3: nothing, little, some, much.
int Grade(std::int64_t missed) {
  const int length = LengthOf(missed);
  return length == 0 ? 0 : length <= 2 ? 1 : length <= 4 ? 2 : 3;
}

std::int64_t Distance(const std::array<std::int64_t, 3>& a, const std::array<std::int64_t, 3>& b) {
  return std::max({std::abs(a[0] - b[0]), std::abs(a[1] - b[1]), std::abs(a[2] - b[2])});
}

// The turn of a body that rolls on the ground by what its position missed.
FixedQuaternion RollBy(const std::array<std::int64_t, 3>& missed) {
  const auto sine = [](std::int64_t steps) { return std::clamp<std::int64_t>(steps, -200, 200) * kRollPerStep; };
  return Normalize({sine(missed[2]), 0, -sine(missed[0]), kFixedOne});
}

// Whether the body was on the floor.
bool Stood(const Prediction& prediction, const QuantizedState& base, const StandingBox* box) {
  return box != nullptr && !prediction.flies &&
         base.position[1] - box->HeightAt(prediction.base_orientation) <= kStanding;
}

}  // namespace

BitModel& PoseModel::Same(const Prediction& prediction, const QuantizedState& base, bool moved) {
  std::size_t at = static_cast<std::size_t>(std::min(prediction.move_bits, 11));
  at = at * 2 + (base.asleep ? 1 : 0);
  at = at * 3 + static_cast<std::size_t>(std::min(prediction.turn_bits, 2));
  return same_[at * 2 + (moved ? 1 : 0)];
}

template <class Coder>
bool PoseModel::CodeAxis(Coder& coder, const Prediction& prediction, const QuantizedState& base, const Miss* near,
                         std::size_t axis, bool stood, int& grade, int order, QuantizedState& state,
                         std::array<std::int64_t, 3>& missed) {
  const int touching = near != nullptr && Distance(near->base, base.position) < kTouching ? 1 : 0;
  const int up = prediction.flies ? 2 : axis == 1 ? 1 : stood ? 3 : 0;
  const std::int64_t move = prediction.position[axis] - base.position[axis], change = prediction.change[axis];
  const int course = SignOf(move), turned = SignOf(change, 2);
  const int beside = near == nullptr ? 0 : SignOf(near->position[axis]);
  const std::array<NumberModel*, kPositionViews> views{
      &by_motion_.At({up, prediction.move_bits, prediction.change_bits / 2, grade}),
      &by_course_.At({up, LengthOf(move), course + 3 * turned}),
      &by_change_.At({up, LengthOf(change), 3 * turned + order}),
      &by_turn_.At({up, prediction.turn_bits, prediction.wobble_bits, grade}),
      &by_neighbour_.At({up, near == nullptr ? 0 : 1 + LengthOf(near->position[axis]),
                         beside == 0 ? 0 : 2 * beside - 1 + touching, grade})};
  missed[axis] = state.position[axis] - prediction.position[axis];
  replication::Code(coder, missed[axis], views, position_mixers_[static_cast<std::size_t>(up)]);
  state.position[axis] = prediction.position[axis] + missed[axis];
  if (state.position[axis] < -kMaxPosition || state.position[axis] > kMaxPosition) return false;
  grade = Grade(missed[axis]);
  return true;
}

template <class Coder>
bool PoseModel::CodeHeight(Coder& coder, const Prediction& prediction, const QuantizedState& base, const Miss* near,
                           const StandingBox& box, int grade, QuantizedState& state) {
  const std::int64_t stands = box.HeightAt(ToFixed(state, limit_)), goes = prediction.position[1];
  const std::int64_t lift = base.position[1] - box.HeightAt(prediction.base_orientation);
  // Nothing is below the floor; a body that stood on it mostly stands on it still.
  const bool stood = Stood(prediction, base, &box), lands = goes <= stands;
  const std::int64_t expected = stood ? stands : std::max(goes, stands);
  const int footing = stood ? 0 : (prediction.flies ? 3 : 1) + (lands ? 0 : 1);
  const int beside = near == nullptr ? 0 : SignOf(near->position[1]);
  const std::array<NumberModel*, kHeightViews> views{
      &height_by_lift_.At({footing, LengthOf(lift), LengthOf(goes - stands), grade}),
      &height_by_motion_.At({footing, prediction.move_bits, grade}),
      &height_by_turn_.At({footing, prediction.turn_bits, prediction.wobble_bits}),
      &height_by_course_.At({footing, LengthOf(prediction.change[1]), SignOf(goes - stands), beside})};
  std::int64_t residual = state.position[1] - expected;
  replication::Code(coder, residual, views, height_mixers_[stood ? 1 : 0]);
  state.position[1] = expected + residual;
  return state.position[1] >= -kMaxPosition && state.position[1] <= kMaxPosition;
}

template <class Coder>
bool PoseModel::CodeOrientation(Coder& coder, const Prediction& prediction, const Miss* near, bool stood,
                                const std::array<std::int64_t, 3>& missed, QuantizedState& state) {
  std::array<BitModel, 4>& largest = largest_[LargestOf(prediction.orientation)];
  bool high = (state.largest & 2) != 0, low = (state.largest & 1) != 0;
  replication::Code(coder, high, largest[0]);
  replication::Code(coder, low, largest[high ? 2 : 1]);
  state.largest = static_cast<std::uint8_t>((high ? 2 : 0) + (low ? 1 : 0));

  const auto smallest = [&](const FixedQuaternion& q) { return ToSmallest(q, state.largest, limit_); };
  const std::array<std::int16_t, 3> predicted = smallest(prediction.orientation);
  const std::array<std::int16_t, 3> base = smallest(prediction.base_orientation);
  const std::array<std::int16_t, 3> beside =
      near == nullptr ? predicted : smallest(Normalize(Multiply(near->turn, prediction.orientation)));
  const std::array<std::int16_t, 3> rolled = smallest(Normalize(Multiply(RollBy(missed), prediction.orientation)));
  const std::int64_t longest = std::max({std::abs(missed[0]), std::abs(missed[1]), std::abs(missed[2])});
  const int amount = prediction.flies ? 3 : std::min(2, LengthOf(longest) / 2);
  int grade = 0;
  const int kind = prediction.flies ? 2 : stood ? 1 : 0;
  for (std::size_t i = 0; i < 3; ++i) {
    const int spin = base[i] == predicted[i] ? 0 : predicted[i] > base[i] ? 1 : 2;
    const int hint = beside[i] - predicted[i], roll = rolled[i] - predicted[i];
    const std::array<NumberModel*, kTurnViews> views{
        &turn_by_spin_.At({prediction.turn_bits, prediction.wobble_bits, grade, amount}),
        &turn_by_course_.At({LengthOf(predicted[i] - base[i]), spin, grade, amount}),
        &turn_by_miss_.At({LengthOf(longest), prediction.wobble_bits, grade, kind}),
        &turn_by_motion_.At({prediction.move_bits, prediction.change_bits / 2, grade, kind}),
        &turn_by_neighbour_.At({near == nullptr ? 0 : 1 + LengthOf(hint), SignOf(hint), grade, amount}),
        &turn_by_roll_.At({LengthOf(roll), SignOf(roll), grade, kind})};
    std::int64_t residual = state.smallest[i] - predicted[i];
    replication::Code(coder, residual, views, turn_mixers_[prediction.flies ? 1 : stood ? 2 : 0]);
    const std::int64_t value = predicted[i] + residual;
    if (value < -limit_ || value > limit_) return false;
    state.smallest[i] = static_cast<std::int16_t>(value);
    grade = 1 + Grade(residual);
  }
  return true;
}

template <class Coder>
bool PoseModel::Code(Coder& coder, const Prediction& prediction, const QuantizedState& base, const Miss* near,
                     const StandingBox* box, QuantizedState& state) {
  replication::Code(coder, state.asleep, asleep_[base.asleep ? 1 : 0][prediction.move_bits == 0 ? 1 : 0]);
  std::array<std::int64_t, 3> missed{};
  int grade = 0;
  const bool stood = Stood(prediction, base, box);
  if (box == nullptr && !CodeAxis(coder, prediction, base, near, 1, stood, grade, 0, state, missed)) return false;
  if (!CodeAxis(coder, prediction, base, near, 0, stood, grade, 1, state, missed)) return false;
  if (!CodeAxis(coder, prediction, base, near, 2, stood, grade, 2, state, missed)) return false;
  if (!CodeOrientation(coder, prediction, near, stood, missed, state)) return false;
  return box == nullptr || CodeHeight(coder, prediction, base, near, *box, grade, state);
}

template bool PoseModel::Code(RangeEncoder&, const Prediction&, const QuantizedState&, const Miss*, const StandingBox*,
                              QuantizedState&);
template bool PoseModel::Code(RangeDecoder&, const Prediction&, const QuantizedState&, const Miss*, const StandingBox*,
                              QuantizedState&);

}  // namespace tessera::replication
