#include "core/replication/codec/pose_model.h"

namespace tessera::replication {
namespace {

// Steps within which two bodies are likely to touch, and the sine of half the angle by which one of everyday size rolls
// along a step. Both only choose contexts: any number codes right, these coded a pile of .4 m cubes shortest.
constexpr std::int64_t kTouching = 256;
constexpr std::int64_t kRollPerStep = kFixedOne / 200;

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

}  // namespace

BitModel& PoseModel::Same(const Prediction& prediction, const QuantizedState& base, bool moved) {
  std::size_t at = static_cast<std::size_t>(std::min(prediction.move_bits, 11));
  at = at * 2 + (base.asleep ? 1 : 0);
  at = at * 3 + static_cast<std::size_t>(std::min(prediction.turn_bits, 2));
  return same_[at * 2 + (moved ? 1 : 0)];
}

template <class Coder>
bool PoseModel::CodePosition(Coder& coder, const Prediction& prediction, const QuantizedState& base, const Miss* near,
                             QuantizedState& state, std::array<std::int64_t, 3>& missed) {
  const int touching = near != nullptr && Distance(near->base, base.position) < kTouching ? 1 : 0;
  int grade = 0, order = 0;
  for (const std::size_t axis : {std::size_t{1}, std::size_t{0}, std::size_t{2}}) {
    const int up = prediction.flies ? 2 : axis == 1 ? 1 : 0;
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
    ++order;
  }
  return true;
}

template <class Coder>
bool PoseModel::CodeOrientation(Coder& coder, const Prediction& prediction, const Miss* near,
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
  for (std::size_t i = 0; i < 3; ++i) {
    const int spin = base[i] == predicted[i] ? 0 : predicted[i] > base[i] ? 1 : 2;
    const int hint = beside[i] - predicted[i], roll = rolled[i] - predicted[i];
    const std::array<NumberModel*, kTurnViews> views{
        &turn_by_spin_.At({prediction.turn_bits, prediction.wobble_bits, grade, amount}),
        &turn_by_course_.At({LengthOf(predicted[i] - base[i]), spin, grade, amount}),
        &turn_by_miss_.At({LengthOf(longest), prediction.wobble_bits, grade}),
        &turn_by_motion_.At({prediction.move_bits, prediction.change_bits / 2, grade}),
        &turn_by_neighbour_.At({near == nullptr ? 0 : 1 + LengthOf(hint), SignOf(hint), grade, amount}),
        &turn_by_roll_.At({LengthOf(roll), SignOf(roll), grade})};
    std::int64_t residual = state.smallest[i] - predicted[i];
    replication::Code(coder, residual, views, turn_mixers_[prediction.flies ? 1 : 0]);
    const std::int64_t value = predicted[i] + residual;
    if (value < -limit_ || value > limit_) return false;
    state.smallest[i] = static_cast<std::int16_t>(value);
    grade = 1 + Grade(residual);
  }
  return true;
}

template <class Coder>
bool PoseModel::Code(Coder& coder, const Prediction& prediction, const QuantizedState& base, const Miss* near,
                     QuantizedState& state) {
  replication::Code(coder, state.asleep, asleep_[base.asleep ? 1 : 0][prediction.move_bits == 0 ? 1 : 0]);
  std::array<std::int64_t, 3> missed{};
  return CodePosition(coder, prediction, base, near, state, missed) &&
         CodeOrientation(coder, prediction, near, missed, state);
}

template bool PoseModel::Code(RangeEncoder&, const Prediction&, const QuantizedState&, const Miss*, QuantizedState&);
template bool PoseModel::Code(RangeDecoder&, const Prediction&, const QuantizedState&, const Miss*, QuantizedState&);

}  // namespace tessera::replication
