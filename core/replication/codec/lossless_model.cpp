#include "core/replication/codec/lossless_model.h"

#include "core/replication/codec/frame_codec_impl.h"

namespace tessera::replication {
namespace {

// IEEE bits in the order of their values: negative numbers count down.
std::int64_t Ordered(double value) {
  const auto bits = std::bit_cast<std::int64_t>(value);
  return bits < 0 ? bits ^ std::numeric_limits<std::int64_t>::max() : bits;
}
double FromOrdered64(std::int64_t word) {
  return std::bit_cast<double>(word < 0 ? word ^ std::numeric_limits<std::int64_t>::max() : word);
}
std::int64_t Ordered(float value) {
  const auto bits = std::bit_cast<std::int32_t>(value);
  return bits < 0 ? bits ^ std::numeric_limits<std::int32_t>::max() : bits;
}
float FromOrdered32(std::int64_t word) {
  const auto bits = static_cast<std::int32_t>(word);
  return std::bit_cast<float>(bits < 0 ? bits ^ std::numeric_limits<std::int32_t>::max() : bits);
}

std::int64_t WrappingSum(std::int64_t a, std::int64_t b) {
  return static_cast<std::int64_t>(static_cast<std::uint64_t>(a) + static_cast<std::uint64_t>(b));
}
std::int64_t WrappingDifference(std::int64_t a, std::int64_t b) {
  return static_cast<std::int64_t>(static_cast<std::uint64_t>(a) - static_cast<std::uint64_t>(b));
}

constexpr std::size_t kDoubles = 7;  // of the words, the first ones

}  // namespace

LosslessModel::Words LosslessModel::ToWords(const State& s) {
  const Vec3f &v = s.linear_velocity, &w = s.angular_velocity, &l = s.angular_momentum;
  return {Ordered(s.position.x),
          Ordered(s.position.y),
          Ordered(s.position.z),
          Ordered(s.orientation.x),
          Ordered(s.orientation.y),
          Ordered(s.orientation.z),
          Ordered(s.orientation.w),
          Ordered(v.x),
          Ordered(v.y),
          Ordered(v.z),
          Ordered(w.x),
          Ordered(w.y),
          Ordered(w.z),
          Ordered(l.x),
          Ordered(l.y),
          Ordered(l.z),
          Ordered(s.still_s)};
}

LosslessModel::State LosslessModel::FromWords(const Words& w, bool asleep) {
  const auto d = [&](std::size_t i) { return FromOrdered64(w[i]); };
  const auto f = [&](std::size_t i) { return FromOrdered32(w[i]); };
  return {.position = {d(0), d(1), d(2)},
          .orientation = {d(3), d(4), d(5), d(6)},
          .linear_velocity = {f(7), f(8), f(9)},
          .angular_velocity = {f(10), f(11), f(12)},
          .angular_momentum = {f(13), f(14), f(15)},
          .still_s = f(16),
          .asleep = asleep};
}

template <class Coder>
void LosslessModel::CodeWord(Coder& coder, std::int64_t& value, WordModel& model) {
  const std::uint64_t wanted = Magnitude(value);
  const auto told = static_cast<unsigned>(std::bit_width(wanted));  // 64 only for the least number of all
  std::size_t node = 1;
  for (int i = 6; i >= 0; --i) {
    bool bit = (told >> i & 1) != 0;
    Code(coder, bit, model.length[node]);
    node = 2 * node + (bit ? 1 : 0);
  }
  const std::size_t length = std::min<std::size_t>(node - 128, 64);
  if (length == 0) {
    value = 0;
    return;
  }
  bool negative = value < 0;
  Code(coder, negative, model.sign[length]);
  std::uint64_t magnitude = 1;
  for (int i = static_cast<int>(length) - 2; i >= 0; --i) {
    bool bit = (wanted >> i & 1) != 0;
    const int depth = static_cast<int>(length) - 2 - i;
    if (depth < 2) {
      Code(coder, bit, model.top[length][depth == 0 ? 0 : 1 + (magnitude & 1)]);
    } else {
      Code(coder, bit, kEvenOdds);
    }
    magnitude = 2 * magnitude + (bit ? 1 : 0);
  }
  value = static_cast<std::int64_t>(negative ? 0 - magnitude : magnitude);
}

template <class Coder>
void LosslessModel::CodeWords(Coder& coder, const Words& predicted, std::array<WordModel, kWords>& models,
                              Words& words) {
  for (std::size_t i = 0; i < kWords; ++i) {
    std::int64_t change = WrappingDifference(words[i], predicted[i]);
    CodeWord(coder, change, models[i]);
    words[i] = WrappingSum(predicted[i], change);
  }
}

template <class Coder>
bool LosslessModel::CodeState(Coder& coder, const Setup&, const BodyHistory<State>& history, State& state) {
  const Words base = ToWords(*history.base);
  Words words = ToWords(state);
  bool same = words == base && state.asleep == history.base->asleep;
  Code(coder, same, same_[(history.base->asleep ? 2u : 0u) + (moved_ ? 1u : 0u)]);
  moved_ = !same;
  if (same) {
    state = *history.base;
    return true;
  }
  Code(coder, state.asleep, asleep_[history.base->asleep ? 1 : 0]);
  Words predicted = base;
  if (history.older != nullptr && history.gap == history.ticks) {
    const Words older = ToWords(*history.older);
    for (std::size_t i = 0; i < kDoubles; ++i) {
      predicted[i] = WrappingSum(base[i], WrappingDifference(base[i], older[i]));
    }
  }
  CodeWords(coder, predicted, change_, words);
  state = FromWords(words, state.asleep);
  return true;
}

template <class Coder>
bool LosslessModel::CodeArrival(Coder& coder, const Setup&, const State& beside, State& state) {
  Words words = ToWords(state);
  Code(coder, state.asleep, asleep_[0]);
  CodeWords(coder, ToWords(beside), arrival_, words);
  state = FromWords(words, state.asleep);
  return true;
}

template class FrameCodec<LosslessModel>;

}  // namespace tessera::replication
