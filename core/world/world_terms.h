// WorldTerms: what all regions of a world go by beside who owns what: whether the world stands still, how fast it goes,
// and which of its games it runs.
//
// They are part of the partition map, so they change as the map does: announced, committed, and in force at one tick in
// all regions. Thread rule: plain values.
#pragma once

#include <cstdint>

namespace tessera {

struct WorldTerms {
  // No region steps after the tick with which the map comes into force, until the control plane says that the world
  // goes on.
  bool paused = false;
  // Ticks in a second of real time; 0: as many as the scene says. A tick stays as long in the world's own time, so with
  // fewer of them the world is in slow motion.
  double ticks_per_second = 0;
  // Number of the game: 0 for the one that the world began with, one more with each that took its place.
  std::uint32_t game = 0;
  friend bool operator==(const WorldTerms&, const WorldTerms&) = default;
};

// The slowest pace, ticks a second. Slower, and a change of the pace, which needs some twenty ticks, takes minutes.
inline constexpr double kMinTicksPerSecond = 1;

}  // namespace tessera
