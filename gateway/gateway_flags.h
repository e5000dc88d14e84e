// GatewayFlags: the options of tessera-gateway, and what they come to.
//
//   AddGatewayOptions(app, flags);
//   app.parse(argc, argv);
//   auto read = ReadGatewayFlags(flags);
//   if (!read.ok()) return read.status();
//
// Thread rule: free functions on values.
#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "gateway/gateway.h"
#include "host/socket_address.h"
#include "telemetry/metrics_tls.h"
#include "trust/server_certificate.h"

namespace tessera::gateway {

struct GatewayFlags {
  std::string listen = "127.0.0.1:7710", metrics_listen = "127.0.0.1:7711";
  std::string metrics_token_file, page, visuals, visual_cache, ready_file, token_file, key_file, certificate, key,
      log_level;
  telemetry::MetricsTlsFiles metrics_tls;
  std::vector<std::string> allow_origins;
  bool behind_proxy = false;
  GatewayOptions options;
  std::size_t max_connections = 512, max_address_connections = 0;
  std::uint64_t max_viewer_kbytes = 4000, recording_mb = 1000, recordings_mb = 10'000, visual_cache_mb = 2000;
};

void AddGatewayOptions(CLI::App& app, GatewayFlags& flags);

struct ReadFlags {
  host::SocketAddress listen, metrics_listen;
  std::string metrics_token{};
  telemetry::MetricsTls metrics_tls{};
  std::optional<trust::ServerCertificate> certificate{};  // left out: it speaks plain HTTP
  GatewayOptions options;                                 // without a key
};

// Reads the files that they name, and TESSERA_TOKEN. INVALID_ARGUMENT names the option.
absl::StatusOr<ReadFlags> ReadGatewayFlags(const GatewayFlags& flags);

}  // namespace tessera::gateway
