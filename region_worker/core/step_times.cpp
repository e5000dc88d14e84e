#include "region_worker/core/step_times.h"

#include <algorithm>
#include <vector>

namespace tessera::worker {
namespace {

constexpr Duration kSampleDistance = std::chrono::milliseconds(100);

}  // namespace

TimeSummary StepTimes::Summary() const {
  const std::size_t size = std::min(count_, kSamples), recent = std::min(count_, kRecent);
  if (size == 0) return {};
  std::vector<float> all(samples_.begin(), samples_.begin() + static_cast<std::ptrdiff_t>(size)), newest(recent);
  for (std::size_t i = 0; i < recent; ++i) newest[i] = samples_[(count_ - recent + i) % kSamples];
  std::sort(all.begin(), all.end());
  std::sort(newest.begin(), newest.end());
  // Nearest rank: the smallest value that at least so many of a hundred do not exceed.
  const auto rank = [](const std::vector<float>& sorted, std::size_t percent) {
    return static_cast<double>(sorted[(sorted.size() * percent + 99) / 100 - 1]);
  };
  return {.p50_s = rank(newest, 50), .p99_s = rank(all, 99), .max_s = all.back()};
}

void RateMeter::Observe(TimePoint at, Tick tick) {
  if (!samples_.empty() && at < samples_.back().at + kSampleDistance) return;
  samples_.push_back({at, tick});
  // Keeps one sample at or beyond the window's far end.
  while (samples_.size() > 2 && samples_[1].at <= at - kWindow) samples_.pop_front();
}

double RateMeter::rate_hz(TimePoint now) const {
  if (samples_.size() < 2) return 0;
  const TickSample& first = samples_.front();
  const TickSample& last = samples_.back();
  const TimePoint end = now > last.at + kStall ? now : last.at;
  return static_cast<double>(last.tick - first.tick) / std::chrono::duration<double>(end - first.at).count();
}

}  // namespace tessera::worker
