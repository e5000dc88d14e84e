// Scrape: what a process's /metrics says, and what happened between two readings of it.
#pragma once

#include <map>
#include <string>
#include <string_view>

namespace tessera::bench {

// Samples by name and labels exactly as exposed: `tessera_region_bodies{state="owned"}`.
using Samples = std::map<std::string, double>;

// Text exposition format, version 0.0.4. Comments and lines that are not samples are passed over.
Samples ParseMetrics(std::string_view text);

struct HistogramReading {
  double count = 0, sum = 0;
  double mean() const { return count > 0 ? sum / count : 0; }
};
// `after` less `before` of a histogram without further labels.
HistogramReading HistogramBetween(const Samples& before, const Samples& after, const std::string& name);
// Its quantile, 0 to 1, by linear interpolation within the bucket, as PromQL's histogram_quantile does; 0 when nothing
// was observed.
double QuantileBetween(const Samples& before, const Samples& after, const std::string& name, double quantile);

}  // namespace tessera::bench
