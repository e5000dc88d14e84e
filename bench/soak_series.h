// SoakSeries: readings of one process over a long run, and the figures that say whether it grows.
//
//   const SoakWindows windows = WindowsOf(3600);
//   const auto grown = MedianChange(series, &SoakSample::memory_bytes, windows);
//   if (grown) std::cerr << grown->Share();
//
// Like is compared with like only: a control plane of six regions needs more than one of four, and a world that grows
// and shrinks in turns would hide what is lost or show what is not. So each sample names the load that it was taken
// under, and only samples of one load are held against each other. Pure functions, any thread.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "bench/scrape.h"

namespace tessera::bench {

// A process at rest: no change of who runs what was under way.
struct SoakSample {
  double at_s = 0;  // since the run began
  int load = 0;     // regions of the world, or of this host: equal numbers are alike
  double memory_bytes = 0, descriptors = 0, threads = 0;
};
using SoakReading = double SoakSample::*;

// One process from the first sample to its end. Whoever takes its place begins another series.
struct SoakSeries {
  std::string process;  // "control", "local-1", "worker 4711"
  double since_s = 0;   // when it was first seen
  std::vector<SoakSample> samples;
};

struct SoakWindows {
  double early_begin_s = 0, early_end_s = 0, late_begin_s = 0, late_end_s = 0;
  bool counts = false;  // the run was long enough for its growth to mean anything

  bool IsEarly(double at_s) const { return at_s >= early_begin_s && at_s <= early_end_s; }
  bool IsLate(double at_s) const { return at_s >= late_begin_s && at_s <= late_end_s; }
};

// The first ten minutes warm up; the ten after them are held against the last ten. A run of less than half an hour has
// shorter ones, which do not overlap; one of less than 25 minutes has windows of a fifth of it, and does not count.
SoakWindows WindowsOf(double run_s);

// The medians of both windows, of samples under one load.
struct SoakChange {
  double early = 0, late = 0;

  double Difference() const { return late - early; }
  double Share() const { return early > 0 ? late / early - 1 : 0; }
};
// Under the load for which it is the largest; nothing unless some load has three samples in each window.
std::optional<SoakChange> MedianChange(const SoakSeries& series, SoakReading reading, const SoakWindows& windows);

// Slope against age, an hour: the median of the slopes between all pairs of samples under one load (Theil 1950, Sen
// 1968), so that a single leap does not count. Samples younger than `young_s` are left out; nothing unless six are left
// that span at least as long.
std::optional<double> SlopePerHour(const SoakSeries& series, SoakReading reading, double young_s);
// The same as a share of the median reading.
std::optional<double> SlopeSharePerHour(const SoakSeries& series, SoakReading reading, double young_s);

}  // namespace tessera::bench
