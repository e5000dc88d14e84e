// Plots of a suite: error against CPU time, one curve an engine, by gnuplot.
#pragma once

#include <string>
#include <vector>

#include "absl/status/status.h"
#include "bench/front.h"

namespace tessera::bench {

struct Curve {
  std::string engine;
  std::vector<Offer> offers;  // every setting tried: points
  std::vector<Offer> front;   // the best of them: a line
};

// Writes a PNG with logarithmic axes. Errors: FAILED_PRECONDITION if gnuplot is missing or fails.
absl::Status PlotCurves(const std::string& path, const std::string& title, const std::string& error_label,
                        const std::vector<Curve>& curves);

// "results/accuracy.csv", "free box" -> "results/accuracy_free_box.png"
std::string PlotPath(const std::string& csv, const std::string& scene);

}  // namespace tessera::bench
