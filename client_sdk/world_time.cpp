#include "client_sdk/world_time.h"

#include <algorithm>
#include <utility>

namespace tessera::client {

WorldTime::WorldTime(std::uint32_t tick_rate_hz, std::uint32_t snapshot_rate_hz)
    : tick_rate_hz_(tick_rate_hz),
      snapshot_rate_hz_(snapshot_rate_hz),
      playout_(tick_rate_hz, snapshot_rate_hz),
      clock_{.paused = false, .ticks_per_second = static_cast<double>(tick_rate_hz)} {}

WorldTime::News WorldTime::Take(TimePoint now, const replication::ClockNews& news) {
  const double pace = news.ticks_per_second;
  if (!(pace > 0 && pace <= tick_rate_hz_)) return News::kMalformed;
  if (news.tick < clock_tick_) return News::kOld;
  clock_tick_ = news.tick;
  const WorldClock changed{.paused = news.paused, .ticks_per_second = pace};
  if (changed == clock_) return News::kOld;
  clock_ = changed;
  playout_.SetPace(now, pace, clock_.paused);
  return News::kChanged;
}

void WorldTime::Arrived(TimePoint now, Tick tick) {
  newest_ = std::max(newest_, tick);
  playout_.Arrived(now, tick);
}

void WorldTime::AfterSilence() {
  after_silence_ = true;
  clock_tick_ = 0;
}

bool WorldTime::GoesBack(Tick tick) { return std::exchange(after_silence_, false) && tick + tick_rate_hz_ < newest_; }

void WorldTime::StartOver(TimePoint now) {
  playout_ = PlayoutClock(tick_rate_hz_, snapshot_rate_hz_);
  if (clock_.paused || clock_.ticks_per_second != tick_rate_hz_) {
    playout_.SetPace(now, clock_.ticks_per_second, clock_.paused);
  }
  newest_ = Tick();
  shown_tick_ = 0;
}

}  // namespace tessera::client
