// Wire: a client's connections, as good or as bad as they are asked to be.
//
// A sealed endpoint, with the network simulator between it and the client: what is simulated happens to what the client
// sends and gets, the connections below live on. Without an endpoint (a replay) it is silent.
//
// Thread rule: one thread at a time; time comes in.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "client_sdk/delay_line.h"
#include "client_sdk/network_conditions.h"
#include "net/endpoint.h"

namespace tessera::client {

class Wire {
 public:
  using TimePoint = std::chrono::steady_clock::time_point;

  explicit Wire(std::unique_ptr<net::Endpoint> endpoint) : endpoint_(std::move(endpoint)) {}

  void Simulate(const NetworkConditions& conditions);

  // As net::Endpoint.
  absl::StatusOr<net::PeerHandle> Connect(const std::string& host, std::uint16_t port, RegionId region,
                                          const net::Credentials& credentials);
  void Disconnect(net::PeerHandle peer);
  net::PeerStats StatsOf(net::PeerHandle peer) const;
  void Flush();

  // Unsequenced. False: there is no such peer any more.
  bool Send(TimePoint now, net::PeerHandle peer, net::Bytes bytes);
  // What has come by now, and sends what the simulator held back.
  std::vector<net::Event> Service(TimePoint now);

 private:
  struct Outgoing {
    net::PeerHandle peer;
    net::Bytes bytes;
  };

  std::unique_ptr<net::Endpoint> endpoint_;
  NetworkConditions conditions_;
  DelayLine<net::Event> in_;
  DelayLine<Outgoing> out_;
};

}  // namespace tessera::client
