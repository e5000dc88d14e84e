#include "bench/soak_figures.h"

#include <algorithm>

#include "bench/statistics.h"

namespace tessera::bench {
namespace {

// A worker takes its bodies over, fills its histories and its allocator's pools: a minute, or less in a short run.
constexpr double kYoung_s = 60, kYoungShare = 0.05;

bool IsWorker(const std::string& process) { return process.starts_with(kSoakWorker); }

std::optional<double> MedianOf(const std::vector<double>& values) {
  if (values.empty()) return std::nullopt;
  return Median(values);
}

void KeepLargest(std::optional<double>& largest, double value) {
  largest = largest ? std::max(*largest, value) : value;
}

}  // namespace

std::optional<double> SoakFigures::memory_growth() const {
  std::optional<double> largest;
  for (const auto& [process, growth] : throughout) {
    if (!IsWorker(process) && growth.memory) KeepLargest(largest, growth.memory->Share());
  }
  return largest;
}

std::optional<double> SoakFigures::handles_growth() const {
  std::optional<double> largest;
  for (const auto& [process, growth] : throughout) {
    if (IsWorker(process)) continue;
    if (growth.descriptors) KeepLargest(largest, growth.descriptors->Difference());
    if (growth.threads) KeepLargest(largest, growth.threads->Difference());
  }
  return largest;
}

SoakFigures FiguresOf(const std::vector<SoakSeries>& all, const SoakSteps& steps, double run_s) {
  SoakFigures figures;
  figures.windows = WindowsOf(run_s);
  const double young_s = std::min(kYoung_s, kYoungShare * run_s);
  std::vector<double> memory, descriptors;
  for (const SoakSeries& series : all) {
    const SoakFigures::Growth growth{MedianChange(series, &SoakSample::memory_bytes, figures.windows),
                                     MedianChange(series, &SoakSample::descriptors, figures.windows),
                                     MedianChange(series, &SoakSample::threads, figures.windows)};
    if (growth.memory) figures.throughout[series.process] = growth;
    if (!IsWorker(series.process)) continue;
    const auto slope = SlopeSharePerHour(series, &SoakSample::memory_bytes, young_s);
    const auto of_descriptors = SlopePerHour(series, &SoakSample::descriptors, young_s);
    if (!slope || !of_descriptors) continue;
    ++figures.workers_measured;
    memory.push_back(*slope);
    descriptors.push_back(*of_descriptors);
  }
  figures.worker_memory_slope = MedianOf(memory);
  figures.worker_descriptors_slope = MedianOf(descriptors);
  figures.step_p99_ratio = steps.P99Ratio(figures.windows);
  return figures;
}

}  // namespace tessera::bench
