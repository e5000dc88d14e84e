#include "core/replication/codec/predict.h"

#include <algorithm>
#include <bit>
#include <cassert>
#include <cmath>

#include "core/replication/codec/rounded.h"

namespace tessera::replication {
namespace {

constexpr int kGravityBits = 16;
constexpr int kTurnShift = kFixedBits - 8;  // 2^30 is the sine of half a turn's half

int Bits(std::int64_t value) { return static_cast<int>(std::bit_width(static_cast<std::uint64_t>(std::abs(value)))); }

FixedQuaternion Turn(const FixedQuaternion& from, const FixedQuaternion& to) { return Multiply(to, Conjugate(from)); }

// Whether the samples give a motion, and how it changes.
bool HasPast(const Samples& s) {
  return s.older != nullptr && s.gap != 0 && s.ticks <= kMaxPredictedTicks && s.gap <= kMaxPredictedTicks;
}
bool HasLongPast(const Samples& s) { return s.oldest != nullptr && s.gap2 > 0 && s.gap2 <= kMaxPredictedTicks; }

// By the longest component of `turn`.
int TurnBits(const FixedQuaternion& turn, std::uint64_t ticks, std::uint64_t gap) {
  const std::int64_t longest = std::max({std::abs(turn[0]), std::abs(turn[1]), std::abs(turn[2])});
  return Bits((longest * static_cast<std::int64_t>(ticks) / static_cast<std::int64_t>(gap)) >> kTurnShift);
}

}  // namespace

PosePredictor::PosePredictor(const Quantizer& quantizer, const SnapshotSettings& settings, double gravity_m_s2)
    : gravity_(std::llround(gravity_m_s2 / settings.position_step_m / settings.tick_rate_hz / settings.tick_rate_hz *
                            static_cast<double>(1 << kGravityBits))),
      orientation_limit_(quantizer.orientation_limit()) {}

// The last two mean velocities differ by gravity, give or take a third and what rounding does.
bool PosePredictor::Flies(const Samples& s) const {
  if (s.oldest == nullptr || gravity_ == 0) return false;
  const auto gap = static_cast<std::int64_t>(s.gap), gap2 = static_cast<std::int64_t>(s.gap2);
  const std::int64_t late = s.base->position[1] - s.older->position[1];
  const std::int64_t early = s.older->position[1] - s.oldest->position[1];
  constexpr std::int64_t kTooFast = std::int64_t{1} << 24;  // keeps what follows within 64 bits
  if (std::abs(late) > kTooFast || std::abs(early) > kTooFast || std::abs(gravity_) > kTooFast) return false;
  // late / gap - early / gap2 = g (gap + gap2) / 2, both sides times 2 gap gap2.
  const std::int64_t differ = 2 * (late * gap2 - early * gap);
  const std::int64_t expected = gravity_ * gap * gap2 * (gap + gap2);
  return std::abs((differ << kGravityBits) - expected) * 3 < std::abs(expected) && std::abs(expected) > 0;
}

bool PosePredictor::Falls(const Samples& s) const { return HasPast(s) && HasLongPast(s) && Flies(s); }

Prediction PosePredictor::Predict(const Samples& s) const {
  Prediction result = PredictMove(s);
  PredictTurn(s, result);
  return result;
}

Prediction PosePredictor::PredictMove(const Samples& s) const {
  assert(s.base != nullptr);
  Prediction result{.position = s.base->position};
  if (!HasPast(s)) return result;
  const auto ticks = static_cast<std::int64_t>(s.ticks), gap = static_cast<std::int64_t>(s.gap);
  result.flies = HasLongPast(s) && Flies(s);
  // A flying body moves steadily, so the longer span gives its velocity more exactly: rounding is a smaller part of it.
  const QuantizedState& from = result.flies ? *s.oldest : *s.older;
  const std::int64_t span = gap + (result.flies ? static_cast<std::int64_t>(s.gap2) : 0);
  std::int64_t longest = 0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::int64_t move = RoundedQuotient((s.base->position[axis] - from.position[axis]) * ticks, span);
    longest = std::max(longest, std::abs(move));
    result.position[axis] += move;
  }
  if (result.flies) {
    // From the mean velocity over the span, which is that of its middle: v t + g t (t + span) / 2.
    result.position[1] += (gravity_ * ticks * (ticks + span)) >> (kGravityBits + 1);
  }
  if (result.position[1] < s.floor && s.base->position[1] >= s.floor) result.position[1] = s.floor;
  for (std::int64_t& c : result.position) c = std::clamp(c, -kMaxPosition, kMaxPosition);
  result.move_bits = Bits(longest);
  return result;
}

void PosePredictor::PredictTurn(const Samples& s, Prediction& result) const {
  result.orientation = result.base_orientation = ToFixed(*s.base, orientation_limit_);
  if (!HasPast(s) || SameTurn(*s.base, *s.older)) return;
  const FixedQuaternion older = ToFixed(*s.older, orientation_limit_);
  const FixedQuaternion turn = Turn(older, result.base_orientation);
  result.turn_bits = TurnBits(turn, s.ticks, s.gap);
  if (result.flies) {
    const FixedQuaternion oldest = ToFixed(*s.oldest, orientation_limit_);
    result.orientation = SpinOn(result.base_orientation, oldest, s.gap + s.gap2, s.ticks);
  } else if (result.base_orientation != older) {
    result.orientation = SpinOnBy(turn, result.base_orientation, s.gap, s.ticks);
  }
}

Prediction PosePredictor::PredictWithFit(const Samples& s) const {
  Prediction result = Predict(s);
  if (!HasPast(s) || !HasLongPast(s)) return result;
  const auto ticks = static_cast<std::int64_t>(s.ticks), gap = static_cast<std::int64_t>(s.gap);
  const auto gap2 = static_cast<std::int64_t>(s.gap2);
  std::int64_t change = 0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    result.change[axis] = RoundedQuotient((s.base->position[axis] - s.older->position[axis]) * ticks, gap) -
                          RoundedQuotient((s.older->position[axis] - s.oldest->position[axis]) * ticks, gap2);
    if (result.flies && axis == 1) result.change[1] -= (gravity_ * ticks * (gap + gap2)) >> (kGravityBits + 1);
    change = std::max(change, std::abs(result.change[axis]));
  }
  result.change_bits = Bits(change);
  if (SameTurn(*s.base, *s.older) && SameTurn(*s.older, *s.oldest)) return result;
  const FixedQuaternion spun =
      SpinOn(ToFixed(*s.older, orientation_limit_), ToFixed(*s.oldest, orientation_limit_), s.gap2, s.gap);
  result.wobble_bits = TurnBits(Turn(spun, result.base_orientation), s.ticks, s.gap);
  return result;
}

}  // namespace tessera::replication
