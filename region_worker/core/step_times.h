// The last few seconds as a report has them: how long steps took, and how many ticks went by a second.
//
// Thread rule: none of its own. Time is passed in.
#pragma once

#include <array>
#include <cstddef>
#include <deque>

#include "core/world/ids.h"
#include "region_worker/core/time.h"

namespace tessera::worker {

struct TimeSummary {
  double p50_s = 0, p99_s = 0, max_s = 0;
};

// The last kSamples durations; the median of the last kRecent, because borders are moved by it: what was before the
// last move must not count. Adding costs a store; summing up sorts a copy.
class StepTimes {
 public:
  static constexpr std::size_t kSamples = 256, kRecent = 64;  // 4 s and 1 s at 60 Hz

  void Add(Duration time) { samples_[count_++ % kSamples] = std::chrono::duration<float>(time).count(); }
  TimeSummary Summary() const;  // nearest rank; zeros while there is none

 private:
  std::array<float, kSamples> samples_{};
  std::size_t count_ = 0;
};

// Ticks a second over the last kWindow.
class RateMeter {
 public:
  static constexpr Duration kWindow = std::chrono::seconds(2);
  static constexpr Duration kStall = std::chrono::milliseconds(250);

  void Observe(TimePoint at, Tick tick);  // right after it was stepped
  // 0 until two observations. After kStall without one the time since then counts too.
  double rate_hz(TimePoint now) const;

 private:
  struct TickSample {
    TimePoint at;
    Tick tick;
  };
  std::deque<TickSample> samples_;
};

}  // namespace tessera::worker
