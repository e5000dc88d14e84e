#include "telemetry/tls_page_server.h"

#include <libwebsockets.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <map>
#include <optional>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"

namespace tessera::telemetry {
namespace {

constexpr int kPageSeconds = 10;  // for a handshake, and for a request
constexpr std::size_t kMostPageConnections = 64;
constexpr std::size_t kPageHeaderBytes = 1024;  // room for an answer's headers
// A request's headers that are looked at: a path, a query and a token fit.
constexpr std::size_t kMostHeaderText = 1024;

std::string HeaderText(lws* wsi, lws_token_indexes header) {
  std::array<char, kMostHeaderText> text{};
  const int bytes = lws_hdr_copy(wsi, text.data(), text.size(), header);
  return bytes > 0 ? std::string(text.data(), static_cast<std::size_t>(bytes)) : "";
}

// The method and path of a request; other methods than these two are "".
std::pair<std::string, std::string> MethodAndPath(lws* wsi) {
  for (const auto& [token, method] : {std::pair(WSI_TOKEN_GET_URI, "GET"), std::pair(WSI_TOKEN_HEAD_URI, "HEAD")}) {
    if (lws_hdr_total_length(wsi, token) > 0) return {method, HeaderText(wsi, token)};
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
  lws_context* context = nullptr;
  lws_vhost* vhost = nullptr;
  std::array<lws_protocols, 2> protocols{};
  lws_http_mount mount{};
  std::atomic<bool> stopping{false};
  std::thread loop;
  // Only the loop's thread uses these. A connection without an answer has not asked yet.
  std::map<lws*, std::optional<Answered>> connections;
};

int TlsPageServer::Impl::Begin(lws* wsi) {
  const auto [method, path] = MethodAndPath(wsi);
  const HttpReply reply = pages.Reply({.method = method,
                                       .request = {.path = path, .query = HeaderText(wsi, WSI_TOKEN_HTTP_URI_ARGS)},
                                       .authorization = HeaderText(wsi, WSI_TOKEN_HTTP_AUTHORIZATION)});
  connections[wsi] = Answered{.reply = reply, .with_body = method != "HEAD"};
  lws_set_timeout(wsi, PENDING_TIMEOUT_HTTP_CONTENT, kPageSeconds);
  lws_callback_on_writable(wsi);
  return 0;
}

int TlsPageServer::Impl::Write(lws* wsi) {
  const Answered& answered = *connections[wsi];
  const HttpReply& reply = answered.reply;
  std::vector<unsigned char> headers(LWS_PRE + kPageHeaderBytes);
  unsigned char* at = headers.data() + LWS_PRE;
  unsigned char* const begin = at;
  unsigned char* const end = headers.data() + headers.size() - 1;
  const auto add = [&](const char* name, const std::string& value) {
    return lws_add_http_header_by_name(wsi, reinterpret_cast<const unsigned char*>(name),
                                       reinterpret_cast<const unsigned char*>(value.data()),
                                       static_cast<int>(value.size()), &at, end) == 0;
  };
  if (lws_add_http_header_status(wsi, static_cast<unsigned>(reply.status), &at, end) != 0 ||
      !add("content-type:", reply.content_type) || !add("content-length:", std::to_string(reply.body.size())) ||
      !add("connection:", "close") || (reply.status == 405 && !add("allow:", "GET, HEAD")) ||
      (reply.status == 401 && !add("www-authenticate:", "Bearer")) ||
      lws_finalize_write_http_header(wsi, begin, &at, end) != 0) {
    return -1;
  }
  if (!answered.with_body || reply.body.empty()) return -1;
  std::vector<unsigned char> out(LWS_PRE + reply.body.size());
  std::copy(reply.body.begin(), reply.body.end(), out.begin() + LWS_PRE);
  (void)lws_write(wsi, out.data() + LWS_PRE, reply.body.size(), LWS_WRITE_HTTP_FINAL);
  return -1;  // bytes that the socket did not take yet are sent before it closes
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
  me.protocols[0] = {"http", Impl::OnEvent, 0, 0, 0, nullptr, 0};
  me.mount.mountpoint = "/";
  me.mount.mountpoint_len = 1;
  me.mount.origin = "http";
  me.mount.origin_protocol = LWSMPRO_CALLBACK;

  lws_context_creation_info info{};
  info.options =
      LWS_SERVER_OPTION_EXPLICIT_VHOSTS | LWS_SERVER_OPTION_DO_SSL_GLOBAL_INIT | LWS_SERVER_OPTION_CREATE_VHOST_SSL_CTX;
  if (address.find(':') == std::string::npos) info.options |= LWS_SERVER_OPTION_DISABLE_IPV6;
  info.port = port;
  info.iface = address == "0.0.0.0" ? nullptr : address.c_str();
  info.alpn = "http/1.1";
  info.protocols = me.protocols.data();
  info.mounts = &me.mount;
  info.user = impl.get();
  info.gid = static_cast<gid_t>(-1);
  info.uid = static_cast<uid_t>(-1);
  info.timeout_secs = kPageSeconds;
  info.keepalive_timeout = kPageSeconds;
  me.context = lws_create_context(&info);
  me.vhost = me.context == nullptr ? nullptr : lws_create_vhost(me.context, &info);
  std::unique_ptr<TlsPageServer> server(new TlsPageServer(std::move(impl)));
  if (me.vhost == nullptr) return absl::UnavailableError("the address cannot be bound");
  me.loop = std::thread([&me] {
    while (!me.stopping && lws_service(me.context, 0) >= 0) continue;
  });
  return server;
}

TlsPageServer::TlsPageServer(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}

TlsPageServer::~TlsPageServer() {
  if (impl_->context == nullptr) return;
  impl_->stopping = true;
  lws_cancel_service(impl_->context);
  if (impl_->loop.joinable()) impl_->loop.join();
  lws_context_destroy(std::exchange(impl_->context, nullptr));
}

std::uint16_t TlsPageServer::port() const {
  return static_cast<std::uint16_t>(lws_get_vhost_listen_port(impl_->vhost));
}

}  // namespace tessera::telemetry
