// TlsPageServer: ServedPages over HTTPS, by libwebsockets: CivetWeb as Debian builds it cannot speak to OpenSSL 3.
//
// TLS 1.2 and later, one request a connection, 64 connections at once, each with ten seconds for its handshake and as
// many for its request. One thread serves all, handlers included.
//
// Thread rule: made and ended by one thread. The pages outlive it.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "absl/status/statusor.h"
#include "telemetry/metrics_tls.h"
#include "telemetry/served_pages.h"

namespace tessera::telemetry {

class TlsPageServer {
 public:
  // `address`: an IP address without brackets; port 0 takes a free one. `tls`: as ReadMetricsTls gives it.
  // UNAVAILABLE: it cannot be bound, without saying why.
  static absl::StatusOr<std::unique_ptr<TlsPageServer>> Start(const std::string& address, std::uint16_t port,
                                                              MetricsTls tls, ServedPages& pages);
  ~TlsPageServer();
  TlsPageServer(const TlsPageServer&) = delete;
  TlsPageServer& operator=(const TlsPageServer&) = delete;

  std::uint16_t port() const;

  struct Impl;

 private:
  explicit TlsPageServer(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace tessera::telemetry
