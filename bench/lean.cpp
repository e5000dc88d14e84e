#include "bench/lean.h"

#include <fmt/format.h>

#include <cmath>
#include <cstdio>

#include "bench/statistics.h"

namespace tessera::bench {
namespace {

struct Effort {
  int rounds,
      units;  // each round takes a fresh pair: two equal worlds that lie elsewhere in memory differ by a percent
};

constexpr int kWarmUp = 3;  // units: the first steps of a world find its pairs

struct Ratios {
  std::vector<double> with, needed;
};

void Measure(LeanPair& pair, int units, Ratios& ratios) {
  for (int i = 0; i < kWarmUp; ++i) {
    pair.without();
    pair.with();
    if (pair.needed) pair.needed();
  }
  for (int i = 0; i < units; ++i) {
    double with = 0;
    if (i % 2 == 0) with = pair.with();
    const double without = pair.without();
    if (i % 2 == 1) with = pair.with();
    ratios.with.push_back(with / without);
    if (pair.needed) ratios.needed.push_back(pair.needed() / without);
  }
}

// Where a profiler that is to count this work alone begins and ends (docs/measuring.md).
__attribute__((noinline)) void RunLeanUnits(const WorkUnit& unit, int units) {
  for (int i = 0; i < units; ++i) unit();
}

// Runs one side of a pair as often as it is measured in a round.
void RunPart(const LeanLine& line, const std::string& part, int units) {
  const LeanPair pair = line.make();
  const WorkUnit& unit = part == "with" ? pair.with : part == "without" ? pair.without : pair.needed;
  if (!unit) return;
  for (int i = 0; i < kWarmUp; ++i) unit();
  RunLeanUnits(unit, units);
}

// Standard error of a median: 1.25 standard deviations over the root of the count, the deviation from the middle 68 %.
double ErrorOfMedian(const std::vector<double>& values) {
  const double deviation = (Quantile(values, 0.841) - Quantile(values, 0.159)) / 2;
  return 1.2533 * deviation / std::sqrt(static_cast<double>(values.size()));
}

}  // namespace

absl::Status RunLean(const SuiteOptions& options, Report& report) {
  const Effort effort = options.quick ? Effort{2, 10} : Effort{6, 40};
  std::vector<LeanLine> lines = PhysicsLines();
  for (LeanLine& line : RegionLines()) lines.push_back(std::move(line));
  for (const LeanLine& line : lines) {
    if (line.name.find(options.only) == std::string::npos) continue;
    if (!options.part.empty()) {
      RunPart(line, options.part, effort.units);
      continue;
    }
    Ratios ratios;
    for (int round = 0; round < effort.rounds; ++round) {
      LeanPair pair = line.make();
      Measure(pair, effort.units, ratios);
    }
    const std::string config = "counted=" + line.counted;
    const auto add = [&](const std::string& metric, double value) {
      report.Add(line.name, "tessera", config, metric, value, "1");
    };
    const double ratio = Median(ratios.with);
    add("lean_cost_ratio", ratio);
    add("lean_cost_ratio_p10", Quantile(ratios.with, 0.1));
    add("lean_cost_ratio_p90", Quantile(ratios.with, 0.9));
    add("lean_cost_ratio_error", ErrorOfMedian(ratios.with));
    if (!ratios.needed.empty()) add("needed_cost_ratio", Median(ratios.needed));
    fmt::print(stderr, "lean: {}: {:.4f} +- {:.4f}\n", line.name, ratio, ErrorOfMedian(ratios.with));
  }
  return absl::OkStatus();
}

}  // namespace tessera::bench
