// Limits of what a game may cost, counted in work and never in time, so that the same game does the same on every host.
#pragma once

#include <cstddef>
#include <cstdint>

namespace tessera::game {

struct GameSettings {
  std::uint64_t instructions_per_callback = 20'000;  // one that needs more fails
  std::uint64_t instructions_per_tick = 100'000;     // in a region; what is left waits for the next tick, in order
  std::uint32_t failures_until_off = 20;             // of one callback in a row
  std::size_t spawns_per_tick = 256;                 // bodies that a region makes
  std::size_t bodies_per_region = 20'000;            // with more, nothing is made
};

inline constexpr std::size_t kMaxWaitingEvents = 65'536;  // of a region; later ones are dropped and counted
inline constexpr std::size_t kMaxTimers = 16;             // of a body
inline constexpr std::int64_t kMaxTimerTicks = 1'000'000;
inline constexpr std::size_t kMaxTimerNameBytes = 32;
inline constexpr std::size_t kMaxFieldBytes = 256;  // of one event's values, as they are kept
inline constexpr std::size_t kMaxLogLineBytes = 200;
inline constexpr std::size_t kMaxLogLinesPerTick = 8;
inline constexpr double kMaxGameSpeed_m_s = 1000;  // that a game sets or makes by an impulse

}  // namespace tessera::game
