// DoorAddress: where a control plane's players' door in JSON is, as a program states it.
//
//   unix:/run/tessera/control.sock   a control plane of this machine; the door is at its socket with .json behind it
//   play.example:7704#3fa8...        TLS; the cluster's authority has this fingerprint (SHA-256, 64 hex digits)
//   play.example:7704                TLS; the certificate is play.example's, of an authority that this system knows
//
// A cluster with several control planes, of which one leads, is reached at a list of addresses, parted by commas.
//
// Thread rule: a value.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/statusor.h"

namespace tessera::client {

struct DoorAddress {
  std::string text;    // as it was stated, for errors
  std::string socket;  // path of the door's own socket; empty: over TCP
  std::string host;    // without brackets
  std::uint16_t port = 0;
  std::string fingerprint;  // empty: none was named

  bool is_socket() const { return !socket.empty(); }
};

// Empty: the socket of this user's `tessera up`, where this system has them. INVALID_ARGUMENT: "\"nowhere\" is not of
// the form HOST:PORT".
absl::StatusOr<DoorAddress> ParseDoorAddress(const std::string& text);
// One or several, at most kMostDoorAddresses. A socket stands alone, and several name one authority.
absl::StatusOr<std::vector<DoorAddress>> ParseDoorAddresses(const std::string& text);

// More control planes than anybody runs for one cluster; as many as other programs take (trust/control_address.h).
inline constexpr std::size_t kMostDoorAddresses = 16;

}  // namespace tessera::client
