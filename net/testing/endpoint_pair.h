// EndpointPair: two endpoints on the loopback interface, for tests. Every wait is for an event, with a time limit.
#pragma once

#include <gtest/gtest.h>

#include <functional>
#include <memory>
#include <vector>

#include "net/endpoint.h"
#include "net/testing/test_identity.h"

namespace tessera::net {

using std::chrono::milliseconds;
using Clock = std::chrono::steady_clock;
inline constexpr milliseconds kPatience{20'000};

inline const SigningKey& TheKey() {
  static const SigningKey key = SigningKey::Make();
  return key;
}
inline EndpointIdentity TestIdentity() { return TestWorker(TheKey(), "plaza-1", RegionId(2), Incarnation(5)); }
inline Credentials TestCredentials(std::uint32_t player = 7) {
  return IssuePlayer("plaza-1", PlayerNumber(player), Generation(1), TheKey());
}

inline std::unique_ptr<Endpoint> Listen(EndpointOptions options = {}) {
  options.bind_address = "127.0.0.1";
  auto endpoint = Endpoint::Create(options);
  EXPECT_TRUE(endpoint.ok()) << endpoint.status();
  (*endpoint)->Open(TestIdentity());
  return *std::move(endpoint);
}

inline absl::StatusOr<PeerHandle> Dial(Endpoint& from, std::uint16_t port, std::uint32_t player = 7) {
  return from.Connect("127.0.0.1", port, RegionId(2), Incarnation(), TestCredentials(player));
}

// Two endpoints and all their events.
struct EndpointPair {
  explicit EndpointPair(EndpointOptions server_options = {}, EndpointOptions client_options = {})
      : server(Listen(server_options)), client(Listen(client_options)) {}

  void ServiceOnce() {
    for (Event& event : server->Service(milliseconds(0))) at_server.push_back(std::move(event));
    for (Event& event : client->Service(milliseconds(1))) at_client.push_back(std::move(event));
  }
  bool Until(const std::function<bool()>& done) {
    for (const auto limit = Clock::now() + kPatience; Clock::now() < limit;) {
      if (done()) return true;
      ServiceOnce();
    }
    return done();
  }
  bool ConnectBoth() {
    auto peer = Dial(*client, server->port());
    if (!peer.ok() || !Until([&] { return at_client.size() == 1 && at_server.size() == 1; })) return false;
    to_server = *peer;
    to_client = at_server[0].peer;
    const bool connected = at_client[0].kind == Event::Kind::kConnected && at_client[0].peer == to_server &&
                           at_client[0].outgoing && at_server[0].kind == Event::Kind::kConnected &&
                           !at_server[0].outgoing && at_server[0].who.player == PlayerNumber(7);
    at_client.clear();
    at_server.clear();
    return connected;
  }

  std::unique_ptr<Endpoint> server, client;
  std::vector<Event> at_server, at_client;
  PeerHandle to_server, to_client;
};

inline Bytes Pattern(std::size_t size, unsigned seed) {
  Bytes bytes(size);
  for (std::size_t i = 0; i < size; ++i) bytes[i] = static_cast<std::uint8_t>(i * 31 + (i >> 8) * 7 + seed);
  return bytes;
}

}  // namespace tessera::net
