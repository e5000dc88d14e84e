// What a report tells of the last few seconds: how long steps took, and how many ticks went by a second.
//
// Thread rule: none of its own. Time is passed in.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <deque>
#include <utility>

#include "core/world/ids.h"
#include "region_worker/tick_pacer.h"

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
  struct Sample {
    TimePoint at;
    Tick tick;
  };
  std::deque<Sample> samples_;
};

// What went into the time from one step to the next.
struct TickLength {
  Duration whole{0};
  Duration worked{0};    // CPU time of the thread that steps, whatever it did
  Duration stepping{0};  // of the whole, by the clock
  Duration waiting{0};   // for neighbours' frames, by the clock
};

// The longest of the last one to two spans. Whole and worked have each their own: where processors are shared, a tick
// that is long may have been worked on for no longer than others.
class LongestTick {
 public:
  static constexpr Duration kSpan = std::chrono::seconds(5);

  void Add(TimePoint at, const TickLength& tick) {
    if (at > span_ends_) {
      before_ = std::exchange(now_, {});
      span_ends_ = at + kSpan;
    }
    now_ = Longer(now_, tick);
  }
  TickLength longest() const { return Longer(now_, before_); }  // its whole and worked alone mean something

 private:
  static TickLength Longer(const TickLength& a, const TickLength& b) {
    return {.whole = std::max(a.whole, b.whole), .worked = std::max(a.worked, b.worked)};
  }

  TickLength now_, before_;
  TimePoint span_ends_{};
};

}  // namespace tessera::worker
