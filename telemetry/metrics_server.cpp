#include "telemetry/metrics_server.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <atomic>
#include <cassert>
#include <chrono>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include <spdlog/spdlog.h>
#include "CivetServer.h"

#include "absl/strings/str_cat.h"
#include "host/socket_address.h"
#include "telemetry/tls_page_server.h"

namespace tessera::telemetry {
namespace {

constexpr char kThreads[] = "2";              // a scrape and a health probe at once; more only adds stacks
constexpr char kRequestTimeoutMs[] = "3000";  // a client that stalls gives its thread back after this

// CivetWeb reports why a bind failed only through its log callback, which runs on the thread that constructs the
// server.
thread_local std::string* start_log = nullptr;

int KeepLog(const mg_connection*, const char* message) {
  if (start_log != nullptr && start_log->empty()) *start_log = message;  // the first names the cause
  return 1;                                                              // handled: nothing goes to CivetWeb's own log
}

struct BoundAddress {
  sockaddr_storage address{};
  socklen_t size = 0;
  std::string literal;  // "127.0.0.1", "::1"
  std::string host;     // as CivetWeb wants it: IPv6 in brackets
};

absl::StatusOr<BoundAddress> ParseAddress(const std::string& text) {
  BoundAddress endpoint;
  endpoint.literal = text == "localhost" ? "127.0.0.1" : text;
  const std::string& literal = endpoint.literal;
  auto* v4 = reinterpret_cast<sockaddr_in*>(&endpoint.address);
  auto* v6 = reinterpret_cast<sockaddr_in6*>(&endpoint.address);
  if (inet_pton(AF_INET, literal.c_str(), &v4->sin_addr) == 1) {
    v4->sin_family = AF_INET;
    endpoint.size = sizeof(sockaddr_in);
    endpoint.host = literal;
  } else if (inet_pton(AF_INET6, literal.c_str(), &v6->sin6_addr) == 1) {
    v6->sin6_family = AF_INET6;
    endpoint.size = sizeof(sockaddr_in6);
    endpoint.host = absl::StrCat("[", literal, "]");
  } else {
    return absl::InvalidArgumentError(absl::StrCat("HTTP address \"", text, "\" is not an IP address"));
  }
  return endpoint;
}

// "... cannot bind to 127.0.0.1:80: 13 (Permission denied)" -> "Permission denied".
std::string Reason(std::string_view log) {
  const auto open = log.rfind('(');
  const auto close = log.rfind(')');
  if (open == std::string_view::npos || close == std::string_view::npos || close < open) return std::string(log);
  return std::string(log.substr(open + 1, close - open - 1));
}

}  // namespace

struct MetricsServer::Impl : CivetHandler {
  Impl(BoundAddress endpoint_in, std::shared_ptr<prometheus::Registry> registry, std::string token)
      : endpoint(std::move(endpoint_in)), pages(std::move(registry), std::move(token)) {}

  BoundAddress endpoint;
  std::uint16_t port = 0;
  ServedPages pages;
  std::unique_ptr<CivetServer> server;        // plain HTTP
  std::unique_ptr<TlsPageServer> tls_server;  // in its place

  bool Reply(mg_connection* connection) {
    const mg_request_info& info = *mg_get_request_info(connection);
    const char* authorization = mg_get_header(connection, "Authorization");
    const HttpReply reply = pages.Reply(
        {.method = info.request_method,
         .request = {.path = info.local_uri, .query = info.query_string == nullptr ? "" : info.query_string},
         .authorization = authorization == nullptr ? "" : authorization});
    std::string message =
        absl::StrCat("HTTP/1.1 ", reply.status, " ", ReasonPhrase(reply.status),
                     "\r\nContent-Type: ", reply.content_type, "\r\nContent-Length: ", reply.body.size(),
                     "\r\nConnection: close\r\n", reply.status == 405 ? "Allow: GET, HEAD\r\n" : "",
                     reply.status == 401 ? "WWW-Authenticate: Bearer\r\n" : "", "\r\n");
    if (std::string_view(info.request_method) != "HEAD") message += reply.body;
    mg_write(connection, message.data(), message.size());
    return true;
  }

  // CivetWeb asks its handler by method; all lead to the same answer.
  bool handleGet(CivetServer*, mg_connection* connection) override { return Reply(connection); }
  bool handleHead(CivetServer*, mg_connection* connection) override { return Reply(connection); }
  bool handlePost(CivetServer*, mg_connection* connection) override { return Reply(connection); }
  bool handlePut(CivetServer*, mg_connection* connection) override { return Reply(connection); }
  bool handleDelete(CivetServer*, mg_connection* connection) override { return Reply(connection); }
  bool handleOptions(CivetServer*, mg_connection* connection) override { return Reply(connection); }
  bool handlePatch(CivetServer*, mg_connection* connection) override { return Reply(connection); }

  // CivetWeb 1.15 looks at its stop flag only when its poll of the listening socket ends, every 2 s or on a connection
  // (mended in 1.16). So connections are made until it has stopped.
  void Stop() {
    tls_server.reset();
    if (server == nullptr) return;
    std::atomic<bool> stopped = false;
    std::thread waker([this, &stopped] {
      while (!stopped) {
        const int fd = socket(endpoint.address.ss_family, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
        if (fd >= 0) {
          // A failure is fine: then nobody listens any more.
          (void)connect(fd, reinterpret_cast<const sockaddr*>(&endpoint.address), endpoint.size);
          close(fd);
        }
        std::this_thread::sleep_for(std::chrono::milliseconds(5));
      }
    });
    server->close();
    stopped = true;
    waker.join();
  }
};

// Plain HTTP. The port is bound.
absl::Status MetricsServer::StartPlain(Impl& impl, std::uint16_t port) {
  const std::string wanted = absl::StrCat(impl.endpoint.host, ":", port);
  const std::vector<std::string> options = {"listening_ports",
                                            wanted,
                                            "num_threads",
                                            kThreads,
                                            "request_timeout_ms",
                                            kRequestTimeoutMs,
                                            "enable_keep_alive",
                                            "no",
                                            "enable_directory_listing",
                                            "no"};
  std::string log;
  start_log = &log;
  try {
    CivetCallbacks callbacks;
    callbacks.log_message = KeepLog;
    impl.server = std::make_unique<CivetServer>(options, &callbacks);
  } catch (const CivetException& error) {
    if (log.empty()) log = error.what();
  }
  start_log = nullptr;
  if (impl.server == nullptr) {
    return absl::UnavailableError(absl::StrCat("cannot serve HTTP on ", wanted, ": ", Reason(log)));
  }

  const std::vector<int> ports = impl.server->getListeningPorts();
  assert(ports.size() == 1);
  impl.port = static_cast<std::uint16_t>(ports.front());
  if (impl.endpoint.address.ss_family == AF_INET) {
    reinterpret_cast<sockaddr_in*>(&impl.endpoint.address)->sin_port = htons(impl.port);
  } else {
    reinterpret_cast<sockaddr_in6*>(&impl.endpoint.address)->sin6_port = htons(impl.port);
  }
  impl.server->addHandler("**", &impl);  // one handler for all: exact paths are ours, CivetWeb matches prefixes
  return absl::OkStatus();
}

absl::StatusOr<std::unique_ptr<MetricsServer>> MetricsServer::Start(const std::string& bind_address, std::uint16_t port,
                                                                    std::shared_ptr<prometheus::Registry> registry,
                                                                    std::string token, const MetricsTls& tls) {
  absl::StatusOr<BoundAddress> endpoint = ParseAddress(bind_address);
  if (!endpoint.ok()) return endpoint.status();
  const bool is_open = token.empty() && !tls.used();
  auto impl = std::make_unique<Impl>(*std::move(endpoint), std::move(registry), std::move(token));
  if (tls.used()) {
    const std::string& literal = impl->endpoint.literal;
    // For the reason of a failure, which the server does not report.
    absl::Status free = host::CheckBindable({.host = literal, .port = port}, "metrics");
    if (!free.ok()) return free;
    auto server = TlsPageServer::Start(literal, port, tls, impl->pages);
    if (!server.ok()) {
      return absl::UnavailableError(
          absl::StrCat("cannot serve HTTPS on ", impl->endpoint.host, ":", port, ": ", server.status().message()));
    }
    impl->tls_server = *std::move(server);
    impl->port = impl->tls_server->port();
  } else if (absl::Status status = StartPlain(*impl, port); !status.ok()) {
    return status;
  }
  if (is_open && !host::IsLoopback(impl->endpoint.literal)) {
    spdlog::warn("metrics at {}:{} are shown to whoever reaches it; see --metrics-token-file and --metrics-tls-cert",
                 impl->endpoint.host, impl->port);
  }
  return std::unique_ptr<MetricsServer>(new MetricsServer(std::move(impl)));
}

MetricsServer::MetricsServer(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
MetricsServer::~MetricsServer() { impl_->Stop(); }

std::uint16_t MetricsServer::port() const { return impl_->port; }
std::string MetricsServer::address() const { return absl::StrCat(impl_->endpoint.host, ":", impl_->port); }

void MetricsServer::AddHandler(const std::string& path, HttpHandler handler) {
  impl_->pages.AddHandler(path, std::move(handler));
}

void MetricsServer::AddCollectable(std::weak_ptr<prometheus::Collectable> collectable) {
  impl_->pages.AddCollectable(std::move(collectable));
}

}  // namespace tessera::telemetry
