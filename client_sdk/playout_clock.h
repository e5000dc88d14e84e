// PlayoutClock: chooses the moment of the world to show now.
//
// Snapshots come in a rhythm with jitter, from several regions, of a world whose rate itself may sag. The clock follows
// the newest tick (a line through arrivals, its slope measured over about a second) and shows the world a little behind
// it: two snapshot intervals and two and a half times the jitter, so that a lost or late snapshot mostly has a
// successor. The shown moment glides, at most a tenth faster or slower than the world, and never goes back; when the
// world stops it brakes.
//
//   clock.Arrived(now, snapshot.tick);   // for each datagram
//   double tick = clock.Advance(now);    // once a frame
//
// Pure: time comes in. Thread rule: one thread at a time.
#pragma once

#include <chrono>
#include <cstdint>
#include <deque>

#include "core/world/ids.h"

namespace tessera::client {

class PlayoutClock {
 public:
  using TimePoint = std::chrono::steady_clock::time_point;

  PlayoutClock(double tick_rate_hz, double snapshot_rate_hz);

  void Arrived(TimePoint now, Tick tick);
  // The world makes so many ticks a second from now on; or it stands, and is shown as the newest snapshot has it.
  void SetPace(TimePoint now, double ticks_per_second, bool paused);
  // The moment to show, in ticks and parts of one; 0 before the first arrival.
  double Advance(TimePoint now);

  bool started() const { return started_; }
  double tick_rate_hz() const { return rate_hz_; }  // measured
  double delay_s() const { return delay_ticks() / rate_hz_; }
  double jitter_s() const { return jitter_ticks_ / rate_hz_; }
  std::uint64_t jumps() const { return jumps_; }

 private:
  struct Arrival {
    TimePoint time;
    double tick = 0;
  };

  double HeadAt(TimePoint now) const;  // the newest tick, by the line
  double delay_ticks() const;
  void MeasureRate(TimePoint now, double tick);
  double AtLeastIntervals(double time_s, double intervals) const;

  double nominal_rate_hz_;
  double interval_ticks_;
  bool paused_ = false;
  double rate_hz_;
  std::deque<Arrival> arrivals_;  // those with a tick newer than all before, over the last second
  bool started_ = false;
  double newest_tick_ = 0;
  TimePoint head_time_;
  double head_tick_ = 0, jitter_ticks_ = 0;
  TimePoint shown_time_;
  double shown_tick_ = 0;
  std::uint64_t jumps_ = 0;
};

}  // namespace tessera::client
