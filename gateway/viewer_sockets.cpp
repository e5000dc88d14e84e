#include "gateway/viewer_sockets.h"

#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include "absl/strings/strip.h"
#include "gateway/http_site.h"
#include "gateway/web_request.h"

namespace tessera::gateway {
namespace {

constexpr int kUnsent_bytes = 16 * 1024, kSendBuffer_bytes = 256 * 1024;
constexpr std::size_t kMaxRecordingName = 128;
constexpr absl::string_view kWatchPath = "/watch/", kPlayPath = "/play/";

void PaceSocket(int socket) {
  const int unsent = kUnsent_bytes, buffer = kSendBuffer_bytes, at_once = 1;
  setsockopt(socket, IPPROTO_TCP, TCP_NOTSENT_LOWAT, &unsent, sizeof unsent);
  setsockopt(socket, SOL_SOCKET, SO_SNDBUF, &buffer, sizeof buffer);
  setsockopt(socket, IPPROTO_TCP, TCP_NODELAY, &at_once, sizeof at_once);
}

}  // namespace

int ViewerSockets::Admit(lws* wsi) {
  const std::string path = HeaderOf(wsi, WSI_TOKEN_GET_URI);
  absl::string_view name = path;
  const bool there = (absl::ConsumePrefix(&name, kWatchPath) && IsName(name, kMaxInstanceName)) ||
                     (absl::ConsumePrefix(&name, kPlayPath) && IsName(name, kMaxRecordingName));
  if (gateway_ != nullptr && there) return 0;
  lws_return_http_status(wsi, HTTP_STATUS_NOT_FOUND, "Viewers connect to /watch/INSTANCE or /play/RECORDING.");
  return -1;
}

int ViewerSockets::Open(lws* wsi) {
  if (gateway_ == nullptr) return -1;
  PaceSocket(lws_get_socket_fd(wsi));
  const std::string path = HeaderOf(wsi, WSI_TOKEN_GET_URI);
  absl::string_view name = path;
  const bool watches = absl::ConsumePrefix(&name, kWatchPath);
  if (!watches) absl::ConsumePrefix(&name, kPlayPath);
  Peer& peer = peers_[wsi];
  std::array<char, INET6_ADDRSTRLEN> address{};
  lws_get_peer_simple(lws_get_network_wsi(wsi), address.data(), address.size());
  peer.viewer =
      watches ? gateway_->Open(std::string(name), address.data()) : gateway_->OpenRecording(std::string(name));
  sockets_[peer.viewer] = wsi;
  Tick();
  return 0;
}

int ViewerSockets::Receive(lws* wsi, std::string_view bytes) {
  const auto found = peers_.find(wsi);
  if (found == peers_.end()) return -1;
  Peer& peer = found->second;
  const auto now = std::chrono::steady_clock::now();
  if (lws_is_first_fragment(wsi) != 0) peer.parts.Begin();
  peer.parts.Add(bytes);
  if (lws_is_final_fragment(wsi) == 0 || lws_remaining_packet_payload(wsi) != 0) return 0;
  if (peer.parts.too_long()) {
    gateway_->ReceiveBad(peer.viewer, absl::StrCat("message: longer than ", kMaxViewerMessage_bytes, " bytes"), now);
  } else if (lws_frame_is_binary(wsi) != 0) {
    gateway_->ReceiveBad(peer.viewer, "message: is binary; viewers send texts", now);
  } else {
    gateway_->Receive(peer.viewer, peer.parts.text(), now);
  }
  peer.parts.Begin();
  if (gateway_->Due(peer.viewer, now)) lws_callback_on_writable(wsi);
  return 0;
}

int ViewerSockets::Write(lws* wsi) {
  const auto found = peers_.find(wsi);
  if (found == peers_.end()) return -1;
  Peer& peer = found->second;
  const auto now = std::chrono::steady_clock::now();
  peer.asked_to_write = false;
  if (const auto message = gateway_->Next(peer.viewer, now)) {
    out_.resize(LWS_PRE + message->bytes.size());
    std::copy(message->bytes.begin(), message->bytes.end(), out_.begin() + LWS_PRE);
    const lws_write_protocol kind = message->binary ? LWS_WRITE_BINARY : LWS_WRITE_TEXT;
    if (lws_write(wsi, out_.data() + LWS_PRE, message->bytes.size(), kind) < 0) return -1;
    // Large levels come rarely.
    if (out_.capacity() > 4 * kMaxSceneMessage_bytes) std::vector<unsigned char>().swap(out_);
    if (gateway_->Due(peer.viewer, now) || gateway_->Over(peer.viewer)) lws_callback_on_writable(wsi);
    return 0;
  }
  if (const auto code = gateway_->Over(peer.viewer)) {
    std::string reason = *code;
    lws_close_reason(wsi, static_cast<lws_close_status>(kCloseStatus), reinterpret_cast<unsigned char*>(reason.data()),
                     reason.size());
    return -1;
  }
  return 0;
}

// A connection that was refused is closed without having been opened.
void ViewerSockets::Close(lws* wsi) {
  const auto found = peers_.find(wsi);
  if (found == peers_.end()) return;
  const ViewerId viewer = found->second.viewer;
  sockets_.erase(viewer);
  peers_.erase(found);
  gateway_->Close(viewer);
}

void ViewerSockets::Tick() {
  if (gateway_ == nullptr) return;
  for (const ViewerId viewer : gateway_->Tick(std::chrono::steady_clock::now())) {
    const auto socket = sockets_.find(viewer);
    if (socket == sockets_.end()) continue;
    if (std::exchange(peers_.at(socket->second).asked_to_write, true)) {
      metrics_.late_frames.Increment();
    } else {
      lws_callback_on_writable(socket->second);
    }
  }
}

}  // namespace tessera::gateway
