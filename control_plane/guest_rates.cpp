#include "control_plane/guest_rates.h"

#include <sodium.h>

#include <chrono>
#include <cmath>

#include "absl/strings/str_cat.h"
#include "control_plane/retry_after.h"

namespace tessera::control {
namespace {

// Nothing: one more may come. Else how long until one may.
std::chrono::milliseconds GuestWait(net::TokenBucket& bucket, const net::Rate& rate, net::TokenBucket::TimePoint now) {
  bucket.Fill(now, rate);
  if (bucket.left() >= 1) return {};
  return std::chrono::milliseconds(static_cast<std::int64_t>(std::ceil(1000 * (1 - bucket.left()) / rate.per_s)));
}

absl::Status TooManyGuests(const char* where, std::chrono::milliseconds wait) {
  const auto wait_s = std::chrono::ceil<std::chrono::seconds>(wait).count();
  return WithRetryAfter(absl::ResourceExhaustedError(absl::StrCat("too many guests join ", where, ": ask again in ",
                                                                  wait_s, " s, or show a ticket")),
                        wait);
}

}  // namespace

GuestRates::HashKey GuestRates::DrawHashKey() {
  HashKey key;
  static_assert(key.size() == crypto_shorthash_KEYBYTES);
  randombytes_buf(key.data(), key.size());
  return key;
}

net::TokenBucket& GuestRates::BucketOf(const std::string& address) {
  std::uint64_t hash = 0;
  static_assert(sizeof hash == crypto_shorthash_BYTES);
  crypto_shorthash(reinterpret_cast<std::uint8_t*>(&hash), reinterpret_cast<const std::uint8_t*>(address.data()),
                   address.size(), hash_key_.data());
  return addresses_[hash % addresses_.size()];
}

absl::Status GuestRates::Take(std::uint64_t instance_number, const std::string& address, Now now) {
  const net::TokenBucket::TimePoint at(std::chrono::duration_cast<net::TokenBucket::TimePoint::duration>(now.steady));
  net::TokenBucket* own = address.empty() || limits_.of_address.per_s <= 0 ? nullptr : &BucketOf(address);
  net::TokenBucket* shared = limits_.of_instance.per_s <= 0 ? nullptr : &instances_[instance_number];
  if (own != nullptr) {
    const auto wait = GuestWait(*own, limits_.of_address, at);
    if (wait.count() > 0) return TooManyGuests("from this address", wait);
  }
  if (shared != nullptr) {
    const auto wait = GuestWait(*shared, limits_.of_instance, at);
    if (wait.count() > 0) return TooManyGuests("this instance", wait);
    shared->Spend(1);
  }
  if (own != nullptr) own->Spend(1);
  return absl::OkStatus();
}

}  // namespace tessera::control
