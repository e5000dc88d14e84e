// ControlAddress: where a control plane is reached, and how it proves that it is the right one.
//
//   unix:/run/tessera/control.sock    a socket of this machine: who may open the file is the same user, or root
//   10.0.0.1:7700#3fa8...             TLS; the authority of the cluster has this fingerprint (SHA-256, 64 hex digits)
//   10.0.0.1:7700                     TLS; the authority is known from elsewhere: a context, or a host's own file
//
// A cluster with several control planes, of which one leads, is reached at a list of addresses, parted by commas.
//
// Thread rule: a value.
#pragma once

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "host/socket_address.h"

namespace tessera::trust {

struct ControlAddress {
  std::string socket_path;  // empty: it is reached over TCP
  host::SocketAddress tcp;
  std::string fingerprint;  // empty: none was named

  bool is_socket() const { return !socket_path.empty(); }
  // Without the fingerprint, as gRPC takes it.
  std::string target() const;
  // With the fingerprint, where there is one: as it is parsed.
  std::string text() const;
};

// INVALID_ARGUMENT: "\"nowhere\" is not of the form HOST:PORT".
absl::StatusOr<ControlAddress> ParseControlAddress(const std::string& text, host::PortRule ports);
// One or several, at most kMaxControlAddresses. A socket stands alone.
absl::StatusOr<std::vector<ControlAddress>> ParseControlAddresses(const std::string& text, host::PortRule ports);

// More control planes than anybody runs for one cluster.
inline constexpr std::size_t kMaxControlAddresses = 16;

// The longest path of a Unix socket that the kernel takes.
inline constexpr std::size_t kMaxSocketPathBytes = 107;

// The socket of this user's `tessera up`: in XDG_RUNTIME_DIR, or in a folder of /tmp that is the user's own.
std::string DefaultControlSocket();

// Beside a control plane's socket: the key of the gateway that `tessera up` starts there.
std::string PageKeyFile(const std::string& socket_path);

}  // namespace tessera::trust
