#include "gateway/guest_shares.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sodium.h>

namespace tessera::gateway {
namespace {

// The part of an address that its holder did not choose.
std::string CountedPart(const std::string& address) {
  in6_addr six{};
  if (inet_pton(AF_INET6, address.c_str(), &six) != 1) return address;
  constexpr std::size_t kNetwork = 8, kFourAt = 12;
  const char* const bytes = reinterpret_cast<const char*>(six.s6_addr);
  if (IN6_IS_ADDR_V4MAPPED(&six)) return {bytes + kFourAt, sizeof six - kFourAt};
  return {bytes, kNetwork};
}

}  // namespace

GuestShares::GuestShares() {
  static_assert(sizeof hash_key_ == crypto_shorthash_KEYBYTES);
  randombytes_buf(hash_key_.data(), hash_key_.size());
}

bool GuestShares::Take(TimePoint now, const std::string& address) {
  if (address.empty()) return true;
  const std::string counted = CountedPart(address);
  std::uint64_t hash = 0;
  static_assert(sizeof hash == crypto_shorthash_BYTES);
  crypto_shorthash(reinterpret_cast<std::uint8_t*>(&hash), reinterpret_cast<const std::uint8_t*>(counted.data()),
                   counted.size(), hash_key_.data());
  return shares_.Take(now, hash, kGuestsOfAVisitor);
}

}  // namespace tessera::gateway
