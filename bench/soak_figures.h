// SoakFigures: the growth of a run of the suite soak. Pure functions, any thread.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "bench/soak_series.h"
#include "bench/soak_steps.h"

namespace tessera::bench {

struct SoakFigures {
  // For each process that lived throughout, by its name: the change from the early window to the late one.
  struct Growth {
    std::optional<SoakChange> memory, descriptors, threads;
  };
  std::map<std::string, Growth> throughout;
  // Workers against their age: the median over all that were old enough, an hour. Memory as a share.
  std::optional<double> worker_memory_slope, worker_descriptors_slope;
  double workers_measured = 0;
  std::optional<double> step_p99_ratio;
  SoakWindows windows;

  // Largest of the processes that are no workers; nothing if none lived throughout.
  std::optional<double> memory_growth() const;
  // Descriptors and threads alike.
  std::optional<double> handles_growth() const;
};

// Names of workers' series begin so; no other's do.
inline constexpr const char* kSoakWorker = "worker ";

SoakFigures FiguresOf(const std::vector<SoakSeries>& all, const SoakSteps& steps, double run_s);

}  // namespace tessera::bench
