// TickPacer: when the next tick is due, and whether one was late.
//
// Tick n is due at start + n / rate. One that falls behind catches up by a few ticks run back to back; further behind,
// it counts anew from now: the world slows down (time dilation) instead of racing through what it missed.
//
// Regions in step have clocks that started apart, and a stumble moves them apart again. One that is ahead would wait
// for its neighbours at every tick for good, and be late by its own clock while all goes well. So the least that the
// ticks of a while began late is taken as the distance between the clocks, and the clock is set back by it. Lateness
// that comes and goes changes nothing.
//
// Thread rule: none of its own. Time is passed in, never read.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "region_worker/core/time.h"

namespace tessera::worker {

class TickPacer {
 public:
  // More would make a burst that neighbours and clients see as a jump; less, and one slow tick costs time for good.
  static constexpr int kMaxTicksBehind = 3;

  // Half a second or so: longer than a stumble, short against a game.
  static constexpr std::uint32_t kTicksPerShift = 32;

  explicit TickPacer(std::uint32_t rate_hz) : rate_millihertz_(rate_hz * kMilli) {}

  // Another pace from the next tick on, which is due as it was before.
  void SetRate(double rate_hz) {
    const auto millihertz = static_cast<std::uint64_t>(std::llround(rate_hz * kMilli));
    if (millihertz == rate_millihertz_) return;
    Start(due());
    rate_millihertz_ = millihertz;
    least_lag_ = Duration::max();
    lags_ = 0;
  }

  void Start(TimePoint now) {
    anchor_ = now;
    ticks_ = 0;
  }
  // When the next tick is due.
  TimePoint due() const { return anchor_ + TicksLong(ticks_); }
  // The tick that was due begins; not before its time.
  void Began(TimePoint now) {
    least_lag_ = std::min(least_lag_, now - due());
    if (++lags_ < kTicksPerShift) return;
    anchor_ += least_lag_;
    least_lag_ = Duration::max();
    lags_ = 0;
  }
  // The tick that was due has finished. True if it was late: finished more than a tick after its time.
  bool Finished(TimePoint now) {
    const TimePoint was_due = due();
    ++ticks_;
    if (now > was_due + TicksLong(1 + kMaxTicksBehind)) Start(now);
    return now > was_due + TicksLong(1);
  }
  Duration tick_length() const { return TicksLong(1); }

 private:
  // Whole seconds apart from the rest, so that no sum of rounded tick lengths drifts.
  Duration TicksLong(std::uint64_t n) const {
    const std::uint64_t rest = n * kMilli % rate_millihertz_;
    return std::chrono::seconds(n * kMilli / rate_millihertz_) +
           Duration(std::chrono::nanoseconds(rest * 1'000'000'000 / rate_millihertz_));
  }

  static constexpr std::uint64_t kMilli = 1000;
  std::uint64_t rate_millihertz_;
  TimePoint anchor_{};
  std::uint64_t ticks_ = 0;  // since anchor_
  Duration least_lag_ = Duration::max();
  std::uint32_t lags_ = 0;  // in least_lag_
};

}  // namespace tessera::worker
