#include "bench/soak_series.h"

#include <algorithm>
#include <map>
#include <utility>

#include "bench/statistics.h"

namespace tessera::bench {
namespace {

constexpr double kSoakWarmUp_s = 600, kSoakWindow_s = 600, kSoakCounts_s = 1500;
constexpr double kShortShare = 0.2;
constexpr std::size_t kLeastInWindow = 3, kLeastForSlope = 6;
constexpr double kHour_s = 3600;

std::vector<SoakSample> OlderThan(const SoakSeries& series, double young_s) {
  std::vector<SoakSample> old;
  for (const SoakSample& sample : series.samples) {
    if (sample.at_s - series.since_s >= young_s) old.push_back(sample);
  }
  return old;
}

}  // namespace

SoakWindows WindowsOf(double run_s) {
  const bool counts = run_s >= kSoakCounts_s;
  const double warm_up_s = counts ? kSoakWarmUp_s : kShortShare * run_s;
  const double window_s = counts ? std::min(kSoakWindow_s, (run_s - warm_up_s) / 2) : kShortShare * run_s;
  return {.early_begin_s = warm_up_s,
          .early_end_s = warm_up_s + window_s,
          .late_begin_s = run_s - window_s,
          .late_end_s = run_s,
          .counts = counts};
}

std::optional<SoakChange> MedianChange(const SoakSeries& series, SoakReading reading, const SoakWindows& windows) {
  std::map<int, std::pair<std::vector<double>, std::vector<double>>> by_load;  // early, late
  for (const SoakSample& sample : series.samples) {
    if (windows.IsEarly(sample.at_s)) by_load[sample.load].first.push_back(sample.*reading);
    if (windows.IsLate(sample.at_s)) by_load[sample.load].second.push_back(sample.*reading);
  }
  std::optional<SoakChange> largest;
  for (const auto& [load, readings] : by_load) {
    const auto& [early, late] = readings;
    if (early.size() < kLeastInWindow || late.size() < kLeastInWindow) continue;
    const SoakChange change{Median(early), Median(late)};
    if (!largest || change.Difference() > largest->Difference()) largest = change;
  }
  return largest;
}

std::optional<double> SlopePerHour(const SoakSeries& series, SoakReading reading, double young_s) {
  const std::vector<SoakSample> old = OlderThan(series, young_s);
  if (old.size() < kLeastForSlope || old.back().at_s - old.front().at_s < young_s) return std::nullopt;
  std::vector<double> slopes;
  for (std::size_t i = 0; i < old.size(); ++i) {
    for (std::size_t j = i + 1; j < old.size(); ++j) {
      if (old[i].load != old[j].load || old[j].at_s <= old[i].at_s) continue;
      slopes.push_back((old[j].*reading - old[i].*reading) / (old[j].at_s - old[i].at_s));
    }
  }
  if (slopes.empty()) return std::nullopt;
  return kHour_s * Median(std::move(slopes));
}

std::optional<double> SlopeSharePerHour(const SoakSeries& series, SoakReading reading, double young_s) {
  const std::optional<double> slope = SlopePerHour(series, reading, young_s);
  if (!slope) return std::nullopt;
  std::vector<double> readings;
  for (const SoakSample& sample : OlderThan(series, young_s)) readings.push_back(sample.*reading);
  const double median = Median(std::move(readings));
  if (median <= 0) return std::nullopt;
  return *slope / median;
}

}  // namespace tessera::bench
