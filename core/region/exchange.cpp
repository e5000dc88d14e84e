#include "core/region/exchange.h"

namespace tessera::region {

Solution ToSolution(const ImpulseRecord& record) {
  Solution solution;
  solution.by_owner_of_a = record.own < record.other;
  if (solution.by_owner_of_a) {
    solution.a = record.own;
    solution.b = record.other;
    solution.impulse_on_b = -record.impulse_on_own;
    solution.angular_on_a = record.angular_on_own;
    solution.angular_on_b = record.angular_on_other;
  } else {
    solution.a = record.other;
    solution.b = record.own;
    solution.impulse_on_b = record.impulse_on_own;
    solution.angular_on_a = record.angular_on_other;
    solution.angular_on_b = record.angular_on_own;
  }
  return solution;
}

PairCorrection CorrectionOf(const Solution* of_a, const Solution* of_b, double mass_a, double mass_b) {
  static constexpr Solution kNone;
  const Solution &x = of_a != nullptr ? *of_a : kNone, &y = of_b != nullptr ? *of_b : kNone;
  const double w_a = mass_a / (mass_a + mass_b);
  const double w_b = mass_b / (mass_a + mass_b);
  const auto difference = [](Vec3f p, Vec3f q) { return Vec3d(p) - Vec3d(q); };
  // a's owner applied its own to a, so a lacks w_a (y - x); b lacks w_b (x - y).
  const Vec3d linear = difference(y.impulse_on_b, x.impulse_on_b);
  return {linear * -w_a, linear * -w_b, difference(y.angular_on_a, x.angular_on_a) * w_a,
          difference(x.angular_on_b, y.angular_on_b) * w_b};
}

}  // namespace tessera::region
