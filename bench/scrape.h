// Scrape: reads a process's /metrics as Prometheus would.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>

#include "absl/status/statusor.h"

namespace tessera::bench {

// Samples by name and labels exactly as exposed: `tessera_region_bodies{state="owned"}`.
using Samples = std::map<std::string, double>;

// The body of a GET. Errors: UNAVAILABLE naming address, port and path, also for a status other than 200.
absl::StatusOr<std::string> HttpGet(const std::string& host, std::uint16_t port, const std::string& path);

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
