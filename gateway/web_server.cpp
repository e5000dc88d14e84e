#include "gateway/web_server.h"

#include <libwebsockets.h>
#include <netinet/tcp.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <map>
#include <mutex>
#include <utility>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/strip.h"
#include "core/world/sha256.h"
#include "gateway/page_files.h"
#include "gateway/viewer_format.h"
#include "gateway/visual_files.h"
#include "gateway/web_request.h"
#include "spdlog/spdlog.h"

namespace tessera::gateway {
namespace {

// A frame of a page is 16.7 ms long; this often worlds are polled while somebody watches.
constexpr lws_usec_t kFrame_us = 1'000'000 / 60, kIdle_us = 200'000;
// The kernel takes no more than this of what it has not sent, so a viewer that reads slowly gets new frames, and costs
// no memory.
constexpr int kUnsent_bytes = 16 * 1024, kSendBuffer_bytes = 256 * 1024;
// Bytes that go to a socket at once; the rest of a larger message waits for the socket.
constexpr std::size_t kWrite_bytes = 256 * 1024;
// Bytes of the page sent at once: libwebsockets keeps them for a socket that takes less.
constexpr std::size_t kPagePiece_bytes = 32 * 1024;
// A connection that has been silent for so long is asked whether it is there, and ended when it does not answer.
constexpr std::uint16_t kPingAfter_s = 20, kHangUpAfter_s = 40;
constexpr int kRequestTimeout_s = 10;
// An order by HTTP waits for the control plane to say whose token it came with.
constexpr int kOrderTimeout_s = 30;
constexpr std::size_t kMaxInstanceName = 64;
constexpr char kPlainText[] = "text/plain; charset=utf-8", kJson[] = "application/json";
constexpr std::size_t kMaxRecordingName = 128;
constexpr absl::string_view kVisualPath = "/visuals/", kVisualEnding = ".glb";
constexpr char kGlb[] = "model/gltf-binary";
constexpr absl::string_view kWatchPath = "/watch/", kPlayPath = "/play/", kRecordPath = "/api/recordings/";

void LogLine(int level, const char* line) {
  const std::string text(absl::StripTrailingAsciiWhitespace(line));
  if ((level & LLL_ERR) != 0) {
    spdlog::error("web {}", text);
  } else {
    spdlog::debug("web {}", text);
  }
}

}  // namespace

struct WebServer::Impl {
  // A connection of a viewer.
  struct Peer {
    ViewerId viewer = 0;
    lws* wsi = nullptr;
    std::string text;
    bool too_long = false, asked_to_write = false;
  };

  // The part of the page, or the mesh file, that an HTTP connection is being sent; null: none. Or the order that it
  // waits for; 0: none. Or the mesh file that it waits for, and holds until it is sent.
  struct Download {
    const std::string* bytes = nullptr;
    std::size_t sent = 0;
    std::uint64_t order = 0, visual = 0;
  };
  // A request for a mesh file, until it is answered or its connection is gone.
  struct AskedVisual {
    lws* wsi = nullptr;
    bool with_body = true;
    std::optional<VisualFiles::Answer> answer;
  };
  // An order by HTTP, until it is answered or its connection is gone.
  struct Posted {
    lws* wsi = nullptr;
    std::optional<absl::StatusOr<RecordingState>> done;
  };

  static int OnHttp(lws* wsi, lws_callback_reasons reason, void* user, void* in, size_t len);
  static int OnViewer(lws* wsi, lws_callback_reasons reason, void* user, void* in, size_t len);
  static void OnTick(lws_sorted_usec_list_t* timer);
  static Impl& Of(lws* wsi) { return *static_cast<Impl*>(lws_context_user(lws_get_context(wsi))); }

  bool MayConnect(lws* wsi) const {
    return gateway::MayConnect(HeaderOf(wsi, WSI_TOKEN_HOST), HeaderOf(wsi, WSI_TOKEN_ORIGIN), options.allow_origins);
  }
  int Reply(lws* wsi, unsigned status, const char* type, const std::string& body);
  int Answer(lws* wsi, Download& download);
  int Post(lws* wsi, Download& download);
  int AnswerPost(lws* wsi, Download& download);
  int AskVisual(lws* wsi, absl::string_view sha256, bool with_body, Download& download);
  int AnswerVisual(lws* wsi, Download& download);
  int SendPage(lws* wsi, const PageFile& file, bool with_body, Download& download);
  static int SendMore(lws* wsi, Download& download);
  int FilterViewer(lws* wsi);
  void Open(lws* wsi, Peer& peer);
  void Receive(lws* wsi, Peer& peer, std::string_view bytes);
  int Write(lws* wsi, Peer& peer);
  void Tick();

  WebOptions options;
  GatewayMetrics& metrics;
  Gateway* gateway = nullptr;
  lws_context* context = nullptr;
  lws_vhost* vhost = nullptr;
  std::array<lws_protocols, 3> protocols{};
  PageFiles page;
  lws_http_mount mount{};
  lws_retry_bo_t patience{};
  // The timer, and whose it is.
  struct Timer {
    lws_sorted_usec_list_t list{};
    Impl* owner = nullptr;
  } timer;
  std::map<ViewerId, Peer*> peers;
  std::map<std::uint64_t, Posted> posted;
  std::uint64_t last_posted = 0;
  std::map<std::uint64_t, AskedVisual> asked_visuals;
  std::uint64_t last_visual = 0;
  std::size_t connections = 0;
  std::vector<unsigned char> out;
  std::mutex waking;
  bool stopped = false;  // under `waking`
  VisualFiles visuals;   // last: its thread wakes the loop

  Impl(const WebOptions& options_in, GatewayMetrics& metrics_in)
      : options(options_in), metrics(metrics_in), visuals(options_in.visuals, [this] { Wake(); }) {}

  void Wake() {
    const std::lock_guard lock(waking);
    if (!stopped && context != nullptr) lws_cancel_service(context);
  }
};

// --- Pages -----------------------------------------------------------------------------------------------------------

int WebServer::Impl::Reply(lws* wsi, unsigned status, const char* type, const std::string& body) {
  std::vector<unsigned char> headers(LWS_PRE + 2048);
  unsigned char* at = headers.data() + LWS_PRE;
  unsigned char* const begin = at;
  unsigned char* const end = headers.data() + headers.size() - 1;
  if (lws_add_http_common_headers(wsi, status, type, body.size(), &at, end) != 0 ||
      !AddHeader(wsi, WSI_TOKEN_HTTP_CACHE_CONTROL, "no-store", &at, end) ||
      lws_finalize_write_http_header(wsi, begin, &at, end) != 0) {
    return 1;
  }
  out.resize(LWS_PRE + body.size());
  std::copy(body.begin(), body.end(), out.begin() + LWS_PRE);
  if (lws_write(wsi, out.data() + LWS_PRE, body.size(), LWS_WRITE_HTTP_FINAL) < 0) return 1;
  return lws_http_transaction_completed(wsi) != 0 ? -1 : 0;
}

// Ends or begins a recording: /api/recordings/INSTANCE/start, by the right in the header `Authorization: Bearer ...`.
// The body of the request is not read.
int WebServer::Impl::Post(lws* wsi, Download& download) {
  const std::string path = HeaderOf(wsi, WSI_TOKEN_POST_URI);
  absl::string_view instance = path;
  const bool known = absl::ConsumePrefix(&instance, kRecordPath);
  const bool on = absl::ConsumeSuffix(&instance, "/start");
  const bool off = !on && absl::ConsumeSuffix(&instance, "/stop");
  if (gateway == nullptr || !known || (!on && !off) || !IsName(instance, kMaxInstanceName)) {
    return Reply(wsi, HTTP_STATUS_NOT_FOUND, kPlainText, "There is nothing to post to at this address.\n");
  }
  const std::string header = HeaderOf(wsi, WSI_TOKEN_HTTP_AUTHORIZATION);
  absl::string_view shown = header;
  if (!absl::ConsumePrefix(&shown, "Bearer ")) shown = "";
  const std::uint64_t order = ++last_posted;
  posted[order].wsi = wsi;
  gateway->Record(std::string(instance), on, std::string(shown),
                  [this, order](const absl::StatusOr<RecordingState>& done) {
                    const auto waiting = posted.find(order);
                    if (waiting == posted.end()) return;
                    waiting->second.done = done;
                    lws_callback_on_writable(waiting->second.wsi);
                  });
  download = {.order = order};
  lws_set_timeout(wsi, PENDING_TIMEOUT_HTTP_CONTENT, kOrderTimeout_s);
  return 0;
}

int WebServer::Impl::AnswerPost(lws* wsi, Download& download) {
  const auto waiting = posted.find(download.order);
  if (waiting == posted.end() || !waiting->second.done) return 0;
  const absl::StatusOr<RecordingState> state = *std::move(waiting->second.done);
  posted.erase(waiting);
  download = {};
  if (state.ok()) return Reply(wsi, HTTP_STATUS_OK, kJson, RecordingMessage(*state));
  unsigned status = HTTP_STATUS_CONFLICT;
  if (absl::IsNotFound(state.status())) status = HTTP_STATUS_NOT_FOUND;
  if (absl::IsPermissionDenied(state.status())) status = HTTP_STATUS_FORBIDDEN;
  if (absl::IsUnauthenticated(state.status())) status = HTTP_STATUS_UNAUTHORIZED;
  return Reply(wsi, status, kPlainText, absl::StrCat(state.status().message(), "\n"));
}

// Answers once the file is read.
int WebServer::Impl::AskVisual(lws* wsi, absl::string_view sha256, bool with_body, Download& download) {
  const std::uint64_t number = ++last_visual;
  download = {.visual = number};
  asked_visuals[number] = {.wsi = wsi, .with_body = with_body, .answer = std::nullopt};
  lws_set_timeout(wsi, PENDING_TIMEOUT_HTTP_CONTENT, kRequestTimeout_s);
  visuals.Ask(std::string(sha256), [this, number](const VisualFiles::Answer& answer) {
    const auto asked = asked_visuals.find(number);
    if (asked == asked_visuals.end()) return;
    asked->second.answer = answer;
    lws_callback_on_writable(asked->second.wsi);
  });
  return 0;
}

// A name that is a hash has one content for ever, so a browser asks once.
int WebServer::Impl::AnswerVisual(lws* wsi, Download& download) {
  const auto asked = asked_visuals.find(download.visual);
  if (asked == asked_visuals.end() || !asked->second.answer) return 0;
  const VisualFiles::Answer& answer = *asked->second.answer;
  if (!answer.ok()) {
    const unsigned status =
        absl::IsNotFound(answer.status()) ? HTTP_STATUS_NOT_FOUND : HTTP_STATUS_INTERNAL_SERVER_ERROR;
    const std::string why = absl::StrCat(answer.status().message(), "\n");
    asked_visuals.erase(asked);
    download = {};
    return Reply(wsi, status, kPlainText, why);
  }
  std::vector<unsigned char> headers(LWS_PRE + 2048);
  unsigned char* at = headers.data() + LWS_PRE;
  unsigned char* const begin = at;
  unsigned char* const end = headers.data() + headers.size() - 1;
  if (lws_add_http_common_headers(wsi, HTTP_STATUS_OK, kGlb, (*answer)->size(), &at, end) != 0 ||
      !AddHeader(wsi, WSI_TOKEN_HTTP_CACHE_CONTROL, "private, max-age=31536000, immutable", &at, end) ||
      lws_finalize_write_http_header(wsi, begin, &at, end) != 0) {
    return 1;
  }
  if (!asked->second.with_body || (*answer)->empty()) {
    asked_visuals.erase(asked);
    download = {};
    return lws_http_transaction_completed(wsi) != 0 ? -1 : 0;
  }
  download.bytes = answer->get();
  lws_callback_on_writable(wsi);
  return 0;
}

// A browser asks each time whether what it has is still the newest, for the names of files stay the same.
int WebServer::Impl::SendPage(lws* wsi, const PageFile& file, bool with_body, Download& download) {
  std::vector<unsigned char> headers(LWS_PRE + 2048);
  unsigned char* at = headers.data() + LWS_PRE;
  unsigned char* const begin = at;
  unsigned char* const end = headers.data() + headers.size() - 1;
  const bool packed = !file.gzip.empty() && AcceptsGzip(HeaderOf(wsi, WSI_TOKEN_HTTP_ACCEPT_ENCODING));
  const bool known = HasTag(HeaderOf(wsi, WSI_TOKEN_HTTP_IF_NONE_MATCH), file.tag);
  const std::string& body = packed ? file.gzip : file.plain;
  const unsigned status = known ? HTTP_STATUS_NOT_MODIFIED : HTTP_STATUS_OK;
  if (lws_add_http_common_headers(wsi, status, file.type, known ? 0 : body.size(), &at, end) != 0 ||
      !AddHeader(wsi, WSI_TOKEN_HTTP_CACHE_CONTROL, "no-cache", &at, end) ||
      !AddHeader(wsi, WSI_TOKEN_HTTP_ETAG, absl::StrCat("W/\"", file.tag, "\""), &at, end) ||
      !AddHeader(wsi, WSI_TOKEN_HTTP_VARY, "Accept-Encoding", &at, end) ||
      (packed && !known && !AddHeader(wsi, WSI_TOKEN_HTTP_CONTENT_ENCODING, "gzip", &at, end)) ||
      lws_finalize_write_http_header(wsi, begin, &at, end) != 0) {
    return 1;
  }
  if (known || !with_body || body.empty()) return lws_http_transaction_completed(wsi) != 0 ? -1 : 0;
  download = {.bytes = &body};
  lws_callback_on_writable(wsi);
  return 0;
}

// No more at once than the socket takes, so that a browser that reads slowly costs no memory.
int WebServer::Impl::SendMore(lws* wsi, Download& download) {
  Impl& me = Of(wsi);
  const std::size_t size = std::min(kPagePiece_bytes, download.bytes->size() - download.sent);
  const auto from = download.bytes->begin() + static_cast<std::ptrdiff_t>(download.sent);
  me.out.resize(LWS_PRE + size);
  std::copy(from, from + static_cast<std::ptrdiff_t>(size), me.out.begin() + LWS_PRE);
  download.sent += size;
  const bool last = download.sent == download.bytes->size();
  if (lws_write(wsi, me.out.data() + LWS_PRE, size, last ? LWS_WRITE_HTTP_FINAL : LWS_WRITE_HTTP) < 0) return -1;
  if (!last) {
    lws_set_timeout(wsi, PENDING_TIMEOUT_HTTP_CONTENT, kRequestTimeout_s);
    lws_callback_on_writable(wsi);
    return 0;
  }
  me.asked_visuals.erase(download.visual);
  download = {};
  return lws_http_transaction_completed(wsi) != 0 ? -1 : 0;
}

int WebServer::Impl::Answer(lws* wsi, Download& download) {
  if (lws_hdr_total_length(wsi, WSI_TOKEN_POST_URI) > 0) return Post(wsi, download);
  const bool with_body = lws_hdr_total_length(wsi, WSI_TOKEN_HEAD_URI) <= 0;
  const std::string path = HeaderOf(wsi, with_body ? WSI_TOKEN_GET_URI : WSI_TOKEN_HEAD_URI);
  if (const PageFile* file = page.Find(path)) return SendPage(wsi, *file, with_body, download);
  absl::string_view sha256 = path;
  if (absl::ConsumePrefix(&sha256, kVisualPath) && absl::ConsumeSuffix(&sha256, kVisualEnding) &&
      IsSha256Hex(std::string(sha256))) {
    return AskVisual(wsi, sha256, with_body, download);
  }
  if (path == "/healthz") return Reply(wsi, HTTP_STATUS_OK, kPlainText, "ok\n");
  if (path == "/api/worlds") {
    const WorldList::List list = gateway == nullptr ? WorldList::List() : gateway->Worlds();
    return Reply(wsi, HTTP_STATUS_OK, kJson, WorldsPage(list.instances, list.problem));
  }
  if (path == "/api/recordings") {
    const auto list = gateway == nullptr ? std::vector<ListedRecording>() : gateway->Recordings();
    return Reply(wsi, HTTP_STATUS_OK, kJson, RecordingsPage(list));
  }
  const std::string why = path == "/" ? "The page is not built or not installed; --page names its folder.\n"
                                      : "There is nothing at this address.\n";
  return Reply(wsi, HTTP_STATUS_NOT_FOUND, kPlainText, why);
}

int WebServer::Impl::OnHttp(lws* wsi, lws_callback_reasons reason, void* user, void* in, size_t len) {
  switch (reason) {
    case LWS_CALLBACK_FILTER_NETWORK_CONNECTION: {
      Impl& me = Of(wsi);
      if (me.connections < me.options.max_connections) return 0;
      me.metrics.refused_full.Increment();
      return 1;
    }
    case LWS_CALLBACK_WSI_CREATE:
    case LWS_CALLBACK_WSI_DESTROY: {
      Impl& me = Of(wsi);
      me.connections += reason == LWS_CALLBACK_WSI_CREATE ? 1 : static_cast<std::size_t>(-1);
      me.metrics.connections.Set(static_cast<double>(me.connections));
      return 0;
    }
    case LWS_CALLBACK_FILTER_HTTP_CONNECTION: {
      Impl& me = Of(wsi);
      if (me.MayConnect(wsi)) return 0;
      me.metrics.refused_origin.Increment();
      lws_return_http_status(wsi, HTTP_STATUS_FORBIDDEN, "This gateway is not known by that name; see --allow-origin.");
      return -1;
    }
    case LWS_CALLBACK_HTTP: {
      auto& download = *static_cast<Download*>(user);
      download = {};
      return Of(wsi).Answer(wsi, download);
    }
    case LWS_CALLBACK_HTTP_WRITEABLE: {
      auto* const download = static_cast<Download*>(user);
      if (download != nullptr && download->order != 0) return Of(wsi).AnswerPost(wsi, *download);
      if (download != nullptr && download->visual != 0 && download->bytes == nullptr) {
        return Of(wsi).AnswerVisual(wsi, *download);
      }
      if (download == nullptr || download->bytes == nullptr) break;
      return SendMore(wsi, *download);
    }
    // An order says all in its headers; it is answered when it is done.
    case LWS_CALLBACK_HTTP_BODY:
    case LWS_CALLBACK_HTTP_BODY_COMPLETION:
      return 0;
    case LWS_CALLBACK_CLOSED_HTTP:
      if (user != nullptr) {
        Of(wsi).posted.erase(static_cast<Download*>(user)->order);
        Of(wsi).asked_visuals.erase(static_cast<Download*>(user)->visual);
      }
      break;
    case LWS_CALLBACK_EVENT_WAIT_CANCELLED:
      Of(wsi).Tick();
      return 0;
    default:
      break;
  }
  return lws_callback_http_dummy(wsi, reason, user, in, len);
}

// --- Viewers ---------------------------------------------------------------------------------------------------------

int WebServer::Impl::FilterViewer(lws* wsi) {
  const std::string path = HeaderOf(wsi, WSI_TOKEN_GET_URI);
  if (!MayConnect(wsi)) {
    metrics.refused_origin.Increment();
    lws_return_http_status(wsi, HTTP_STATUS_FORBIDDEN, "This page may not connect here; see --allow-origin.");
    return -1;
  }
  absl::string_view name = path;
  const bool there = (absl::ConsumePrefix(&name, kWatchPath) && IsName(name, kMaxInstanceName)) ||
                     (absl::ConsumePrefix(&name, kPlayPath) && IsName(name, kMaxRecordingName));
  if (gateway != nullptr && there) return 0;
  lws_return_http_status(wsi, HTTP_STATUS_NOT_FOUND, "Viewers connect to /watch/INSTANCE or /play/RECORDING.");
  return -1;
}

void WebServer::Impl::Open(lws* wsi, Peer& peer) {
  const int socket = lws_get_socket_fd(wsi);
  const int unsent = kUnsent_bytes, buffer = kSendBuffer_bytes, at_once = 1;
  setsockopt(socket, IPPROTO_TCP, TCP_NOTSENT_LOWAT, &unsent, sizeof unsent);
  setsockopt(socket, SOL_SOCKET, SO_SNDBUF, &buffer, sizeof buffer);
  setsockopt(socket, IPPROTO_TCP, TCP_NODELAY, &at_once, sizeof at_once);
  peer.wsi = wsi;
  const std::string path = HeaderOf(wsi, WSI_TOKEN_GET_URI);
  absl::string_view name = path;
  const bool watches = absl::ConsumePrefix(&name, kWatchPath);
  if (!watches) absl::ConsumePrefix(&name, kPlayPath);
  peer.viewer = watches ? gateway->Open(std::string(name)) : gateway->OpenRecording(std::string(name));
  peers[peer.viewer] = &peer;
  Tick();
}

void WebServer::Impl::Receive(lws* wsi, Peer& peer, std::string_view bytes) {
  const auto now = std::chrono::steady_clock::now();
  if (lws_is_first_fragment(wsi) != 0) {
    peer.text.clear();
    peer.too_long = false;
  }
  if (peer.text.size() + bytes.size() > kMaxViewerMessage_bytes) {
    peer.too_long = true;
    peer.text.clear();
  } else if (!peer.too_long) {
    peer.text.append(bytes);
  }
  if (lws_is_final_fragment(wsi) == 0 || lws_remaining_packet_payload(wsi) != 0) return;
  if (peer.too_long) {
    gateway->ReceiveBad(peer.viewer, absl::StrCat("message: longer than ", kMaxViewerMessage_bytes, " bytes"), now);
  } else if (lws_frame_is_binary(wsi) != 0) {
    gateway->ReceiveBad(peer.viewer, "message: is binary; viewers send texts", now);
  } else {
    gateway->Receive(peer.viewer, peer.text, now);
  }
  peer.text.clear();
  if (gateway->Due(peer.viewer, now)) lws_callback_on_writable(wsi);
}

int WebServer::Impl::Write(lws* wsi, Peer& peer) {
  const auto now = std::chrono::steady_clock::now();
  peer.asked_to_write = false;
  if (const auto message = gateway->Next(peer.viewer, now)) {
    out.resize(LWS_PRE + message->bytes.size());
    std::copy(message->bytes.begin(), message->bytes.end(), out.begin() + LWS_PRE);
    const lws_write_protocol kind = message->binary ? LWS_WRITE_BINARY : LWS_WRITE_TEXT;
    if (lws_write(wsi, out.data() + LWS_PRE, message->bytes.size(), kind) < 0) return -1;
    // Large levels come rarely.
    if (out.capacity() > 4 * kMaxSceneMessage_bytes) std::vector<unsigned char>().swap(out);
    if (gateway->Due(peer.viewer, now) || gateway->Over(peer.viewer)) lws_callback_on_writable(wsi);
    return 0;
  }
  if (const auto code = gateway->Over(peer.viewer)) {
    std::string reason = *code;
    lws_close_reason(wsi, static_cast<lws_close_status>(kCloseStatus), reinterpret_cast<unsigned char*>(reason.data()),
                     reason.size());
    return -1;
  }
  return 0;
}

int WebServer::Impl::OnViewer(lws* wsi, lws_callback_reasons reason, void* user, void* in, size_t len) {
  // Null for a connection that was refused: it is closed without having been established.
  Peer* const peer = user == nullptr ? nullptr : *static_cast<Peer**>(user);
  Impl& me = Of(wsi);
  switch (reason) {
    case LWS_CALLBACK_FILTER_PROTOCOL_CONNECTION:
      return me.FilterViewer(wsi);
    case LWS_CALLBACK_ESTABLISHED: {
      auto* const opened = new Peer;
      *static_cast<Peer**>(user) = opened;
      me.Open(wsi, *opened);
      return 0;
    }
    case LWS_CALLBACK_RECEIVE:
      if (peer == nullptr) return -1;
      me.Receive(wsi, *peer, {static_cast<const char*>(in), len});
      return 0;
    case LWS_CALLBACK_SERVER_WRITEABLE:
      return peer == nullptr ? -1 : me.Write(wsi, *peer);
    case LWS_CALLBACK_CLOSED:
      if (peer == nullptr) return 0;
      *static_cast<Peer**>(user) = nullptr;
      me.peers.erase(peer->viewer);
      me.gateway->Close(peer->viewer);
      delete peer;
      return 0;
    default:
      return 0;
  }
}

// --- The loop --------------------------------------------------------------------------------------------------------

void WebServer::Impl::Tick() {
  visuals.Finish();
  if (gateway == nullptr) return;
  for (const ViewerId viewer : gateway->Tick(std::chrono::steady_clock::now())) {
    const auto peer = peers.find(viewer);
    if (peer == peers.end()) continue;
    if (std::exchange(peer->second->asked_to_write, true)) {
      metrics.late_frames.Increment();
    } else {
      lws_callback_on_writable(peer->second->wsi);
    }
  }
}

void WebServer::Impl::OnTick(lws_sorted_usec_list_t* list) {
  Impl& me = *lws_container_of(list, Timer, list)->owner;
  me.Tick();
  const bool idle = me.gateway == nullptr || me.gateway->idle();
  lws_sul_schedule(me.context, 0, list, OnTick, idle ? kIdle_us : kFrame_us);
}

absl::StatusOr<std::unique_ptr<WebServer>> WebServer::Start(const WebOptions& options, GatewayMetrics& metrics) {
  if (absl::Status status = host::CheckBindable(options.listen, "page"); !status.ok()) return status;
  auto impl = std::make_unique<Impl>(options, metrics);
  Impl& me = *impl;
  if (!options.page.empty()) {
    auto page = PageFiles::Read(options.page);
    if (!page.ok()) return page.status();
    me.page = *std::move(page);
  }
  lws_set_log_level(LLL_ERR | LLL_WARN, LogLine);
  me.protocols[0] = {"http", Impl::OnHttp, sizeof(Impl::Download), kMaxViewerMessage_bytes, 0, nullptr, kWrite_bytes};
  me.protocols[1] = {kViewerSubprotocol, Impl::OnViewer, sizeof(Impl::Peer*), kMaxViewerMessage_bytes, 0, nullptr,
                     kWrite_bytes};
  me.mount.mountpoint = "/";
  me.mount.mountpoint_len = 1;
  me.mount.origin = "http";
  me.mount.origin_protocol = LWSMPRO_CALLBACK;
  me.patience.secs_since_valid_ping = kPingAfter_s;
  me.patience.secs_since_valid_hangup = kHangUpAfter_s;

  lws_context_creation_info info{};
  info.port = me.options.listen.port;
  info.iface = me.options.listen.host == "0.0.0.0" ? nullptr : me.options.listen.host.c_str();
  info.protocols = me.protocols.data();
  info.mounts = &me.mount;
  info.headers = CommonHeaders();
  info.user = impl.get();
  info.gid = static_cast<gid_t>(-1);
  info.uid = static_cast<uid_t>(-1);
  info.timeout_secs = kRequestTimeout_s;
  info.retry_and_idle_policy = &me.patience;
  info.options = LWS_SERVER_OPTION_EXPLICIT_VHOSTS;
  if (me.options.listen.host.find(':') == std::string::npos) info.options |= LWS_SERVER_OPTION_DISABLE_IPV6;
  me.context = lws_create_context(&info);
  me.vhost = me.context == nullptr ? nullptr : lws_create_vhost(me.context, &info);
  std::unique_ptr<WebServer> server(new WebServer(std::move(impl)));
  if (me.vhost == nullptr) {
    return absl::UnavailableError(absl::StrCat("address ", host::ToString(options.listen), " cannot be served"));
  }
  me.timer.owner = &me;
  lws_sul_schedule(me.context, 0, &me.timer.list, Impl::OnTick, 1);
  return server;
}

WebServer::WebServer(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}

WebServer::~WebServer() { Stop(); }

void WebServer::Stop() {
  if (impl_->context == nullptr) return;
  {
    const std::lock_guard lock(impl_->waking);
    impl_->stopped = true;
  }
  lws_context_destroy(std::exchange(impl_->context, nullptr));
}

std::string WebServer::address() const {
  const auto port = static_cast<std::uint16_t>(lws_get_vhost_listen_port(impl_->vhost));
  return host::ToString({impl_->options.listen.host, port});
}

void WebServer::Serve(Gateway& gateway) { impl_->gateway = &gateway; }
void WebServer::Service() { lws_service(impl_->context, 0); }
void WebServer::Wake() { impl_->Wake(); }

}  // namespace tessera::gateway
