// Addresses to listen on, as flags state them.
#pragma once

#include <cstdint>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace tessera::control {

struct SocketAddress {
  std::string host;  // without brackets
  std::uint16_t port = 0;
};

// "127.0.0.1:7700", "[::1]:0", "localhost:80". kInvalidArgument "address 127.0.0.1: needs the form HOST:PORT".
absl::StatusOr<SocketAddress> ParseSocketAddress(const std::string& text);
// "[::1]:80"
std::string ToString(const SocketAddress& address);

// Binds a TCP socket there and closes it again, for the reason that gRPC does not tell: kUnavailable "address
// 127.0.0.1:7700 is in use (grpc)", or "... cannot be bound: Permission denied (grpc)". `what` is the part in brackets.
absl::Status CheckBindable(const SocketAddress& address, const std::string& what);

}  // namespace tessera::control
