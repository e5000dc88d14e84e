// Rotations in integers, by which both ends of a codec predict orientations.
//
// A FixedQuaternion has components x, y, z, w in 1 / 2^30. Everything is 64-bit integer arithmetic, so that two hosts,
// compilers or instruction sets never differ by a bit. Thread rule: free functions; any thread.
#pragma once

#include <array>
#include <cstdint>

#include "core/replication/quantize.h"

namespace tessera::replication {

using FixedQuaternion = std::array<std::int64_t, 4>;

inline constexpr int kFixedBits = 30;
inline constexpr std::int64_t kFixedOne = std::int64_t{1} << kFixedBits;

// The greatest integer whose square is at most `value`.
std::uint64_t SquareRoot(std::uint64_t value);

// The quaternion of a state's "smallest three" at `limit` = Quantizer::orientation_limit().
FixedQuaternion ToFixed(const QuantizedState& state, std::int32_t limit);
// The three components but `largest` of a unit quaternion, or of its opposite so that `largest` is not negative, as the
// wire counts them. Within +-limit.
std::array<std::int16_t, 3> ToSmallest(const FixedQuaternion& q, std::uint8_t largest, std::int32_t limit);
std::uint8_t LargestOf(const FixedQuaternion& q);

constexpr FixedQuaternion Conjugate(const FixedQuaternion& q) { return {-q[0], -q[1], -q[2], q[3]}; }
constexpr FixedQuaternion Multiply(const FixedQuaternion& a, const FixedQuaternion& b) {
  const auto [ax, ay, az, aw] = a;
  const auto [bx, by, bz, bw] = b;
  return {(aw * bx + ax * bw + ay * bz - az * by) >> kFixedBits, (aw * by - ax * bz + ay * bw + az * bx) >> kFixedBits,
          (aw * bz + ax * by - ay * bx + az * bw) >> kFixedBits, (aw * bw - ax * bx - ay * by - az * bz) >> kFixedBits};
}
FixedQuaternion Normalize(const FixedQuaternion& q);

// Extrapolates a turn from `older` to `base` in `gap` ticks by `ticks` more. A turn of more than about half a circle in
// all is not believed: the result is `base`. Requires gap >= 1.
FixedQuaternion SpinOn(const FixedQuaternion& base, const FixedQuaternion& older, std::uint64_t gap,
                       std::uint64_t ticks);
// The same by the turn, Multiply(base, Conjugate(older)), for a `base` that is not `older`.
FixedQuaternion SpinOnBy(FixedQuaternion turn, const FixedQuaternion& base, std::uint64_t gap, std::uint64_t ticks);

}  // namespace tessera::replication
