#include "core/physics/motion/damping.h"

#include <algorithm>

namespace tessera::physics {
namespace {

// ln(1 - x), 0 <= x < 1: 1 - x = 2^n m with m near 1, and ln m = 2 artanh((m - 1) / (m + 1)).
double LogOneMinus(double x) {
  constexpr double kLn2 = 0.69314718055994530942;
  double m = 1 - x;
  int n = 0;
  for (; m < 0.70710678118654752; m *= 2) --n;
  const double y = (m - 1) / (m + 1), y2 = y * y;
  double sum = 0;
  for (int k = 27; k >= 1; k -= 2) sum = sum * y2 + 1.0 / k;
  return n * kLn2 + 2 * y * sum;
}

// e^-x for x >= 0, by halving until the series is short.
double ExpMinus(double x) {
  int halvings = 0;
  for (; x > 0.25; x /= 2) ++halvings;
  double sum = 1;
  for (int k = 16; k >= 1; --k) sum = 1 - x / k * sum;
  for (; halvings > 0; --halvings) sum *= sum;
  return sum;
}

}  // namespace

void Damping::Prepare(double dt_s) {
  if (dt_s == dt_s_) return;
  dt_s_ = dt_s;
  const double share = std::clamp(share_, 0.0, 1.0);
  if (share == 0) {
    kept_ = 1, slid_s_ = dt_s, fallen_s2_ = dt_s * dt_s / 2;
  } else if (share == 1) {
    kept_ = slid_s_ = fallen_s2_ = 0;
  } else {
    const double k = -LogOneMinus(share), x = k * dt_s;
    kept_ = ExpMinus(x);
    // The series replace the differences where x is so small that these would be rounding.
    slid_s_ = x < 1e-4 ? dt_s * (1 - x / 2 + x * x / 6) : (1 - kept_) / k;
    fallen_s2_ = x < 1e-3 ? dt_s * dt_s * (0.5 - x / 6 + x * x / 24 - x * x * x / 120) : (dt_s - slid_s_) / k;
  }
}

}  // namespace tessera::physics
