// Address: an IPv4 address and port, as ENet holds them.
#pragma once

#include <cstdint>
#include <string>

namespace tessera::net {

struct Address {
  std::uint32_t host = 0;  // network byte order
  std::uint16_t port = 0;  // host byte order
  friend bool operator==(const Address&, const Address&) = default;
};

std::string ToText(const Address& address);  // "127.0.0.1:7777"

}  // namespace tessera::net
