// HttpsDoor: the players' door for everybody who speaks HTTPS and JSON (join_page.h): games, their backends, browsers.
//
// It serves POST /v1/join, /v1/leave and /v1/instances, over TLS 1.2 or 1.3 alone, one request a connection. Whoever
// comes is a stranger: connections are bounded in all and by address, a request by its size and its time. One loop
// takes all requests; a join, which may wait for a world to start, has a thread of its own as long as it waits.
//
// A second one serves the same at a Unix socket, without TLS, to programs of this machine: the file's mode lets in this
// user and root alone, who are no strangers.
//
//   auto door = HttpsDoor::Start({address, certificate, key}, plane, metrics);
//   spdlog::info("players_https={}", (*door)->address());
//
// Thread rule: made and ended by one thread. `plane` and `metrics` outlive it; the plane is stopped first.
#pragma once

#include <memory>
#include <string>

#include "absl/status/statusor.h"
#include "control_plane/control_metrics.h"
#include "control_plane/control_plane.h"
#include "host/socket_address.h"

namespace tessera::control {

struct HttpsSettings {
  host::SocketAddress listen;
  std::string certificate;  // PEM, the server's own first, then what leads to a known authority
  std::string key;          // PEM; secret
  // Connections at once, in all and from one address (of IPv6, from one /64). Each costs some 50 KB while it is open,
  // and a game's backend joins many players from one address.
  std::size_t max_connections = 512, max_from_address = 64;
  std::string socket_path{};  // a Unix socket in place of all above but max_connections; its folder is there
};

class HttpsDoor {
 public:
  // INVALID_ARGUMENT: the certificate and key cannot be read, or do not belong together. UNAVAILABLE: the address
  // cannot be bound, or somebody listens at the socket.
  static absl::StatusOr<std::unique_ptr<HttpsDoor>> Start(HttpsSettings settings, ControlPlane& plane,
                                                          ControlMetrics& metrics);
  ~HttpsDoor();
  HttpsDoor(const HttpsDoor&) = delete;
  HttpsDoor& operator=(const HttpsDoor&) = delete;

  std::string address() const;  // as bound; the path of a socket

  struct Impl;

 private:
  explicit HttpsDoor(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace tessera::control
