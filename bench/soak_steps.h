// SoakSteps: how long steps took over a long run, of workers that come and go.
//
//   SoakSteps steps;
//   steps.Take("worker 4711", ParseMetrics(page), 4);   // each worker that runs, every now and then
//   steps.Mark(now_s);                                  // once all are taken
//   steps.P99(4, windows.early_begin_s, windows.early_end_s)
//
// The histograms of all workers are summed up under one load (soak_series.h). What a worker counted after it was last
// taken is lost with it. Thread rule: one thread at a time.
#pragma once

#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "bench/scrape.h"
#include "bench/soak_series.h"

namespace tessera::bench {

class SoakSteps {
 public:
  // All that `worker` has counted since it was last taken, or since its start, happened under `load`.
  void Take(const std::string& worker, const Samples& page, int load);
  // All workers were taken. Moments ascend.
  void Mark(double at_s);

  // Covers all steps between the last mark at or before `begin_s` and the last one at or before `end_s`, s; nothing
  // with fewer than 1000, of which the slowest hundredth would be chance.
  std::optional<double> P99(int load, double begin_s, double end_s) const;
  std::set<int> loads() const;
  // The late window's by the early one's, under the load for which it is the largest.
  std::optional<double> P99Ratio(const SoakWindows& windows) const;

 private:
  const Samples& At(int load, double at_s) const;

  std::map<std::string, Samples> last_;                             // by worker
  std::map<int, Samples> sums_;                                     // by load
  std::vector<std::pair<double, std::map<int, Samples>>> marks_{};  // ascending
};

}  // namespace tessera::bench
