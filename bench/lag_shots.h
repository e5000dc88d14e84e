// Shots at a body that flies past, by a player whose screen is behind the world: how many hit what the player saw.
//
// Two regions under virtual time; a client at the end of a network with delay and jitter shows the world by the SDK's
// playout clock and world view, aims at what it shows, and sends what it showed with the shot. The game asks all
// regions along the ray. Thread rule: one thread at a time.
#pragma once

#include <cstdint>

#include "bench/report.h"

namespace tessera::bench {

struct LagSettings {
  int shots = 200;
  double round_trip_s = 0.150, jitter_s = 0.010;
  bool rewind = true;  // off: the ray meets bodies where they are when the shot arrives
  std::uint64_t seed = 1;
};

struct LagShots {
  int shots = 0, answered = 0, incomplete = 0;
  int across = 0;      // shots at the target while the region of the shooter did not own it
  int near = 0;        // hit the target within 2 cm of where the ray met what was shown
  double worst_m = 0;  // largest miss among those that hit it at all
  int missed = 0;
};

// Throws if the game fails.
LagShots ShootWithLag(const LagSettings& settings);

void MeasureLagHits(bool quick, Report& report);

}  // namespace tessera::bench
