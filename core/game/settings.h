// Limits of what a game may cost, counted in work and never in time, so that the same game does the same on every host.
#pragma once

#include <cstddef>
#include <cstdint>

namespace tessera::game {

struct GameSettings {
  std::uint64_t instructions_per_callback = 20'000;  // one that needs more fails
  std::uint64_t instructions_per_tick = 100'000;     // in a region; what is left waits for the next tick, in order
  std::uint32_t failures_until_off = 20;             // failures of one callback in a row
  std::size_t spawns_per_tick = 256;                 // bodies that a region makes
  std::size_t bodies_per_region = 20'000;            // with more, nothing is made
  std::size_t messages_per_tick = 1'024;             // that a region's callbacks send
};

inline constexpr std::size_t kMaxWaitingEvents = 65'536;  // in a region; later ones are dropped and counted
// The oldest of them that the standby and checkpoints have. More, and a game that is always late fills the log.
inline constexpr std::size_t kMaxKeptEvents = 1'024;
// The most events that one body takes along to another region; the later ones are dropped and counted. More, and a
// grant grows.
inline constexpr std::size_t kMaxCarriedEvents = 256;
// For which a command waits for the input that it goes with: longer than the two are ever apart.
inline constexpr std::uint64_t kMaxCommandWait_ticks = 12;
inline constexpr std::size_t kMaxTimers = 16;  // for each body
inline constexpr std::int64_t kMaxTimerTicks = 1'000'000;
inline constexpr std::size_t kMaxForces = 4;            // on a body, that act for a time
inline constexpr std::int64_t kMaxForceTicks = 36'000;  // span of one of them: ten minutes at 60 Hz
inline constexpr std::int64_t kMaxMoveTicks = 36'000;   // length of the way of a kinematic body
inline constexpr std::size_t kMaxTimerNameBytes = 32;
inline constexpr std::size_t kMaxFieldBytes = 256;    // values of one event, as they are kept
inline constexpr std::size_t kMaxMessageBytes = 512;  // values of one message
inline constexpr std::size_t kMaxMessageNameBytes = 32;
// Messages of one sender that no target has acknowledged. More, and what goes along with its body grows.
inline constexpr std::size_t kMaxOutbox = 64;
// The same for the world, which talks with all.
inline constexpr std::size_t kMaxInstanceOutbox = 512;
// Messages that wait at one target for their tick or their turn; later ones are sent again.
inline constexpr std::size_t kMaxInbox = 1'024;
// Senders that one target remembers. Beyond them, the one that has been silent longest is forgotten.
inline constexpr std::size_t kMaxSenders = 1'024;
// Published events that wait for the control plane, in the world's record: some seconds of a busy game. More, and each
// step sends the standby more. Those beyond are left out, counted and missed by the backend.
inline constexpr std::size_t kMaxPublished = 1'024, kMaxPublishedBytes = 128 * 1024;
inline constexpr std::size_t kMaxLogLineBytes = 200;
inline constexpr std::size_t kMaxLogLinesPerTick = 8;
inline constexpr std::size_t kMaxCounters = 32;  // a game's, in a region; others are dropped and counted
inline constexpr std::size_t kMaxCounterNameBytes = 64;
inline constexpr std::int64_t kMaxCounted = 1'000'000;  // by one call
inline constexpr std::size_t kMaxCommandBytes = 1024;   // from a client; one fits a datagram
inline constexpr std::size_t kMaxWaitingCommands =
    16;  // from a player, for the game's turn; its client sends others again
inline constexpr std::size_t kMaxEventNameBytes = 32;
inline constexpr std::size_t kMaxWaitingEventsOfPlayer = 64;     // until its client has them; more cannot be sent
inline constexpr std::size_t kMaxWaitingEventBytes = 16 * 1024;  // names and values; they go with each handover
inline constexpr std::size_t kMaxEndReasonBytes = 200;           // why a player was refused or kicked
inline constexpr double kMaxGameSpeed_m_s = 1000;                // that a game sets or makes by an impulse

}  // namespace tessera::game
