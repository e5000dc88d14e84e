#include "bench/soak_steps.h"

#include <algorithm>
#include <iterator>

namespace tessera::bench {
namespace {

constexpr const char* kSoakStep = "tessera_region_step_seconds";
constexpr double kLeastSteps = 1000;

}  // namespace

void SoakSteps::Take(const std::string& worker, const Samples& page, int load) {
  Samples& last = last_[worker];
  Samples& sum = sums_[load];
  const std::string prefix = kSoakStep;
  for (auto it = page.lower_bound(prefix); it != page.end() && it->first.starts_with(prefix); ++it) {
    double& before = last[it->first];
    sum[it->first] += it->second - before;
    before = it->second;
  }
}

void SoakSteps::Mark(double at_s) { marks_.emplace_back(at_s, sums_); }

const Samples& SoakSteps::At(int load, double at_s) const {
  static const Samples kNone;
  const auto after = std::ranges::upper_bound(marks_, at_s, {}, [](const auto& mark) { return mark.first; });
  if (after == marks_.begin()) return kNone;
  const std::map<int, Samples>& sums = std::prev(after)->second;
  const auto found = sums.find(load);
  return found == sums.end() ? kNone : found->second;
}

std::optional<double> SoakSteps::P99(int load, double begin_s, double end_s) const {
  const Samples &begin = At(load, begin_s), &end = At(load, end_s);
  if (HistogramBetween(begin, end, kSoakStep).count < kLeastSteps) return std::nullopt;
  return QuantileBetween(begin, end, kSoakStep, 0.99);
}

std::set<int> SoakSteps::loads() const {
  std::set<int> loads;
  for (const auto& [load, sum] : sums_) loads.insert(load);
  return loads;
}

std::optional<double> SoakSteps::P99Ratio(const SoakWindows& windows) const {
  std::optional<double> largest;
  for (const int load : loads()) {
    const auto early = P99(load, windows.early_begin_s, windows.early_end_s);
    const auto late = P99(load, windows.late_begin_s, windows.late_end_s);
    if (!early || !late || *early <= 0) continue;
    largest = std::max(largest.value_or(0), *late / *early);
  }
  return largest;
}

}  // namespace tessera::bench
