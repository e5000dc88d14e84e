#include "core/replication/codec/rotation.h"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "core/replication/codec/rounded.h"

namespace tessera::replication {
namespace {

constexpr std::int64_t kHalfSquareRoot = 759250125;  // sqrt(1/2)
constexpr FixedQuaternion kIdentity{0, 0, 0, kFixedOne};

// The share part / whole of the turn `r`, by the straight line between the quaternions: exact enough for part of a
// turn that is small itself.
FixedQuaternion Share(const FixedQuaternion& r, std::int64_t part, std::int64_t whole) {
  FixedQuaternion q{};
  for (std::size_t i = 0; i < 4; ++i) q[i] = kIdentity[i] + (r[i] - kIdentity[i]) * part / whole;
  return Normalize(q);
}

}  // namespace

std::uint64_t SquareRoot(std::uint64_t value) {
  // The estimate may be off by rounding, differently on different hosts; the result is not.
  auto root = static_cast<std::uint64_t>(std::sqrt(static_cast<double>(value)));
  root = std::min<std::uint64_t>(root, 0xffffffff);
  while (root * root > value) --root;
  while (root < 0xffffffff && (root + 1) * (root + 1) <= value) ++root;
  return root;
}

FixedQuaternion ToFixed(const QuantizedState& state, std::int32_t limit) {
  const auto component = [&](std::size_t i) { return RoundedQuotient(state.smallest[i] * kHalfSquareRoot, limit); };
  const std::int64_t a = component(0), b = component(1), c = component(2);
  const auto with = [&](std::int64_t largest) {
    switch (state.largest) {
      case 0:
        return FixedQuaternion{largest, a, b, c};
      case 1:
        return FixedQuaternion{a, largest, b, c};
      case 2:
        return FixedQuaternion{a, b, largest, c};
      default:
        return FixedQuaternion{a, b, c, largest};
    }
  };
  const std::int64_t left = kFixedOne * kFixedOne - a * a - b * b - c * c;
  if (left < 0) return Normalize(with(0));  // only what no sender writes
  return with(static_cast<std::int64_t>(SquareRoot(static_cast<std::uint64_t>(left))));
}

std::uint8_t LargestOf(const FixedQuaternion& q) {
  std::uint8_t largest = 3;
  for (std::uint8_t i = 0; i < 3; ++i) {
    if (std::abs(q[i]) > std::abs(q[largest])) largest = i;
  }
  return largest;
}

std::array<std::int16_t, 3> ToSmallest(const FixedQuaternion& q, std::uint8_t largest, std::int32_t limit) {
  assert(largest < 4);
  const std::int64_t scale = q[largest] < 0 ? -limit : limit;
  std::array<std::int16_t, 3> smallest{};
  for (std::size_t i = 0, out = 0; i < 4; ++i) {
    if (i == largest) continue;
    const std::int64_t steps = RoundedQuotient(q[i] * scale, kHalfSquareRoot);
    smallest[out++] = static_cast<std::int16_t>(std::clamp<std::int64_t>(steps, -limit, limit));
  }
  return smallest;
}

FixedQuaternion Normalize(const FixedQuaternion& q) {
  std::uint64_t sum = 0;
  for (const std::int64_t c : q) sum += static_cast<std::uint64_t>(c * c);
  const auto length = static_cast<std::int64_t>(SquareRoot(sum));
  if (length == 0) return kIdentity;
  FixedQuaternion unit{};
  for (std::size_t i = 0; i < 4; ++i) unit[i] = q[i] * kFixedOne / length;
  return unit;
}

FixedQuaternion SpinOn(const FixedQuaternion& base, const FixedQuaternion& older, std::uint64_t gap,
                       std::uint64_t ticks) {
  if (base == older) return base;
  return SpinOnBy(Multiply(base, Conjugate(older)), base, gap, ticks);
}

FixedQuaternion SpinOnBy(FixedQuaternion turn, const FixedQuaternion& base, std::uint64_t gap, std::uint64_t ticks) {
  assert(gap >= 1);
  if (turn[3] < 0) {
    for (std::int64_t& c : turn) c = -c;
  }
  const auto sine = static_cast<std::int64_t>(
      SquareRoot(static_cast<std::uint64_t>(turn[0] * turn[0] + turn[1] * turn[1] + turn[2] * turn[2])));
  // Half the angle is about its sine; the whole prediction is that times ticks / gap.
  constexpr std::int64_t kMaxHalfAngle = kFixedOne + kFixedOne / 2;
  constexpr std::uint64_t kMaxTicks = 256;
  if (ticks > kMaxTicks || gap > kMaxTicks) return base;
  if (sine * static_cast<std::int64_t>(ticks) > kMaxHalfAngle * static_cast<std::int64_t>(gap)) return base;
  if (ticks == gap) return Normalize(Multiply(turn, base));  // mostly; the same as what follows
  FixedQuaternion whole = kIdentity, power = turn;
  for (std::uint64_t n = ticks / gap; n > 0; n >>= 1) {
    // At most 16 products of lengths within 2^-28 of one: normalising at the end is enough.
    if ((n & 1) != 0) whole = Multiply(whole, power);
    if (n > 1) power = Multiply(power, power);
  }
  if (ticks % gap != 0) {
    whole = Multiply(whole, Share(turn, static_cast<std::int64_t>(ticks % gap), static_cast<std::int64_t>(gap)));
  }
  return Normalize(Multiply(whole, base));
}

}  // namespace tessera::replication
