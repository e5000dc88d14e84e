// AddressShares: what each address may have at a rate, in memory that does not grow with their number.
//
//   if (!shares.Take(now, hash_of_address, {.per_s = 256, .burst = 512})) refuse;
//
// Addresses of one hash share a bucket; the hash is keyed, so nobody can choose whose. Thread rule: one thread.
#pragma once

#include <cstdint>
#include <vector>

#include "net/limits.h"
#include "net/token_bucket.h"

namespace tessera::net {

class AddressShares {
 public:
  bool Take(TokenBucket::TimePoint now, std::uint64_t hash, const Rate& rate) {
    return buckets_[hash % buckets_.size()].Take(now, rate);
  }

 private:
  std::vector<TokenBucket> buckets_ = std::vector<TokenBucket>(kAddressBuckets);
};

}  // namespace tessera::net
