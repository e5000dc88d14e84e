// WebListener: the socket and the loop that libwebsockets keeps for a server of web pages. The server itself says, in
// its callback, who is let in and what is answered.
//
//   WebListener listener;
//   if (!listener.Open({.listen = {"10.0.0.7", 7702}, .tls = true, .timeout_s = 10}, {{"http", OnEvent}}, &server)) ...
//   std::thread loop([&] { listener.Serve(stopping); });
//   ... stopping = true; listener.Wake(); loop.join(); listener.Close();
//
// Requests of all paths go to the first protocol. Of a TLS listener it also gets
// LWS_CALLBACK_OPENSSL_LOAD_EXTRA_SERVER_VERIFY_CERTS, in which it puts the certificate into the context.
//
// Thread rule: opened and closed by one thread, while no loop runs; Serve on the loop's thread, on which all callbacks
// come; Wake on any, until it is closed.
#pragma once

#include <libwebsockets.h>

#include <atomic>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/string_view.h"
#include "host/socket_address.h"

namespace tessera::telemetry {

struct WebListenerOptions {
  host::SocketAddress listen;  // an IP address; port 0 takes a free one
  std::string socket_path{};   // a Unix socket in place of it
  bool tls = false;
  bool http2 = false;   // over TLS, beside HTTP/1.1
  int timeout_s = 0;    // for a handshake, and for a request's headers
  int keepalive_s = 0;  // between two requests of a connection; 0: as libwebsockets has it
  const lws_protocol_vhost_options* headers = nullptr;  // in answers that libwebsockets words
  const lws_retry_bo_t* patience = nullptr;             // with a silent WebSocket; null: as libwebsockets has it
};

class WebListener {
 public:
  WebListener() = default;
  ~WebListener() { Close(); }
  WebListener(const WebListener&) = delete;
  WebListener& operator=(const WebListener&) = delete;

  // `user` is what lws_context_user gives. False: the address cannot be served, without a reason. What the options
  // point to, and `user`, stay until it is closed.
  bool Open(const WebListenerOptions& options, std::vector<lws_protocols> protocols, void* user);
  // Until `stopping`, which is looked at after each event and each Wake.
  void Serve(const std::atomic<bool>& stopping);
  // LWS_CALLBACK_EVENT_WAIT_CANCELLED comes soon. Does nothing before it is open.
  void Wake();
  // Has the first protocol told by LWS_CALLBACK_RAW_RX_FILE whenever the descriptor can be read. It is the listener's
  // from then on, also where this returns false: it cannot be watched.
  bool Watch(int descriptor);
  // Ends all connections, whose callbacks still come.
  void Close();

  lws_context* context() const { return context_; }
  std::uint16_t port() const;  // as bound

 private:
  std::vector<lws_protocols> protocols_;
  lws_http_mount mount_{};
  lws_context* context_ = nullptr;
  lws_vhost* vhost_ = nullptr;
};

// A header of a request; empty where there is none, or it is longer than 1023 bytes.
std::string RequestHeader(lws* wsi, lws_token_indexes header);

// An answer after which its connection ends.
struct LastAnswer {
  int status = 200;
  const char* content_type = "";
  absl::string_view body;
  bool only_head = false;                                      // as to HEAD: the body is only counted
  std::vector<std::pair<const char*, std::string>> headers{};  // "allow:", "GET"; in all below 1 KB
};

// Call it when the connection is writable. Returns what the callback then returns.
int WriteLastAnswer(lws* wsi, const LastAnswer& answer);

}  // namespace tessera::telemetry
