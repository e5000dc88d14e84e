#include "telemetry/web_listener.h"

#include <unistd.h>

#include <algorithm>
#include <array>

namespace tessera::telemetry {
namespace {

// A path, a query and a token fit.
constexpr std::size_t kMostRequestHeader = 1024;
constexpr std::size_t kAnswerHeaderBytes = 1024;

}  // namespace

bool WebListener::Open(const WebListenerOptions& options, std::vector<lws_protocols> protocols, void* user) {
  protocols_ = std::move(protocols);
  protocols_.push_back({});
  mount_.mountpoint = "/";
  mount_.mountpoint_len = 1;
  mount_.origin = protocols_.front().name;
  mount_.origin_protocol = LWSMPRO_CALLBACK;

  lws_context_creation_info info{};
  info.options = LWS_SERVER_OPTION_EXPLICIT_VHOSTS;
  if (!options.socket_path.empty()) {
    info.iface = options.socket_path.c_str();
    info.options |= LWS_SERVER_OPTION_UNIX_SOCK;
  } else {
    info.port = options.listen.port;
    info.iface = options.listen.host == "0.0.0.0" ? nullptr : options.listen.host.c_str();
    if (options.listen.host.find(':') == std::string::npos) info.options |= LWS_SERVER_OPTION_DISABLE_IPV6;
  }
  if (options.tls) {
    info.options |= LWS_SERVER_OPTION_DO_SSL_GLOBAL_INIT | LWS_SERVER_OPTION_CREATE_VHOST_SSL_CTX;
    if (!options.http2) info.alpn = "http/1.1";
  }
  info.protocols = protocols_.data();
  info.mounts = &mount_;
  info.headers = options.headers;
  info.user = user;
  info.gid = static_cast<gid_t>(-1);
  info.uid = static_cast<uid_t>(-1);
  info.timeout_secs = static_cast<unsigned>(options.timeout_s);
  info.keepalive_timeout = options.keepalive_s;
  info.retry_and_idle_policy = options.patience;
  context_ = lws_create_context(&info);
  vhost_ = context_ == nullptr ? nullptr : lws_create_vhost(context_, &info);
  return vhost_ != nullptr;
}

void WebListener::Serve(const std::atomic<bool>& stopping) {
  while (!stopping && lws_service(context_, 0) >= 0) continue;
}

void WebListener::Wake() {
  if (context_ != nullptr) lws_cancel_service(context_);
}

bool WebListener::Watch(int descriptor) {
  lws_sock_file_fd_type file{};
  file.filefd = descriptor;
  if (lws_adopt_descriptor_vhost(vhost_, LWS_ADOPT_RAW_FILE_DESC, file, protocols_.front().name, nullptr) != nullptr) {
    return true;
  }
  close(descriptor);
  return false;
}

void WebListener::Close() {
  if (context_ != nullptr) lws_context_destroy(std::exchange(context_, nullptr));
}

std::uint16_t WebListener::port() const { return static_cast<std::uint16_t>(lws_get_vhost_listen_port(vhost_)); }

std::string RequestHeader(lws* wsi, lws_token_indexes header) {
  std::array<char, kMostRequestHeader> text{};
  const int bytes = lws_hdr_copy(wsi, text.data(), text.size(), header);
  return bytes > 0 ? std::string(text.data(), static_cast<std::size_t>(bytes)) : "";
}

int WriteLastAnswer(lws* wsi, const LastAnswer& answer) {
  std::vector<unsigned char> head(LWS_PRE + kAnswerHeaderBytes);
  unsigned char* at = head.data() + LWS_PRE;
  unsigned char* const begin = at;
  unsigned char* const end = head.data() + head.size() - 1;
  const auto add = [&](const char* name, const std::string& value) {
    return lws_add_http_header_by_name(wsi, reinterpret_cast<const unsigned char*>(name),
                                       reinterpret_cast<const unsigned char*>(value.data()),
                                       static_cast<int>(value.size()), &at, end) == 0;
  };
  if (lws_add_http_header_status(wsi, static_cast<unsigned>(answer.status), &at, end) != 0 ||
      !add("content-type:", answer.content_type) || !add("content-length:", std::to_string(answer.body.size())) ||
      !add("connection:", "close") ||
      !std::ranges::all_of(answer.headers, [&](const auto& header) { return add(header.first, header.second); }) ||
      lws_finalize_write_http_header(wsi, begin, &at, end) != 0) {
    return -1;
  }
  if (answer.only_head || answer.body.empty()) return -1;
  std::vector<unsigned char> out(LWS_PRE + answer.body.size());
  std::copy(answer.body.begin(), answer.body.end(), out.begin() + LWS_PRE);
  (void)lws_write(wsi, out.data() + LWS_PRE, answer.body.size(), LWS_WRITE_HTTP_FINAL);
  return -1;  // bytes that the socket did not take yet are sent before it closes
}

}  // namespace tessera::telemetry
