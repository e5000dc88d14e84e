// Addresses to listen on and to connect to, as options state them.
#pragma once

#include <cstdint>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace tessera::host {

struct SocketAddress {
  std::string host;  // a name or an IP address, without brackets
  std::uint16_t port = 0;
};

enum class PortRule { kFrom1, kFrom0 };  // 0 lets the system choose, where somebody listens

// "10.0.0.1:7700", "control.example:7700", "[::1]:7700". INVALID_ARGUMENT: "\"nowhere\" is not of the form HOST:PORT".
absl::StatusOr<SocketAddress> ParseSocketAddress(const std::string& text, PortRule ports);
// Empty: it is an address to listen at, where port 0 is allowed. Else the error, as a check of an option gives it.
std::string ListenAddressFault(const std::string& text);
// "[::1]:80"
std::string ToString(const SocketAddress& address);

// Whether `text` can be a host name or an IP address.
bool IsHostName(const std::string& text);

// Whether what is sent to this host stays on this machine: "127.0.0.1", "::1", "localhost".
bool IsLoopback(const std::string& host);

// Binds a TCP socket there and closes it again, for the reason that gRPC does not report. UNAVAILABLE: "address
// 127.0.0.1:7700 is in use (grpc)", or "... cannot be bound: Permission denied (grpc)"; `what` is the part in brackets.
absl::Status CheckBindable(const SocketAddress& address, const std::string& what);

// Whether the three ports of a worker, from `first` on, can be bound now: two of UDP on `address` (IPv4), and one of
// TCP for its metrics on `metrics_address`.
bool PortsFree(const std::string& address, const std::string& metrics_address, std::uint16_t first);

}  // namespace tessera::host
