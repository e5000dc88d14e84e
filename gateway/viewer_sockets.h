// ViewerSockets: the WebSockets of viewers, /watch/INSTANCE and /play/RECORDING, between libwebsockets and the gateway.
//
// The kernel is kept from taking more than a little ahead, so a viewer that reads slowly gets new frames, and costs no
// memory.
//
// Thread rule: the event loop's. What calls return is what the callback of libwebsockets returns: other than 0 ends the
// connection.
#pragma once

#include <libwebsockets.h>

#include <chrono>
#include <cstddef>
#include <map>
#include <string_view>
#include <vector>

#include "gateway/gateway.h"
#include "gateway/gateway_metrics.h"
#include "gateway/message_parts.h"
#include "gateway/viewer_format.h"

namespace tessera::gateway {

class ViewerSockets {
 public:
  explicit ViewerSockets(GatewayMetrics& metrics) : metrics_(metrics) {}

  // From now on there may be viewers, which are the gateway's. It outlives this.
  void Serve(Gateway& gateway) { gateway_ = &gateway; }

  // Lets the request in if its address is one that viewers connect to; others are answered 404.
  int Admit(lws* wsi);
  int Open(lws* wsi);
  int Receive(lws* wsi, std::string_view bytes);
  int Write(lws* wsi);
  void Close(lws* wsi);

  // Carries all worlds on, and asks the sockets whose viewers have something to be sent for room.
  void Tick();
  // Nobody watches, and nothing is recorded.
  bool idle() const { return gateway_ == nullptr || gateway_->idle(); }
  std::size_t size() const { return peers_.size(); }

 private:
  struct Peer {
    ViewerId viewer = 0;
    MessageParts parts{kMaxViewerMessage_bytes};
    bool asked_to_write = false;
  };

  GatewayMetrics& metrics_;
  Gateway* gateway_ = nullptr;
  std::map<lws*, Peer> peers_;
  std::map<ViewerId, lws*> sockets_;
  std::vector<unsigned char> out_;
};

}  // namespace tessera::gateway
