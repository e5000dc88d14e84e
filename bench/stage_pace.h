// StagePace: how punctual a stage is on which nothing has happened yet, so that a strike is not blamed for what the
// machine alone costs. Pure; any thread.
#pragma once

#include <algorithm>

namespace tessera::bench {

// Counts over one span of time, of all players and of all regions.
struct StagePace {
  double frames = 0, late_frames = 0;  // players' frames that were due, and those that came later than the next one
  double ticks = 0, late_ticks = 0;    // regions' ticks, and those that ended more than one tick after they were due

  double late_frame_share() const { return frames > 0 ? late_frames / frames : 1; }
  double late_tick_share() const { return ticks > 0 ? late_ticks / ticks : 1; }
};

// Above it gaps tell of the machine: one frame in twenty is late by as much as a snapshot's interval takes.
inline constexpr double kMostLateShare = 0.05;

// A stage on which nobody played or nothing was simulated was not in time.
inline bool IsInTime(const StagePace& pace) {
  return std::max(pace.late_frame_share(), pace.late_tick_share()) <= kMostLateShare;
}

}  // namespace tessera::bench
