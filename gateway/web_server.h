// WebServer: the gateway's one port: the page, its two lists, the meshes of worlds, and the WebSockets of viewers. One
// event loop, of libwebsockets; no call in it waits.
//
// It answers for itself alone: a request names an address of this machine, or a host that --allow-origin lists, so a
// page of another site reaches it neither directly nor by a name of its own that leads here (DNS rebinding).
//
//   auto server = WebServer::Start(options, gateway, metrics);
//   while (!stopped) (*server)->Service();
//
// Thread rule: one thread, but for Wake.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "gateway/gateway.h"
#include "gateway/gateway_metrics.h"
#include "gateway/visual_files.h"
#include "host/socket_address.h"
#include "trust/server_certificate.h"

namespace tessera::gateway {

struct WebOptions {
  host::SocketAddress listen{"127.0.0.1", 7710};
  std::string page;                        // folder; empty: none is built
  std::string visuals;                     // folder of <sha256>.glb; empty: there is none
  VisualFetch fetch_visual = nullptr;      // for those that are not in it; null: there are none
  std::vector<std::string> allow_origins;  // "https://play.example"
  // It speaks TLS by it; null: plain HTTP.
  std::optional<trust::ServerCertificate> certificate = std::nullopt;
  std::size_t max_connections = 512;        // that are served at once
  std::size_t max_address_connections = 0;  // the same for one IP address; 0: as many as all
};

class WebServer {
 public:
  // UNAVAILABLE: the address cannot be bound. Those of PageFiles::Read, and of CheckServerCertificate.
  static absl::StatusOr<std::unique_ptr<WebServer>> Start(const WebOptions& options, GatewayMetrics& metrics);
  ~WebServer();
  WebServer(const WebServer&) = delete;
  WebServer& operator=(const WebServer&) = delete;

  std::string address() const;  // "127.0.0.1:7710"
  // From now on viewers are the gateway's, which outlives this.
  void Serve(Gateway& gateway);
  // Serves what there is, and waits for more for at most a frame's time or so.
  void Service();
  // Ends all connections, and with them the viewers of the gateway, which may then go.
  void Stop();
  // Service returns soon. Any thread.
  void Wake();

  struct Impl;

 private:
  explicit WebServer(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace tessera::gateway
