// GuestShares: how often visitors of one address join as guests.
//
// To the players' door all of a gateway's guests come from the gateway's own address, which may have so many joins a
// second (control_plane/guest_rates.h). Who sees the visitors' own addresses is the gateway, so it shares them out: a
// visitor who joins again and again leaves the others half.
//
//   if (!guests.Take(now, "10.0.0.7")) refuse;
//
// Memory does not grow with addresses: they share buckets by a keyed hash. Thread rule: one thread; time comes in.
#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <string>

#include "net/address_shares.h"
#include "net/token_bucket.h"

namespace tessera::gateway {

// Half of what an address may at the door unless its operator says otherwise. Less, and a classroom behind one router
// waits; more, and one visitor keeps all others out.
inline constexpr net::Rate kGuestsOfAVisitor{.per_s = 0.5, .burst = 16};
inline constexpr int kGuestAgain_s = 2;  // until there is one more

class GuestShares {
 public:
  using TimePoint = std::chrono::steady_clock::time_point;

  GuestShares();
  // False: it is one too many. `address`: in digits, of IPv6 its /64 counts; empty: it is not known, and not counted.
  bool Take(TimePoint now, const std::string& address);

 private:
  std::array<std::uint8_t, 16> hash_key_{};
  net::AddressShares shares_;
};

}  // namespace tessera::gateway
