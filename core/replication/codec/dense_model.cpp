#include "core/replication/codec/dense_model.h"

namespace tessera::replication {
namespace {

// Neighbours are sought among so many bodies coded last, which bounds the work, and within so many steps, the distance
// at which bodies still move together.
constexpr std::size_t kSearched = 64;
constexpr std::int64_t kNear = 1000;

// Null if the setup has no box for the body.
const StandingBox* BoxOf(const DenseSetup& setup, BodyId id) {
  if (setup.boxes == nullptr) return nullptr;
  const auto found = setup.boxes->find(id);
  return found == setup.boxes->end() ? nullptr : &found->second;
}

}  // namespace

void DenseModel::BeginFrame() {
  misses_.clear();
  moved_ = false;
}

QuantizedState DenseModel::Written(const DenseSetup& setup, const QuantizedState& state) {
  QuantizedState written = state;
  if (!setup.velocities || state.asleep) written.linear = written.angular = {};
  return written;
}

const Miss* DenseModel::Near(const std::array<std::int64_t, 3>& position) const {
  const Miss* nearest = nullptr;
  std::int64_t shortest = kNear * kNear;
  for (std::size_t i = misses_.size() > kSearched ? misses_.size() - kSearched : 0; i < misses_.size(); ++i) {
    std::int64_t squared = 0;
    bool far = false;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::int64_t d = misses_[i].base[axis] - position[axis];
      far = far || d > kNear || d < -kNear;
      squared += far ? 0 : d * d;
    }
    if (far || squared >= shortest) continue;
    shortest = squared;
    nearest = &misses_[i];
  }
  return nearest;
}

void DenseModel::Remember(const Prediction& prediction, const QuantizedState& base, const QuantizedState& state,
                          std::int32_t limit) {
  const FixedQuaternion& q = prediction.orientation;
  Miss miss{.base = base.position};
  for (std::size_t axis = 0; axis < 3; ++axis) miss.position[axis] = state.position[axis] - prediction.position[axis];
  miss.turn = Multiply(ToFixed(state, limit), Conjugate(q));
  if (miss.turn[3] < 0) {
    for (std::int64_t& c : miss.turn) c = -c;
  }
  misses_.push_back(miss);
}

template <class Coder>
bool DenseModel::CodeVelocities(Coder& coder, const QuantizedState& base, QuantizedState& state) {
  for (std::size_t i = 0; i < 6; ++i) {
    std::int32_t& value = i < 3 ? state.linear[i] : state.angular[i - 3];
    const std::int32_t before = i < 3 ? base.linear[i] : base.angular[i - 3];
    std::int64_t change = std::int64_t{value} - before;
    Code(coder, change, velocity_[i]);
    if (change < -2 * kMaxVelocity || change > 2 * kMaxVelocity) return false;
    const std::int64_t now = before + change;
    if (now < -kMaxVelocity || now > kMaxVelocity) return false;
    value = static_cast<std::int32_t>(now);
  }
  return true;
}

template <class Coder>
bool DenseModel::CodeState(Coder& coder, const DenseSetup& setup, const BodyHistory& history, QuantizedState& state) {
  const QuantizedState& base = *history.base;
  const Prediction prediction = setup.predictor.PredictWithFit({.base = history.base,
                                                                .older = history.older,
                                                                .oldest = history.oldest,
                                                                .ticks = history.ticks,
                                                                .gap = history.gap,
                                                                .gap2 = history.gap2});
  bool same = state == base;
  Code(coder, same, pose_.Same(prediction, base, moved_));
  moved_ = !same;
  if (same) {
    state = base;
  } else {
    if (!pose_.Code(coder, prediction, base, Near(base.position), BoxOf(setup, history.id), state)) return false;
    if (state.asleep || !setup.velocities) {
      state.linear = state.angular = {};
    } else if (!CodeVelocities(coder, base, state)) {
      return false;
    }
  }
  if (!same || prediction.move_bits > 0) Remember(prediction, base, state, setup.predictor.orientation_limit());
  return true;
}

template <class Coder>
bool DenseModel::CodeArrival(Coder& coder, const DenseSetup& setup, const QuantizedState& beside,
                             QuantizedState& state) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    std::int64_t change = state.position[axis] - beside.position[axis];
    Code(coder, change, arrival_position_[axis]);
    if (change < -2 * kMaxPosition || change > 2 * kMaxPosition) return false;
    state.position[axis] = beside.position[axis] + change;
    if (state.position[axis] < -kMaxPosition || state.position[axis] > kMaxPosition) return false;
  }
  Code(coder, state.asleep, arrival_flags_[0]);
  bool high = (state.largest & 2) != 0, low = (state.largest & 1) != 0;
  Code(coder, high, kEvenOdds);
  Code(coder, low, kEvenOdds);
  state.largest = static_cast<std::uint8_t>((high ? 2 : 0) + (low ? 1 : 0));
  const std::int64_t limit = setup.predictor.orientation_limit();
  for (std::size_t i = 0; i < 3; ++i) {
    std::int64_t value = state.smallest[i];
    Code(coder, value, arrival_orientation_[i]);
    if (value < -limit || value > limit) return false;
    state.smallest[i] = static_cast<std::int16_t>(value);
  }
  if (state.asleep || !setup.velocities) {
    state.linear = state.angular = {};
    return true;
  }
  for (std::size_t i = 0; i < 6; ++i) {
    std::int32_t& velocity = i < 3 ? state.linear[i] : state.angular[i - 3];
    std::int64_t value = velocity;
    Code(coder, value, arrival_velocity_[i]);
    if (value < -kMaxVelocity || value > kMaxVelocity) return false;
    velocity = static_cast<std::int32_t>(value);
  }
  return true;
}

template bool DenseModel::CodeState(RangeEncoder&, const DenseSetup&, const BodyHistory&, QuantizedState&);
template bool DenseModel::CodeState(RangeDecoder&, const DenseSetup&, const BodyHistory&, QuantizedState&);
template bool DenseModel::CodeArrival(RangeEncoder&, const DenseSetup&, const QuantizedState&, QuantizedState&);
template bool DenseModel::CodeArrival(RangeDecoder&, const DenseSetup&, const QuantizedState&, QuantizedState&);

}  // namespace tessera::replication
