#include "client_sdk/stats.h"

#include <algorithm>
#include <cmath>

namespace tessera::client {
namespace {

constexpr double kSmallest_s = 1e-7;

}  // namespace

void DurationStats::Add(std::chrono::nanoseconds duration) {
  const double octaves =
      std::log2(std::max(std::chrono::duration<double>(duration).count(), kSmallest_s) / kSmallest_s);
  const auto bucket = static_cast<std::size_t>(octaves * static_cast<double>(kPerOctave));
  ++buckets_[std::min(bucket, kBuckets - 1)];
  ++count_;
  sum_ += duration;
  max_ = std::max(max_, duration);
}

double DurationStats::Quantile(double q) const {
  const auto rank = static_cast<std::uint64_t>(std::ceil(q * static_cast<double>(count_)));
  std::uint64_t seen = 0;
  for (std::size_t i = 0; i < kBuckets; ++i) {
    seen += buckets_[i];
    if (seen < rank) continue;
    const double middle_s = kSmallest_s * std::exp2((static_cast<double>(i) + 0.5) / static_cast<double>(kPerOctave));
    return std::min(middle_s, std::chrono::duration<double>(max_).count());
  }
  return 0;
}

DurationSummary DurationStats::Summary() const {
  if (count_ == 0) return {};
  return {.count = count_,
          .mean_s = std::chrono::duration<double>(sum_).count() / static_cast<double>(count_),
          .p50_s = Quantile(0.5),
          .p99_s = Quantile(0.99),
          .max_s = std::chrono::duration<double>(max_).count()};
}

}  // namespace tessera::client
