// Over real sockets on the loopback interface.
#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <map>
#include <set>

#include "net/endpoint.h"
#include "net/testing/endpoint_pair.h"
#include "net/testing/spoofed_flood.h"

namespace tessera::net {
namespace {

TEST(EndpointAcceptorTest, WhoIsRefusedHearsWhy) {
  EndpointPair pair;
  ASSERT_TRUE(
      pair.client->Connect("127.0.0.1", pair.server->port(), RegionId(9), Incarnation(), TestCredentials()).ok());
  ASSERT_TRUE(pair.Until([&] { return !pair.at_client.empty(); }));
  EXPECT_EQ(pair.at_client[0].kind, Event::Kind::kDisconnected);
  EXPECT_TRUE(pair.at_client[0].outgoing);
  ASSERT_TRUE(pair.at_client[0].refusal.has_value());
  EXPECT_EQ(pair.at_client[0].refusal->reason, Refused::kWrongRegion);
  EXPECT_EQ(pair.at_client[0].refusal->detail, "this is region 2, not 9");
  EXPECT_TRUE(pair.at_server.empty());
  EXPECT_EQ(pair.server->connections(), 0u);
}

TEST(EndpointAcceptorTest, AFullPortSaysSo) {
  EndpointPair pair({.max_peers = 1});
  ASSERT_TRUE(pair.ConnectBoth());
  ASSERT_TRUE(Dial(*pair.client, pair.server->port()).ok());
  ASSERT_TRUE(pair.Until([&] { return !pair.at_client.empty(); }));
  ASSERT_TRUE(pair.at_client[0].refusal.has_value());
  EXPECT_EQ(pair.at_client[0].refusal->reason, Refused::kFull);
}

TEST(EndpointAcceptorTest, AClosedPortRefusesNewcomersAndKeepsItsPeers) {
  EndpointPair pair;
  ASSERT_TRUE(pair.ConnectBoth());
  pair.server->Close("the instance ends");
  ASSERT_TRUE(Dial(*pair.client, pair.server->port()).ok());
  ASSERT_TRUE(pair.Until([&] { return !pair.at_client.empty(); }));
  ASSERT_TRUE(pair.at_client[0].refusal.has_value());
  EXPECT_EQ(pair.at_client[0].refusal->reason, Refused::kStopping);
  ASSERT_TRUE(pair.client->Send(pair.to_server, Delivery::kReliable, Pattern(10, 1)).ok());
  EXPECT_TRUE(pair.Until([&] { return !pair.at_server.empty(); }));
}

TEST(EndpointAcceptorTest, WhoDialsBeforeThePortIsOpenComesInOnceItIs) {
  auto server = *Endpoint::Create({.bind_address = "127.0.0.1"});
  const auto client = Listen();
  ASSERT_TRUE(Dial(*client, server->port()).ok());
  for (int i = 0; i < 20; ++i) {
    EXPECT_TRUE(server->Service(milliseconds(1)).empty());
    EXPECT_TRUE(client->Service(milliseconds(1)).empty());
  }
  server->Open(TestIdentity());
  std::vector<Event> events;
  const auto limit = Clock::now() + kPatience;
  while (events.empty() && Clock::now() < limit) {
    server->Service(milliseconds(1));
    events = client->Service(milliseconds(1));
  }
  ASSERT_EQ(events.size(), 1u);
  EXPECT_EQ(events[0].kind, Event::Kind::kConnected);
}

// Two endpoints that dial each other use the same socket for both ways, as regions do.
TEST(EndpointAcceptorTest, BothSidesMayDial) {
  EndpointPair pair;
  ASSERT_TRUE(pair.ConnectBoth());
  const auto back = Dial(*pair.server, pair.client->port());
  ASSERT_TRUE(back.ok());
  ASSERT_TRUE(pair.Until([&] { return pair.at_client.size() == 1 && pair.at_server.size() == 1; }));
  EXPECT_TRUE(pair.at_server[0].outgoing);
  EXPECT_FALSE(pair.at_client[0].outgoing);
  ASSERT_TRUE(pair.server->Send(*back, Delivery::kReliable, Pattern(10, 1)).ok());
  ASSERT_TRUE(pair.client->Send(pair.to_server, Delivery::kReliable, Pattern(20, 1)).ok());
  EXPECT_TRUE(pair.Until([&] { return pair.at_client.size() == 2 && pair.at_server.size() == 2; }));
}

// 64 of these datagrams took all places of bare ENet for half a minute.
TEST(EndpointAcceptorTest, BlindConnectsLeaveNoTraceAndDrawNothing) {
  EndpointPair pair({.max_peers = 4});
  SpoofedFlood flood(64);
  for (std::uint32_t i = 0; i < 2000; ++i) {
    flood.Send(pair.server->port(), BlindConnect(i + 1));
    if (i % 50 == 0) pair.ServiceOnce();
  }
  EXPECT_EQ(pair.server->connections(), 0u);
  EXPECT_TRUE(pair.ConnectBoth());
  flood.Drain();
  EXPECT_EQ(flood.bytes_received(), 0u);
  EXPECT_GT(flood.bytes_sent(), 0u);
}

TEST(EndpointAcceptorTest, BlindHellosDrawLessThanTheySend) {
  EndpointPair pair({.max_peers = 4});
  SpoofedFlood flood(64);
  for (std::uint32_t i = 0; i < 2000; ++i) {
    flood.Send(pair.server->port(), BlindHello(i + 1));
    if (i % 50 == 0) pair.ServiceOnce();
  }
  EXPECT_TRUE(pair.ConnectBoth());
  flood.Drain();
  EXPECT_GT(flood.bytes_received(), 0u);
  EXPECT_LT(flood.bytes_received(), flood.bytes_sent());
}

// A socket between two endpoints that keeps the datagrams it forwards.
class RawSocket {
 public:
  explicit RawSocket(std::uint16_t server) : server_(server), fd_(socket(AF_INET, SOCK_DGRAM | SOCK_NONBLOCK, 0)) {
    sockaddr_in any{};
    any.sin_family = AF_INET;
    any.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    EXPECT_EQ(bind(fd_, reinterpret_cast<const sockaddr*>(&any), sizeof any), 0);
    socklen_t size = sizeof any;
    getsockname(fd_, reinterpret_cast<sockaddr*>(&any), &size);
    port = ntohs(any.sin_port);
  }
  ~RawSocket() { close(fd_); }

  void Carry() {
    Bytes bytes(2048);
    sockaddr_in from{};
    socklen_t size = sizeof from;
    for (ssize_t got = 0;
         (got = recvfrom(fd_, bytes.data(), bytes.size(), 0, reinterpret_cast<sockaddr*>(&from), &size)) >= 0;) {
      const bool up = ntohs(from.sin_port) != server_;
      if (up) client_ = ntohs(from.sin_port);
      passed.emplace_back(bytes.begin(), bytes.begin() + got);
      largest = std::max(largest, static_cast<std::size_t>(got));
      if (up) ups.push_back(passed.back());
      SendTo(up ? server_ : client_, passed.back());
    }
  }
  void SendToServer(const Bytes& bytes) { SendTo(server_, bytes); }

  std::uint16_t port = 0;
  std::size_t largest = 0;
  std::vector<Bytes> passed, ups;

 private:
  void SendTo(std::uint16_t port_to, const Bytes& bytes) const {
    sockaddr_in to{};
    to.sin_family = AF_INET;
    to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    to.sin_port = htons(port_to);
    (void)sendto(fd_, bytes.data(), bytes.size(), 0, reinterpret_cast<const sockaddr*>(&to), sizeof to);
  }
  std::uint16_t server_, client_ = 0;
  int fd_;
};

TEST(EndpointAcceptorTest, WhatIsOnTheWireIsSecretWholeAndTakenOnce) {
  EndpointPair pair;
  RawSocket wire(pair.server->port());
  const auto until = [&](const auto& done) {
    return pair.Until([&] {
      wire.Carry();
      return done();
    });
  };
  const auto to_server = Dial(*pair.client, wire.port);
  ASSERT_TRUE(to_server.ok());
  ASSERT_TRUE(until([&] { return pair.at_client.size() == 1 && pair.at_server.size() == 1; }));
  const std::string word = "nobody else may read this";
  const Bytes secret(word.begin(), word.end());
  Bytes large;
  while (large.size() < 20'000) large.insert(large.end(), secret.begin(), secret.end());
  ASSERT_TRUE(pair.client->Send(*to_server, Delivery::kReliable, large).ok());
  ASSERT_TRUE(pair.client->Send(*to_server, Delivery::kUnsequenced, secret).ok());
  ASSERT_TRUE(pair.client->Send(*to_server, Delivery::kUnsequenced, Pattern(kMaxDatagramBytes, 1)).ok());
  ASSERT_TRUE(until([&] { return pair.at_server.size() == 4; }));
  EXPECT_LE(wire.largest, kMaxUdpBytes);
  for (const Bytes& bytes : wire.passed) {
    EXPECT_EQ(std::search(bytes.begin(), bytes.end(), secret.begin(), secret.end()), bytes.end());
  }
  // All of it once more, whole, cut and damaged: nothing, not even the disconnection, is taken but from its sender.
  const std::vector<Bytes> ups = wire.ups;
  const std::size_t events = pair.at_server.size();
  for (std::size_t i = 0; i < ups.size(); ++i) {
    Bytes bytes = ups[i];
    wire.SendToServer(bytes);
    bytes[i % bytes.size()] ^= 1;
    wire.SendToServer(bytes);
    bytes.resize(bytes.size() / 2);
    wire.SendToServer(bytes);
  }
  ASSERT_TRUE(pair.client->Send(*to_server, Delivery::kReliable, secret).ok());
  ASSERT_TRUE(until([&] { return pair.at_server.size() > events; }));
  EXPECT_EQ(pair.at_server.size(), events + 1);
  EXPECT_EQ(pair.at_server.back().bytes, secret);
  EXPECT_GT(pair.server->acceptor_stats().replayed, 0u);
}

// A holder of a token may stop half way; ENet alone would keep its place for half a minute.
TEST(EndpointAcceptorTest, OneThatNeverFinishesDoesNotKeepItsPlace) {
  const auto server = Listen({.max_peers = 1});
  const int fd = socket(AF_INET, SOCK_DGRAM | SOCK_NONBLOCK, 0);
  sockaddr_in to{};
  to.sin_family = AF_INET;
  to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  to.sin_port = htons(server->port());
  const auto send = [&](std::span<const std::uint8_t> bytes) {
    (void)sendto(fd, bytes.data(), bytes.size(), 0, reinterpret_cast<const sockaddr*>(&to), sizeof to);
  };
  Acceptor acceptor({.max_sessions = 1});
  const Address address{.host = to.sin_addr.s_addr, .port = server->port()};
  const SessionNumber dial = *acceptor.Dial(Clock::now(), address, RegionId(2), Incarnation(), TestCredentials());
  const auto limit = Clock::now() + kPatience;
  while (!acceptor.IsOpen(dial) && Clock::now() < limit) {
    for (const Acceptor::Outgoing& out : acceptor.Due(Clock::now())) send(out.bytes);
    server->Service(milliseconds(1));
    Bytes bytes(2048);
    const ssize_t got = recv(fd, bytes.data(), bytes.size(), 0);
    if (got < 0) continue;
    const auto received =
        acceptor.Receive(Clock::now(), address, std::span(bytes).first(static_cast<std::size_t>(got)));
    if (received.kind == Acceptor::Received::Kind::kReply) send(received.bytes);
  }
  ASSERT_TRUE(acceptor.IsOpen(dial));
  Bytes connect = BlindConnect(1);
  connect.erase(connect.begin() + 4, connect.begin() + 8);  // the checksum field is left out
  const std::size_t payload = connect.size();
  connect.insert(connect.begin(), kSealHeaderBytes, 0);
  connect.resize(connect.size() + kSealTagBytes);
  acceptor.Seal(dial, DatagramKind::kSealed, connect, payload);
  send(connect);
  while (server->connections() == 0 && Clock::now() < limit) server->Service(milliseconds(1));
  ASSERT_EQ(server->connections(), 1u);
  while (server->connections() > 0 && Clock::now() < limit) EXPECT_TRUE(server->Service(milliseconds(10)).empty());
  EXPECT_EQ(server->connections(), 0u);
  close(fd);
}

}  // namespace
}  // namespace tessera::net
