// MetricsServer: the one HTTP port of a process.
//
// Serves `/metrics` in the Prometheus text format (the registry given, whatever was added, and the process's own
// memory, CPU time and open files) and, for programs that need more, further paths: health, service discovery.
//
//   auto registry = std::make_shared<prometheus::Registry>();
//   auto server = MetricsServer::Start("127.0.0.1", 0, registry);
//   if (!server.ok()) return server.status();
//   (*server)->AddHandler("/healthz", [](const HttpRequest&) { return HttpReply{.body = "ok\n"}; });
//   spdlog::info("metrics at={}", (*server)->address());
//
// Only GET and HEAD are answered; an unknown path is 404, another method 405. Where there is a token, whoever asks for
// anything but /healthz shows it, or gets 401. Without TLS (metrics_tls.h) bind to loopback or to a network that only
// operators reach. Thread rule: every method may be called from any thread.
// Handlers and collectables run on one of two server threads (with TLS there is one), and must not block. The
// destructor waits for requests under way.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "prometheus/collectable.h"
#include "prometheus/registry.h"
#include "telemetry/metrics_tls.h"
#include "telemetry/served_pages.h"

namespace tessera::telemetry {

class MetricsServer {
 public:
  // `bind_address` is an IPv4 or IPv6 literal, or "localhost"; `port` 0 takes a free one. Errors name both:
  // kInvalidArgument for an address that is none, kUnavailable where it cannot be bound (in use, not an address of this
  // host, no permission).
  // `token`: see metrics_token.h; empty: everybody may ask. `tls`: by what it speaks HTTPS; unused: plain HTTP.
  static absl::StatusOr<std::unique_ptr<MetricsServer>> Start(const std::string& bind_address, std::uint16_t port,
                                                              std::shared_ptr<prometheus::Registry> registry,
                                                              std::string token = "", const MetricsTls& tls = {});
  ~MetricsServer();
  MetricsServer(const MetricsServer&) = delete;
  MetricsServer& operator=(const MetricsServer&) = delete;

  std::uint16_t port() const;
  std::string address() const;  // "127.0.0.1:9100", "[::1]:9100"

  // Answers exactly `path`, which starts with '/'. A later handler for the same path replaces the earlier one.
  void AddHandler(const std::string& path, HttpHandler handler);
  // Joins /metrics for as long as somebody else keeps it alive.
  void AddCollectable(std::weak_ptr<prometheus::Collectable> collectable);

 private:
  struct Impl;
  explicit MetricsServer(std::unique_ptr<Impl> impl);
  static absl::Status StartPlain(Impl& impl, std::uint16_t port);
  std::unique_ptr<Impl> impl_;
};

}  // namespace tessera::telemetry
