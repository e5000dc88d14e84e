// Limits and defaults of the control plane: each with its unit, its reason and what breaks if it changes.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>

namespace tessera::control {

// What an operator may set. Spans are counted on the steady clock.
struct Settings {
  // How often an agent tells that it lives. Told to it on admission.
  std::chrono::milliseconds heartbeat_interval{500};
  // Silence after which a host is LOST. Ten heartbeats: shorter, and a paused virtual machine degrades its instances.
  std::chrono::milliseconds lost_after{5000};
  // How long an instance may be STARTING (or PLACING) before it is given up. A scene of a million bodies loads in
  // seconds.
  std::chrono::milliseconds start_timeout{60'000};
  // How long a worker may take to end in order before the agent is told to end it.
  std::chrono::milliseconds stop_grace{10'000};
  // How long instances that have ended stay listed.
  std::chrono::milliseconds keep_ended{3'600'000};
  // How long a player who has left stays in the orders after all workers know, so that a late grant of the body is
  // still met by someone who knows that the player has left.
  std::chrono::milliseconds keep_left_players{60'000};
};

// Instances that have ended and are kept, at most; the oldest go first.
inline constexpr std::size_t kMaxEndedInstances = 1000;

// Start deadline of an instance: default and largest.
inline constexpr std::chrono::milliseconds kDefaultStartDeadline{30'000};
inline constexpr std::chrono::milliseconds kMaxStartDeadline{24 * 3'600'000};
inline constexpr std::uint32_t kDefaultSnapshotRateHz = 30;

// How long a connect token admits its player. A client that comes back later joins anew.
inline constexpr std::chrono::seconds kConnectTokenLifetime{24 * 3600};

// Missed heartbeats (the hello counts as one) after which a worker that its agent no longer names is taken as dead.
// More than one: an agent that has just started names its workers as it finds them.
inline constexpr int kMissedBeforeVanished = 3;

inline constexpr std::size_t kMaxNameBytes = 63;  // of hosts, players: a DNS label
inline constexpr std::size_t kMaxRequestIdBytes = 128;
inline constexpr std::size_t kMaxAddressBytes = 253;  // a DNS name
inline constexpr std::int32_t kDefaultPageSize = 100, kMaxPageSize = 1000;
inline constexpr std::size_t kMaxReasonBytes = 600;  // one line of a terminal, or a few
inline constexpr std::size_t kReasonLogLines = 3;

// Largest message, bytes: a scene of a million scattered-out bodies is about 100 MB as text, 64 MB on the wire.
inline constexpr int kMaxMessageBytes = 64 << 20;
// Shortest time between two pushes of a watched instance whose state is the same, so that reports do not become a
// flood.
inline constexpr std::chrono::milliseconds kWatchInterval{100};
// How long JoinInstance waits until the workers know the new player, so that its client is not refused by a region that
// has not heard. After that the answer goes out; the client then has to try again where it is refused.
inline constexpr std::chrono::milliseconds kPlayerKnownTimeout{2000};
// How often deadlines are looked at. Not in the path of any command.
inline constexpr std::chrono::milliseconds kTimerInterval{100};

}  // namespace tessera::control
