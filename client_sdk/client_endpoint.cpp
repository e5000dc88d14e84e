#include "client_sdk/client_endpoint.h"

namespace tessera::client {

void ClientEndpoint::Simulate(const NetworkConditions& conditions) {
  conditions_ = conditions;
  in_.Seed(conditions.seed);
  out_.Seed(conditions.seed ^ 0x9e3779b97f4a7c15u);  // else both directions lose the same
}

absl::StatusOr<net::PeerHandle> ClientEndpoint::Connect(const std::string& host, std::uint16_t port, RegionId region,
                                                        Incarnation least, const net::Credentials& credentials) {
  if (endpoint_ == nullptr) return absl::UnavailableError("a replay has no connections");
  return endpoint_->Connect(host, port, region, least, credentials);
}

void ClientEndpoint::Disconnect(net::PeerHandle peer) {
  if (endpoint_ != nullptr) endpoint_->Disconnect(peer);
}

net::PeerStats ClientEndpoint::StatsOf(net::PeerHandle peer) const {
  if (endpoint_ == nullptr) return {};
  net::PeerStats stats = endpoint_->StatsOf(peer);
  // The simulator stands above the connections, which do not notice it: a mean datagram is half the jitter late.
  stats.round_trip += 2 * conditions_.delay + conditions_.jitter;
  return stats;
}

void ClientEndpoint::Flush() {
  if (endpoint_ != nullptr) endpoint_->Flush();
}

bool ClientEndpoint::Send(TimePoint now, net::PeerHandle peer, net::Bytes bytes) {
  if (endpoint_ == nullptr) return false;
  if (conditions_.perfect()) return endpoint_->Send(peer, net::Delivery::kUnsequenced, bytes).ok();
  out_.Put(now, {peer, std::move(bytes)}, conditions_);
  return true;
}

std::vector<net::Event> ClientEndpoint::Service(TimePoint now) {
  if (endpoint_ == nullptr) return {};
  for (const Delayed& due : out_.Take(now)) {
    (void)endpoint_->Send(due.peer, net::Delivery::kUnsequenced, due.bytes);  // gone by now: nobody to send to
  }
  std::vector<net::Event> events = endpoint_->Service(std::chrono::milliseconds(0));
  if (conditions_.perfect() && in_.empty()) return events;
  for (net::Event& event : events) {
    if (event.kind == net::Event::Kind::kMessage && event.delivery == net::Delivery::kUnsequenced) {
      in_.Put(now, std::move(event), conditions_);
    } else {
      const std::uint64_t lane = event.peer.value();
      in_.PutReliable(now, lane, std::move(event), conditions_);
    }
  }
  return in_.Take(now);
}

}  // namespace tessera::client
