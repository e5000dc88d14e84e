// Limits: how much anybody may cost a port, before and after it is known who it is. docs/protocol.md, section 9, says
// them to who writes the other end.
//
// A rate is a token bucket: `burst` at once, `per_s` from then on.
#pragma once

#include <chrono>
#include <cstddef>

#include "net/token_bucket.h"

namespace tessera::net {

// --- Strangers. Memory does not grow with their number.

// Hellos of one IPv4 address that are answered; one answer takes some 8 us. Many players, or bots, may share an
// address, and a dialler repeats its hello up to eight times, so it is eight times what logins may be.
inline constexpr Rate kHellosOfAnAddress{.per_s = 2048, .burst = 4096};
// Hellos that are answered in all, of those that have the instance's knock: 8 % of a core. The more there are, the more
// tries an honest dialler needs while its hellos drown in a flood of somebody who has seen one: at 100 000 a second one
// of ten is answered, and it sends 23 in its first two seconds.
inline constexpr Rate kHellos{.per_s = 10'000, .burst = 4000};
// The same of those without the knock: strangers', and those of clients of earlier releases. 1 % of a core.
inline constexpr Rate kStrangersHellos{.per_s = 1000, .burst = 1000};
// Logins with a good cookie of one address; each costs some 200 us. Many players or bots may share one address.
inline constexpr Rate kLoginsOfAnAddress{.per_s = 256, .burst = 512};
// Datagrams of another kind that prove nothing, the same for each kind. Beyond it the kernel drops them unseen
// (flood_filter.h); honest ends send next to none.
inline constexpr double kUnproven_per_s = 10'000;
// Addresses share buckets by a keyed hash. Fewer buckets, and a flood from all addresses exhausts those of honest ones:
// 100 000 a second make 24 in each.
inline constexpr std::size_t kAddressBuckets = 4096;

// --- Players.

struct SessionLimits {
  // per_s 0: without limit.
  Rate datagrams, bytes;
  // A session that goes beyond them without a pause of kFloodPause for so long floods, and is to be ended.
  std::chrono::milliseconds patience{3000};
};
// A client sends an input a tick (at most 240 a second), commands and acknowledgements, some 100 bytes each. A network
// that stalls for two seconds gives them all at once.
inline constexpr SessionLimits kPlayerLimits{.datagrams = {.per_s = 1000, .burst = 500},
                                             .bytes = {.per_s = 512.0 * 1024, .burst = 256.0 * 1024}};
inline constexpr std::chrono::milliseconds kFloodPause{1000};

// A credential whose holder was let in and refused kRefusalsAtOnce times is not looked at before kHoldOff is over; a
// look costs 200 us. At most kMaxHeldOff are remembered, 40 bytes each; beyond, the eldest is forgotten.
inline constexpr int kRefusalsAtOnce = 3;
inline constexpr std::chrono::seconds kHoldOff{10};
inline constexpr std::size_t kMaxHeldOff = 4096;
// A session that sends so many datagrams beyond its budget in one window of kFloodPause is thinned by the kernel, which
// passes a random share: kLimitedTo times what the budget takes, so that it is still known who floods. More, and a
// flood takes the tick's time until it is noticed; fewer, and a burst after a stall of the network is thinned.
inline constexpr std::uint32_t kExcessToLimit = 256;
inline constexpr double kLimitedTo = 1.25;
// For so long the kernel drops all of an address and port whose session was ended for flooding; at most so many at a
// time, the eldest makes room. Longer, and a port that a router gives to somebody else is shut out.
inline constexpr std::chrono::seconds kShutOut{10};
inline constexpr std::size_t kMaxShutOut = 16;

// --- Receiving.

// Datagrams that one call of a game port's Service looks at: 1 ms where all are worthless. The others wait in the
// kernel, and are lost where its buffer is full. Fewer for each session, and those of honest players would wait while
// the region is slow: at ten ticks a second each has sent six or more.
inline constexpr std::size_t kDatagramsPerService = 1024, kDatagramsPerSession = 8;
// The same for endpoints that receive large messages from whom they trust more, and for clients.
inline constexpr std::size_t kMaxDatagramsPerService = 8192;

}  // namespace tessera::net
