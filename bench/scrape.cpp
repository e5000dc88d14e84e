#include "bench/scrape.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <vector>

namespace tessera::bench {
namespace {

double ValueOr0(const Samples& samples, const std::string& name) {
  const auto it = samples.find(name);
  return it == samples.end() ? 0 : it->second;
}

struct Bucket {
  double upper = 0;
  double cumulative = 0;
};

std::vector<Bucket> BucketsBetween(const Samples& before, const Samples& after, const std::string& name) {
  const std::string prefix = name + "_bucket{le=\"";
  std::vector<Bucket> buckets;
  for (auto it = after.lower_bound(prefix); it != after.end() && it->first.starts_with(prefix); ++it) {
    const double upper = std::strtod(it->first.c_str() + prefix.size(), nullptr);  // "+Inf" too
    buckets.push_back({upper, it->second - ValueOr0(before, it->first)});
  }
  std::sort(buckets.begin(), buckets.end(), [](const Bucket& a, const Bucket& b) { return a.upper < b.upper; });
  return buckets;
}

}  // namespace

Samples ParseMetrics(std::string_view text) {
  Samples samples;
  while (!text.empty()) {
    const auto end = text.find('\n');
    const std::string_view line = text.substr(0, end);
    text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
    if (line.empty() || line.front() == '#') continue;
    const auto brace = line.rfind('}');
    const auto space = line.find(' ', brace == std::string_view::npos ? 0 : brace);
    if (space == std::string_view::npos) continue;
    samples[std::string(line.substr(0, space))] = std::strtod(std::string(line.substr(space + 1)).c_str(), nullptr);
  }
  return samples;
}

HistogramReading HistogramBetween(const Samples& before, const Samples& after, const std::string& name) {
  return {ValueOr0(after, name + "_count") - ValueOr0(before, name + "_count"),
          ValueOr0(after, name + "_sum") - ValueOr0(before, name + "_sum")};
}

double QuantileBetween(const Samples& before, const Samples& after, const std::string& name, double quantile) {
  const std::vector<Bucket> buckets = BucketsBetween(before, after, name);
  if (buckets.empty() || buckets.back().cumulative <= 0) return 0;
  const double rank = quantile * buckets.back().cumulative;
  double lower = 0, below = 0;
  for (const Bucket& bucket : buckets) {
    if (bucket.cumulative >= rank) {
      if (!std::isfinite(bucket.upper)) return lower;
      const double inside = bucket.cumulative - below;
      return inside > 0 ? lower + (bucket.upper - lower) * (rank - below) / inside : bucket.upper;
    }
    lower = bucket.upper;
    below = bucket.cumulative;
  }
  return lower;
}

}  // namespace tessera::bench
