// ClientEndpoint: a client's sealed endpoint, with a network simulator on top of it.
//
// The simulator delays and drops messages of the client; the connections below it do not notice. Without an endpoint
// (in a replay) nothing is sent and nothing comes.
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

class ClientEndpoint {
 public:
  using TimePoint = std::chrono::steady_clock::time_point;

  explicit ClientEndpoint(std::unique_ptr<net::Endpoint> endpoint) : endpoint_(std::move(endpoint)) {}

  void Simulate(const NetworkConditions& conditions);

  // As net::Endpoint.
  absl::StatusOr<net::PeerHandle> Connect(const std::string& host, std::uint16_t port, RegionId region,
                                          Incarnation least, const net::Credentials& credentials);
  void Disconnect(net::PeerHandle peer);
  // With the round trip as the simulated network makes it.
  net::PeerStats StatsOf(net::PeerHandle peer) const;
  void Flush();

  // Unsequenced. False: there is no such peer any more.
  bool Send(TimePoint now, net::PeerHandle peer, net::Bytes bytes);
  // Gives the events that have come by now, and sends the datagrams that the simulator held back until now.
  std::vector<net::Event> Service(TimePoint now);

 private:
  struct Delayed {
    net::PeerHandle peer;
    net::Bytes bytes;
  };

  std::unique_ptr<net::Endpoint> endpoint_;
  NetworkConditions conditions_;
  DelayLine<net::Event> in_;
  DelayLine<Delayed> out_;
};

}  // namespace tessera::client
