#include "telemetry/tls_page_server.h"

#include <libwebsockets.h>

#include <atomic>
#include <map>
#include <optional>
#include <thread>
#include <utility>

#include "telemetry/web_listener.h"

namespace tessera::telemetry {
namespace {

constexpr int kPageSeconds = 10;  // for a handshake, and for a request
constexpr std::size_t kMostPageConnections = 64;

// The method and path of a request; other methods than these two are "".
std::pair<std::string, std::string> MethodAndPath(lws* wsi) {
  for (const auto& [token, method] : {std::pair(WSI_TOKEN_GET_URI, "GET"), std::pair(WSI_TOKEN_HEAD_URI, "HEAD")}) {
    if (lws_hdr_total_length(wsi, token) > 0) return {method, RequestHeader(wsi, token)};
  }
  return {};
}

}  // namespace

struct TlsPageServer::Impl {
  Impl(MetricsTls tls_in, ServedPages& pages_in) : tls(std::move(tls_in)), pages(pages_in) {}

  static int OnEvent(lws* wsi, lws_callback_reasons reason, void* user, void* in, size_t len);
  static Impl& Of(lws* wsi) { return *static_cast<Impl*>(lws_context_user(lws_get_context(wsi))); }

  int Begin(lws* wsi);
  int Write(lws* wsi);

  struct Answered {
    HttpReply reply;
    bool with_body = true;
  };

  const MetricsTls tls;
  ServedPages& pages;
  std::atomic<bool> stopping{false};
  std::thread loop;
  // Only the loop's thread uses these. A connection without an answer has not asked yet.
  std::map<lws*, std::optional<Answered>> connections;
  WebListener listener;  // after all that its callback uses
};

int TlsPageServer::Impl::Begin(lws* wsi) {
  const auto [method, path] = MethodAndPath(wsi);
  const HttpReply reply = pages.Reply({.method = method,
                                       .request = {.path = path, .query = RequestHeader(wsi, WSI_TOKEN_HTTP_URI_ARGS)},
                                       .authorization = RequestHeader(wsi, WSI_TOKEN_HTTP_AUTHORIZATION)});
  connections[wsi] = Answered{.reply = reply, .with_body = method != "HEAD"};
  lws_set_timeout(wsi, PENDING_TIMEOUT_HTTP_CONTENT, kPageSeconds);
  lws_callback_on_writable(wsi);
  return 0;
}

int TlsPageServer::Impl::Write(lws* wsi) {
  const auto& [reply, with_body] = *connections[wsi];
  LastAnswer answer{
      .status = reply.status, .content_type = reply.content_type.c_str(), .body = reply.body, .only_head = !with_body};
  if (reply.status == 405) answer.headers.emplace_back("allow:", "GET, HEAD");
  if (reply.status == 401) answer.headers.emplace_back("www-authenticate:", "Bearer");
  return WriteLastAnswer(wsi, answer);
}

int TlsPageServer::Impl::OnEvent(lws* wsi, lws_callback_reasons reason, void* user, void*, size_t) {
  switch (reason) {
    case LWS_CALLBACK_OPENSSL_LOAD_EXTRA_SERVER_VERIFY_CERTS:
      return SetMetricsTls(static_cast<SSL_CTX*>(user), Of(wsi).tls).ok() ? 0 : 1;
    case LWS_CALLBACK_FILTER_NETWORK_CONNECTION:
      return Of(wsi).connections.size() < kMostPageConnections ? 0 : 1;
    case LWS_CALLBACK_SERVER_NEW_CLIENT_INSTANTIATED:
      Of(wsi).connections.emplace(wsi, std::nullopt);
      return 0;
    case LWS_CALLBACK_WSI_DESTROY:
      Of(wsi).connections.erase(wsi);
      return 0;
    case LWS_CALLBACK_HTTP:
      return Of(wsi).Begin(wsi);
    case LWS_CALLBACK_HTTP_WRITEABLE: {
      const auto found = Of(wsi).connections.find(wsi);
      return found == Of(wsi).connections.end() || !found->second ? 0 : Of(wsi).Write(wsi);
    }
    default:
      return 0;
  }
}

absl::StatusOr<std::unique_ptr<TlsPageServer>> TlsPageServer::Start(const std::string& address, std::uint16_t port,
                                                                    MetricsTls tls, ServedPages& pages) {
  // Strangers cause its lines as often as they like. A program that wants them says so after this.
  lws_set_log_level(0, nullptr);
  auto impl = std::make_unique<Impl>(std::move(tls), pages);
  Impl& me = *impl;
  const bool open =
      me.listener.Open({.listen = {address, port}, .tls = true, .timeout_s = kPageSeconds, .keepalive_s = kPageSeconds},
                       {{"http", Impl::OnEvent, 0, 0, 0, nullptr, 0}}, &me);
  std::unique_ptr<TlsPageServer> server(new TlsPageServer(std::move(impl)));
  if (!open) return absl::UnavailableError("the address cannot be bound");
  me.loop = std::thread([&me] { me.listener.Serve(me.stopping); });
  return server;
}

TlsPageServer::TlsPageServer(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}

TlsPageServer::~TlsPageServer() {
  impl_->stopping = true;
  impl_->listener.Wake();
  if (impl_->loop.joinable()) impl_->loop.join();
  impl_->listener.Close();
}

std::uint16_t TlsPageServer::port() const { return impl_->listener.port(); }

}  // namespace tessera::telemetry
