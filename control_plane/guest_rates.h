// GuestRates: how often strangers join without a ticket, of one address and in one instance.
//
//   GuestRates rates({.of_address = {.per_s = 1, .burst = 32}, .of_instance = {.per_s = 20, .burst = 200}});
//   if (absl::Status status = rates.Take(instance_number, address, now); !status.ok()) return status;
//
// A guest who joins and never comes keeps a place for a minute, so an address that does nothing else holds `burst` and
// sixty times `per_s` of an instance's places at most. Whoever shows a ticket is known, and is not counted.
//
// Memory does not grow with addresses: they share buckets by a keyed hash. Thread rule: as Cluster; time comes in.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "control_plane/now.h"
#include "net/token_bucket.h"

namespace tessera::control {

// Joins a second, and at once after a rest. A rate of 0 is no limit.
struct GuestLimits {
  net::Rate of_address{.per_s = 1, .burst = 32};     // a classroom behind one router comes in at once
  net::Rate of_instance{.per_s = 20, .burst = 200};  // a thousand guests within a minute
};

class GuestRates {
 public:
  using HashKey = std::array<std::uint8_t, 16>;

  explicit GuestRates(const GuestLimits& limits, const HashKey& hash_key = DrawHashKey())
      : limits_(limits), hash_key_(hash_key) {}

  // RESOURCE_EXHAUSTED with a RetryAfterOf: there were too many. One that is refused costs neither of the two anything.
  // `address`: as CountedAddress gives it; empty: it is not known, and the instance alone counts.
  absl::Status Take(std::uint64_t instance_number, const std::string& address, Now now);
  void Forget(std::uint64_t instance_number) { instances_.erase(instance_number); }

 private:
  static constexpr std::size_t kGuestBuckets = 4096;  // 64 KiB

  static HashKey DrawHashKey();
  net::TokenBucket& BucketOf(const std::string& address);

  const GuestLimits limits_;
  const HashKey hash_key_;
  std::vector<net::TokenBucket> addresses_ = std::vector<net::TokenBucket>(kGuestBuckets);
  std::map<std::uint64_t, net::TokenBucket> instances_;
};

}  // namespace tessera::control
