// TickPacer: when the next tick is due, and whether one was late.
//
// Tick n is due at start + n / rate. One that falls behind catches up by a few ticks run back to back; further behind,
// it counts anew from now: the world slows down (time dilation) instead of racing through what it missed. Thread rule:
// none of its own. Time is passed in, never read.
#pragma once

#include <chrono>
#include <cstdint>

namespace tessera::worker {

using Clock = std::chrono::steady_clock;
using TimePoint = Clock::time_point;
using Duration = Clock::duration;

class TickPacer {
 public:
  // More would make a burst that neighbours and clients see as a jump; less, and one slow tick costs time for good.
  static constexpr int kMaxTicksBehind = 3;

  explicit TickPacer(std::uint32_t rate_hz) : rate_hz_(rate_hz) {}

  void Start(TimePoint now) {
    anchor_ = now;
    ticks_ = 0;
  }
  // Of the next tick.
  TimePoint due() const { return anchor_ + TicksLong(ticks_); }
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
    return std::chrono::seconds(n / rate_hz_) +
           Duration(std::chrono::nanoseconds(n % rate_hz_ * 1'000'000'000 / rate_hz_));
  }

  std::uint32_t rate_hz_;
  TimePoint anchor_{};
  std::uint64_t ticks_ = 0;  // since anchor_
};

}  // namespace tessera::worker
