#include "core/region/exchange.h"

#include <algorithm>
#include <tuple>

namespace tessera::region {
namespace {

PairCorrection Blend(BodyId a, BodyId b, const Solution& of_a, const Solution& of_b, double mass_a, double mass_b) {
  const double w_a = mass_a / (mass_a + mass_b);
  const double w_b = mass_b / (mass_a + mass_b);
  const auto difference = [](Vec3f x, Vec3f y) { return Vec3d(x) - Vec3d(y); };
  // a's owner applied `of_a` to a, so a lacks w_a (of_b - of_a); b lacks w_b (of_a - of_b).
  PairCorrection correction;
  correction.a = a;
  correction.b = b;
  const Vec3d linear = difference(of_b.impulse_on_b, of_a.impulse_on_b);
  correction.impulse_on_a = linear * -w_a;
  correction.impulse_on_b = linear * -w_b;
  correction.angular_on_a = difference(of_b.angular_on_a, of_a.angular_on_a) * w_a;
  correction.angular_on_b = difference(of_a.angular_on_b, of_b.angular_on_b) * w_b;
  return correction;
}

}  // namespace

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

std::vector<PairCorrection> CorrectionsOf(std::vector<Solution> solutions,
                                          const std::function<double(BodyId)>& mass_of) {
  std::sort(solutions.begin(), solutions.end(), [](const Solution& x, const Solution& y) {
    return std::tuple(x.a, x.b, !x.by_owner_of_a) < std::tuple(y.a, y.b, !y.by_owner_of_a);
  });
  std::vector<PairCorrection> corrections;
  corrections.reserve(solutions.size());
  for (std::size_t i = 0; i < solutions.size();) {
    const BodyId a = solutions[i].a, b = solutions[i].b;
    Solution of_a, of_b;
    RegionId owner_of_a, owner_of_b;
    for (; i < solutions.size() && solutions[i].a == a && solutions[i].b == b; ++i) {
      (solutions[i].by_owner_of_a ? of_a : of_b) = solutions[i];
      if (solutions[i].owner_of_a != RegionId()) owner_of_a = solutions[i].owner_of_a;
      if (solutions[i].owner_of_b != RegionId()) owner_of_b = solutions[i].owner_of_b;
    }
    corrections.push_back(Blend(a, b, of_a, of_b, mass_of(a), mass_of(b)));
    corrections.back().owner_of_a = owner_of_a;
    corrections.back().owner_of_b = owner_of_b;
  }
  return corrections;
}

}  // namespace tessera::region
