// Sine, cosine and arc tangent with the same bits on every host.
//
// glibc picks other code, and other last bits, where the processor has FMA. These functions are plain sums and
// products, which IEEE 754 rounds one way only; state that must agree between hosts uses them. They are right to about
// one unit in the last place.
#pragma once

#include <array>
#include <cmath>
#include <numbers>

#include "core/world/math.h"

namespace tessera::physics {

struct SinCos {
  double sin = 0, cos = 1;
};

// For an angle from -pi/4 to pi/4, by Taylor's series, whose next term is below 1e-17 there.
constexpr SinCos SmallSinCos(double x) {
  const double y = x * x;
  constexpr double s3 = -1.0 / 6, s5 = 1.0 / 120, s7 = -1.0 / 5040, s9 = 1.0 / 362880, s11 = -1.0 / 39916800,
                   s13 = 1.0 / 6227020800, s15 = -1.0 / 1307674368000, s17 = 1.0 / 355687428096000;
  constexpr double c2 = -1.0 / 2, c4 = 1.0 / 24, c6 = -1.0 / 720, c8 = 1.0 / 40320, c10 = -1.0 / 3628800,
                   c12 = 1.0 / 479001600, c14 = -1.0 / 87178291200, c16 = 1.0 / 20922789888000;
  const double s = s3 + y * (s5 + y * (s7 + y * (s9 + y * (s11 + y * (s13 + y * (s15 + y * s17))))));
  const double c = c2 + y * (c4 + y * (c6 + y * (c8 + y * (c10 + y * (c12 + y * (c14 + y * c16))))));
  return {x + x * (y * s), 1 + y * c};
}

// For an angle from -1/16 to 1/16, as most bodies turn in a tick, by the same series in pairs of terms, so that fewer
// wait for one another.
constexpr SinCos TinySinCos(double x) {
  const double y = x * x, y2 = y * y;
  const double s = (-1.0 / 6 + y * (1.0 / 120)) + y2 * (-1.0 / 5040 + y * (1.0 / 362880));
  const double c = (-1.0 / 2 + y * (1.0 / 24)) + y2 * (-1.0 / 720 + y * (1.0 / 40320));
  return {x + x * (y * s), 1 + y * c};
}

// For any finite angle.
inline SinCos SinCosOf(double x) {
  constexpr double kQuarter = std::numbers::pi / 4;
  if (std::abs(x) <= 1.0 / 16) return TinySinCos(x);
  if (std::abs(x) <= kQuarter) return SmallSinCos(x);
  // Beyond that, 2 pi as a double is near enough: its error times the turns is less than half a unit in x's last place.
  if (std::abs(x) > 1e6) x = std::remainder(x, 2 * std::numbers::pi);
  // These are pi / 2 in parts of 33, 33 and 53 bits, so that its multiples are exact (Cody and Waite 1980).
  constexpr double kHigh = 0x1.921fb544p+0, kMiddle = 0x1.0b4611a6p-34, kLow = 0x1.3198a2e037073p-69;
  const double turns = std::round(x * (2 / std::numbers::pi));
  const SinCos r = SmallSinCos(((x - turns * kHigh) - turns * kMiddle) - turns * kLow);
  switch (static_cast<long>(turns) & 3) {
    case 0:
      return r;
    case 1:
      return {r.cos, -r.sin};
    case 2:
      return {-r.sin, -r.cos};
    default:
      return {-r.cos, r.sin};
  }
}

// Angle of (x, y) from the x axis, -pi to pi; 0 for (0, 0).
inline double Atan2(double y, double x) {
  const double ay = std::abs(y), ax = std::abs(x), larger = ax > ay ? ax : ay;
  if (larger == 0) return 0;
  const bool steep = ay > ax;
  const double t = steep ? ax / ay : ay / ax;
  // atan(t) = atan(c) + atan((t - c) / (1 + t c)), c the nearest eighth: a 16th at most is left to the series.
  constexpr std::array<double, 9> kAtanOfEighths{0.0,
                                                 0.12435499454676143816,
                                                 0.24497866312686414347,
                                                 0.35877067027057224502,
                                                 0.46364760900080609352,
                                                 0.55859931534356244143,
                                                 0.64350110879328437097,
                                                 0.71882999962162452690,
                                                 0.78539816339744827900};
  const auto eighth = static_cast<int>(t * 8 + 0.5);
  const double c = eighth / 8.0, r = (t - c) / (1 + t * c), z = r * r;
  const double series =
      r + r * z * (-1.0 / 3 + z * (1.0 / 5 + z * (-1.0 / 7 + z * (1.0 / 9 + z * (-1.0 / 11 + z * (1.0 / 13))))));
  double angle = kAtanOfEighths[static_cast<std::size_t>(eighth)] + series;
  if (steep) angle = std::numbers::pi / 2 - angle;
  if (x < 0) angle = std::numbers::pi - angle;
  return y < 0 ? -angle : angle;
}

// The turn by the rotation vector `v`: about its direction, by its length.
inline Quatd TurnBy(Vec3d v) {
  const double angle = Length(v);
  if (angle < 1e-8) return Normalized(Quatd(v.x / 2, v.y / 2, v.z / 2, 1));  // sin(a/2)/a = 1/2 to a double's end
  const SinCos half = SinCosOf(angle / 2);
  const double s = half.sin / angle;
  return {v.x * s, v.y * s, v.z * s, half.cos};
}

// The shortest rotation vector of a unit quaternion: the inverse of TurnBy, length at most pi.
inline Vec3d RotationVectorOf(Quatd q) {
  const double sign = q.w < 0 ? -1 : 1;
  const Vec3d v = Vec3d{q.x, q.y, q.z} * sign;
  const double length = Length(v);
  if (length < 1e-9) return v * 2.0;
  return v * (2 * Atan2(length, q.w * sign) / length);
}

}  // namespace tessera::physics
