// LongestTick: the longest of the ticks of the last one to two spans.
//
// Its whole and its work are kept each by itself: where processors are shared, a tick that is long may have been worked
// on for no longer than others. Thread rule: none of its own. Time is passed in.
#pragma once

#include <algorithm>
#include <utility>

#include "region_worker/core/time.h"

namespace tessera::worker {

// The time from one step to the next.
struct TickLength {
  Duration whole{0};   // by the clock
  Duration worked{0};  // CPU time of the thread that steps, whatever it did
};

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
  TickLength longest() const { return Longer(now_, before_); }

 private:
  static TickLength Longer(const TickLength& a, const TickLength& b) {
    return {.whole = std::max(a.whole, b.whole), .worked = std::max(a.worked, b.worked)};
  }

  TickLength now_, before_;
  TimePoint span_ends_{};
};

}  // namespace tessera::worker
