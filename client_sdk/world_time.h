// WorldTime: the time of a world as a client knows it: its pace, its newest tick, and the moment that is shown.
//
//   time.Take(now, news);               // each region reports a change of pace, at the same tick
//   time.Arrived(now, snapshot.tick);   // for each snapshot
//   double tick = time.Advance(now);    // once a frame
//
// Promise: a report from before another one changes nothing. The newest tick never goes back, unless the world does: it
// was restored while no region was connected.
// Pure: time comes in. Thread rule: one thread at a time.
#pragma once

#include <cstdint>

#include "client_sdk/client.h"
#include "client_sdk/playout_clock.h"
#include "core/replication/region_message.h"

namespace tessera::client {

class WorldTime {
 public:
  WorldTime(std::uint32_t tick_rate_hz, std::uint32_t snapshot_rate_hz);

  enum class News : std::uint8_t { kMalformed, kOld, kChanged };
  News Take(TimePoint now, const replication::ClockNews& news);
  void Arrived(TimePoint now, Tick tick);
  // The moment to show, in ticks and parts of one.
  double Advance(TimePoint now) { return shown_tick_ = playout_.Advance(now); }

  // A region is connected, and none was before it: the world may have another past than the one that was seen.
  void AfterSilence();
  // Whether a snapshot of this tick, which is about to be taken, shows that it has; by more than a second. Asked of
  // each snapshot: of all after a silence the first one decides.
  bool GoesBack(Tick tick);
  // It has: nothing but the pace is known.
  void StartOver(TimePoint now);

  const WorldClock& clock() const { return clock_; }
  const PlayoutClock& playout() const { return playout_; }
  Tick newest() const { return newest_; }
  // The moment that Advance gave last; 0 before the first.
  double shown_tick() const { return shown_tick_; }

 private:
  std::uint32_t tick_rate_hz_, snapshot_rate_hz_;
  PlayoutClock playout_;
  WorldClock clock_;
  std::uint64_t clock_tick_ = 0;  // tick of the message that set it
  Tick newest_;
  double shown_tick_ = 0;
  bool after_silence_ = false;
};

}  // namespace tessera::client
