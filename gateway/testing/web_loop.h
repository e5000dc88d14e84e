// WebLoop: a web server that runs in a thread of its own, with or without a gateway, for tests that talk to its port.
//
//   WebLoop loop({.listen = {"127.0.0.1", 0}, .page = folder});
//   RequestPage(loop.address(), "/")
//
// Thread rule: one thread makes and destroys it.
#pragma once

#include <atomic>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <thread>

#include "gateway/gateway.h"
#include "gateway/gateway_metrics.h"
#include "gateway/instance_feed.h"
#include "gateway/web_server.h"

namespace tessera::gateway {

class WebLoop {
 public:
  // With options a gateway serves viewers, at a control plane that may not be there.
  explicit WebLoop(const WebOptions& web, const std::optional<GatewayOptions>& options = std::nullopt) {
    auto server = WebServer::Start(web, metrics);
    if (!server.ok()) throw std::runtime_error(std::string(server.status().message()));
    server_ = *std::move(server);
    address_ = server_->address();
    if (options) {
      const auto channel = DialControl(options->control);
      if (!channel.ok()) throw std::runtime_error(std::string(channel.status().message()));
      gateway_ = std::make_unique<Gateway>(*options, *channel, metrics, [this] { server_->Wake(); });
      server_->Serve(*gateway_);
    }
    thread_ = std::thread([this] {
      while (!stopped_) server_->Service();
    });
  }
  ~WebLoop() {
    stopped_ = true;
    server_->Wake();
    thread_.join();
    server_->Stop();
    gateway_.reset();  // its threads wake the server
  }
  WebLoop(const WebLoop&) = delete;
  WebLoop& operator=(const WebLoop&) = delete;

  const std::string& address() const { return address_; }

  GatewayMetrics metrics;

 private:
  std::unique_ptr<WebServer> server_;
  std::unique_ptr<Gateway> gateway_;
  std::string address_;
  std::atomic<bool> stopped_ = false;
  std::thread thread_;
};

}  // namespace tessera::gateway
