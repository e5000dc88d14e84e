#include "gateway/web_server.h"

#include <libwebsockets.h>
#include <sys/timerfd.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <mutex>
#include <utility>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "gateway/connection_room.h"
#include "gateway/http_connections.h"
#include "gateway/http_site.h"
#include "gateway/page_files.h"
#include "gateway/viewer_format.h"
#include "gateway/viewer_sockets.h"
#include "gateway/web_request.h"
#include "spdlog/spdlog.h"
#include "telemetry/web_listener.h"

namespace tessera::gateway {
namespace {

// A frame of a page is 16.7 ms long; this often worlds are polled while somebody watches.
constexpr std::chrono::nanoseconds kFrame{1'000'000'000 / 60}, kIdle = std::chrono::milliseconds(200);
// Bytes that go to a socket at once; the rest of a larger message waits for the socket.
constexpr std::size_t kWrite_bytes = 256 * 1024;
// A connection that has been silent for so long is asked whether it is there, and ended when it does not answer.
constexpr std::uint16_t kPingAfter_s = 20, kHangUpAfter_s = 40;
constexpr int kRequestTimeout_s = 10;
constexpr unsigned kTooManyRequests = 429;
constexpr char kCertificateName[] = "--certificate";

void LogLine(int level, const char* line) {
  const std::string text(absl::StripTrailingAsciiWhitespace(line));
  if ((level & LLL_ERR) != 0) {
    spdlog::error("web {}", text);
  } else {
    spdlog::debug("web {}", text);
  }
}

}  // namespace

// Decides who may connect, and hands what libwebsockets reports to the parts of the server.
struct WebServer::Impl {
  Impl(const WebOptions& options_in, PageFiles page, GatewayMetrics& metrics_in)
      : options(options_in),
        metrics(metrics_in),
        viewers(metrics_in),
        site(
            std::move(page), options_in.visuals, [this] { Wake(); }, options_in.fetch_visual) {}

  static int OnHttp(lws* wsi, lws_callback_reasons reason, void* user, void* in, size_t len);
  static int OnViewer(lws* wsi, lws_callback_reasons reason, void* user, void* in, size_t len);
  static Impl& Of(lws* wsi) { return *static_cast<Impl*>(lws_context_user(lws_get_context(wsi))); }

  bool HasRoom();
  void Opened(lws* wsi);
  void Closed(lws* wsi);
  bool MayConnect(lws* wsi, const char* refusal);
  bool Refuse(lws* wsi, unsigned status, const char* refusal, prometheus::Counter& counter);
  bool Listen();
  bool StartTimer();
  void OnTimer();
  void KeepPace();
  void Tick() {
    site.Finish();
    viewers.Tick();
  }
  void Wake() {
    const std::lock_guard lock(waking);
    if (!stopped) listener.Wake();
  }

  WebOptions options;
  GatewayMetrics& metrics;
  lws_retry_bo_t patience{};
  int timer = -1;  // the listener's, once it is watched
  std::chrono::nanoseconds pace{};
  ConnectionRoom room{options.max_connections, options.max_address_connections};
  std::mutex waking;
  bool stopped = false;  // under `waking`
  ViewerSockets viewers;
  HttpSite site;  // after `waking`: its thread wakes the loop
  HttpConnections http{site};
  telemetry::WebListener listener;  // after all that its callbacks use
};

// --- Who may connect -------------------------------------------------------------------------------------------------

bool WebServer::Impl::HasRoom() {
  if (room.MayOpen()) return true;
  metrics.refused_full.Increment();
  return false;
}

// A connection of HTTP/2 has several streams, which libwebsockets reports as connections of their own.
void WebServer::Impl::Opened(lws* wsi) {
  lws* const connection = lws_get_network_wsi(wsi);
  std::array<char, 64> address{};
  lws_get_peer_simple(connection, address.data(), address.size());
  room.Opened(connection, address.data());
  metrics.connections.Set(static_cast<double>(room.size()));
}

void WebServer::Impl::Closed(lws* wsi) {
  room.Closed(wsi);
  metrics.connections.Set(static_cast<double>(room.size()));
}

bool WebServer::Impl::Refuse(lws* wsi, unsigned status, const char* refusal, prometheus::Counter& counter) {
  counter.Increment();
  lws_return_http_status(wsi, status, refusal);
  return false;
}

bool WebServer::Impl::MayConnect(lws* wsi, const char* refusal) {
  Opened(wsi);
  switch (room.Of(lws_get_network_wsi(wsi))) {
    case ConnectionRoom::Verdict::kServed:
      break;
    case ConnectionRoom::Verdict::kFull:
      return Refuse(wsi, HTTP_STATUS_SERVICE_UNAVAILABLE,
                    "This gateway has as many connections as --max-connections allows: come again later.",
                    metrics.refused_full);
    case ConnectionRoom::Verdict::kAddressFull:
      return Refuse(wsi, kTooManyRequests,
                    "Your address has as many connections here as --max-connections-per-address allows: close some.",
                    metrics.refused_address);
  }
  const std::string host = HeaderOf(wsi, WSI_TOKEN_HOST), origin = HeaderOf(wsi, WSI_TOKEN_ORIGIN);
  if (gateway::MayConnect(host, origin, options.allow_origins)) return true;
  return Refuse(wsi, HTTP_STATUS_FORBIDDEN, refusal, metrics.refused_origin);
}

// --- What libwebsockets reports --------------------------------------------------------------------------------------

int WebServer::Impl::OnHttp(lws* wsi, lws_callback_reasons reason, void* user, void* in, size_t len) {
  switch (reason) {
    case LWS_CALLBACK_OPENSSL_LOAD_EXTRA_SERVER_VERIFY_CERTS:
      return trust::LoadServerCertificate(static_cast<SSL_CTX*>(user), *Of(wsi).options.certificate, kCertificateName)
                     .ok()
                 ? 0
                 : 1;
    case LWS_CALLBACK_FILTER_NETWORK_CONNECTION:
      return Of(wsi).HasRoom() ? 0 : 1;
    case LWS_CALLBACK_SERVER_NEW_CLIENT_INSTANTIATED:
      Of(wsi).Opened(wsi);
      return 0;
    case LWS_CALLBACK_WSI_DESTROY:
      Of(wsi).http.Forget(wsi);
      Of(wsi).Closed(wsi);
      return 0;
    case LWS_CALLBACK_FILTER_HTTP_CONNECTION:
      return Of(wsi).MayConnect(wsi, "This gateway is not known by that name; see --allow-origin.") ? 0 : -1;
    case LWS_CALLBACK_HTTP:
      return Of(wsi).http.Begin(wsi);
    case LWS_CALLBACK_HTTP_WRITEABLE:
      if (!Of(wsi).http.Has(wsi)) break;
      return Of(wsi).http.Write(wsi);
    // An order says all in its headers; it is answered when it is done.
    case LWS_CALLBACK_HTTP_BODY:
    case LWS_CALLBACK_HTTP_BODY_COMPLETION:
      return 0;
    case LWS_CALLBACK_CLOSED_HTTP:
      Of(wsi).http.Forget(wsi);
      break;
    case LWS_CALLBACK_EVENT_WAIT_CANCELLED:
      Of(wsi).Tick();
      return 0;
    case LWS_CALLBACK_RAW_RX_FILE:
      Of(wsi).OnTimer();
      return 0;
    default:
      break;
  }
  return lws_callback_http_dummy(wsi, reason, user, in, len);
}

int WebServer::Impl::OnViewer(lws* wsi, lws_callback_reasons reason, void* /*user*/, void* in, size_t len) {
  Impl& me = Of(wsi);
  switch (reason) {
    case LWS_CALLBACK_FILTER_PROTOCOL_CONNECTION:
      if (!me.MayConnect(wsi, "This page may not connect here; see --allow-origin.")) return -1;
      return me.viewers.Admit(wsi);
    case LWS_CALLBACK_ESTABLISHED:
      if (me.viewers.Open(wsi) != 0) return -1;
      me.KeepPace();
      return 0;
    case LWS_CALLBACK_RECEIVE:
      return me.viewers.Receive(wsi, {static_cast<const char*>(in), len});
    case LWS_CALLBACK_SERVER_WRITEABLE:
      return me.viewers.Write(wsi);
    case LWS_CALLBACK_CLOSED:
      me.viewers.Close(wsi);
      return 0;
    default:
      return 0;
  }
}

// --- The loop --------------------------------------------------------------------------------------------------------

// The kernel's timer keeps the rhythm and wakes the loop once a tick. The library's own counts from the end of one tick
// to the next, and waits in whole milliseconds: for what is left of the last one the loop would turn without a rest.
bool WebServer::Impl::StartTimer() {
  timer = timerfd_create(CLOCK_MONOTONIC, TFD_NONBLOCK | TFD_CLOEXEC);
  if (timer < 0 || !listener.Watch(timer)) return false;
  KeepPace();
  return true;
}

void WebServer::Impl::OnTimer() {
  std::uint64_t expired = 0;
  if (read(timer, &expired, sizeof expired) != sizeof expired) return;
  Tick();
  KeepPace();
}

void WebServer::Impl::KeepPace() {
  const std::chrono::nanoseconds wanted = viewers.idle() ? kIdle : kFrame;
  if (wanted == std::exchange(pace, wanted)) return;
  const timespec interval{.tv_sec = 0, .tv_nsec = wanted.count()};
  const itimerspec times{.it_interval = interval, .it_value = interval};
  timerfd_settime(timer, 0, &times, nullptr);
}

// False: the address cannot be served.
bool WebServer::Impl::Listen() {
  patience.secs_since_valid_ping = kPingAfter_s;
  patience.secs_since_valid_hangup = kHangUpAfter_s;
  return listener.Open({.listen = options.listen,
                        .tls = options.certificate.has_value(),
                        .http2 = true,
                        .timeout_s = kRequestTimeout_s,
                        .headers = CommonHeaders(),
                        .patience = &patience},
                       {{"http", OnHttp, 0, kMaxViewerMessage_bytes, 0, nullptr, kWrite_bytes},
                        {kViewerSubprotocol, OnViewer, 0, kMaxViewerMessage_bytes, 0, nullptr, kWrite_bytes}},
                       this);
}

absl::StatusOr<std::unique_ptr<WebServer>> WebServer::Start(const WebOptions& options, GatewayMetrics& metrics) {
  if (absl::Status status = host::CheckBindable(options.listen, "page"); !status.ok()) return status;
  if (options.certificate) {
    // Before the address is bound, so that a fault is found at the start.
    absl::Status fits = trust::CheckServerCertificate(*options.certificate, kCertificateName);
    if (!fits.ok()) return fits;
  }
  absl::StatusOr<PageFiles> page = options.page.empty() ? PageFiles() : PageFiles::Read(options.page);
  if (!page.ok()) return page.status();
  lws_set_log_level(LLL_ERR | LLL_WARN, LogLine);
  std::unique_ptr<WebServer> server(new WebServer(std::make_unique<Impl>(options, *std::move(page), metrics)));
  Impl& me = *server->impl_;
  if (!me.Listen()) {
    return absl::UnavailableError(absl::StrCat("address ", host::ToString(options.listen), " cannot be served"));
  }
  if (!me.StartTimer()) return absl::ResourceExhaustedError("the gateway has no descriptor left for its timer");
  return server;
}

WebServer::WebServer(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}

WebServer::~WebServer() { Stop(); }

void WebServer::Stop() {
  {
    const std::lock_guard lock(impl_->waking);
    impl_->stopped = true;
  }
  impl_->listener.Close();
}

std::string WebServer::address() const { return host::ToString({impl_->options.listen.host, impl_->listener.port()}); }

void WebServer::Serve(Gateway& gateway) {
  impl_->viewers.Serve(gateway);
  impl_->site.Serve(gateway);
}
void WebServer::Service() { lws_service(impl_->listener.context(), 0); }
void WebServer::Wake() { impl_->Wake(); }

}  // namespace tessera::gateway
