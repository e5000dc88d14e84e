#include "bench/front.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace tessera::bench {
namespace {

constexpr double kBetter = 0.99;  // at most this share of another's error

// The least CPU time for which a front gets down to that error.
double CostAt(const std::vector<Offer>& front, double error) {
  double cost = std::numeric_limits<double>::infinity();
  for (const Offer& offer : front) {
    if (offer.error <= error) cost = std::min(cost, offer.cpu_us);
  }
  return cost;
}

}  // namespace

std::vector<Offer> FrontOf(std::vector<Offer> offers, double floor, double worst) {
  std::erase_if(offers, [worst](const Offer& o) { return !(o.error <= worst); });
  for (Offer& offer : offers) offer.error = std::max(offer.error, floor);
  std::sort(offers.begin(), offers.end(), [](const Offer& a, const Offer& b) {
    return a.cpu_us != b.cpu_us ? a.cpu_us < b.cpu_us : a.error < b.error;
  });
  std::vector<Offer> front;
  for (const Offer& offer : offers) {
    if (front.empty() || offer.error <= kBetter * front.back().error) front.push_back(offer);
  }
  return front;
}

bool Dominates(const std::vector<Offer>& ours, const std::vector<Offer>& theirs) {
  for (const std::vector<Offer>* front : {&ours, &theirs}) {
    for (const Offer& corner : *front) {
      const double we = CostAt(ours, corner.error), they = CostAt(theirs, corner.error);
      if (std::isinf(we) || std::isinf(they)) continue;
      if (we >= they) return false;
    }
  }
  return !ours.empty();
}

}  // namespace tessera::bench
