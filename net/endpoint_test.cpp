// Over real sockets on the loopback interface; every wait is for an event, with a limit on how long that may take.
#include "net/endpoint.h"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include <functional>
#include <map>
#include <set>

#include "net/strangers.h"

namespace tessera::net {
namespace {

using std::chrono::milliseconds;
using Clock = std::chrono::steady_clock;
constexpr milliseconds kPatience{20'000};

const InstanceKey& TheKey() {
  static const InstanceKey key = MakeInstanceKey();
  return key;
}
Doorplate Plate() {
  return {.instance_id = "plaza-1", .region = RegionId(2), .incarnation = Incarnation(5), .key = TheKey()};
}
Credentials Pass(std::uint32_t player = 7) {
  return Issue({.instance_id = "plaza-1", .player = PlayerNumber(player), .expires_unix_s = ~std::uint64_t{0}},
               TheKey());
}

std::unique_ptr<Endpoint> Listen(EndpointOptions options = {}) {
  options.bind_address = "127.0.0.1";
  auto endpoint = Endpoint::Create(options);
  EXPECT_TRUE(endpoint.ok()) << endpoint.status();
  (*endpoint)->Open(Plate());
  return *std::move(endpoint);
}

absl::StatusOr<PeerHandle> Dial(Endpoint& from, std::uint16_t port) {
  return from.Connect("127.0.0.1", port, RegionId(2), Pass());
}

// Two endpoints and all that happened to them.
struct Pair {
  explicit Pair(EndpointOptions server_options = {}, EndpointOptions client_options = {})
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

Bytes Pattern(std::size_t size, unsigned seed) {
  Bytes bytes(size);
  for (std::size_t i = 0; i < size; ++i) bytes[i] = static_cast<std::uint8_t>(i * 31 + (i >> 8) * 7 + seed);
  return bytes;
}

TEST(EndpointTest, EchoesBothKinds) {
  Pair pair;
  ASSERT_TRUE(pair.ConnectBoth());
  const Bytes hello = Pattern(20, 1), poll = Pattern(100, 2);
  ASSERT_TRUE(pair.client->Send(pair.to_server, Delivery::kReliable, hello).ok());
  ASSERT_TRUE(pair.client->Send(pair.to_server, Delivery::kUnsequenced, poll).ok());
  ASSERT_TRUE(pair.Until([&] { return pair.at_server.size() == 2; }));
  for (const Event& event : pair.at_server) {
    EXPECT_EQ(event.kind, Event::Kind::kMessage);
    EXPECT_EQ(event.peer, pair.to_client);
    EXPECT_EQ(event.bytes, event.delivery == Delivery::kReliable ? hello : poll);
    ASSERT_TRUE(pair.server->Send(event.peer, event.delivery, event.bytes).ok());
  }
  ASSERT_TRUE(pair.Until([&] { return pair.at_client.size() == 2; }));
  EXPECT_NE(pair.at_client[0].delivery, pair.at_client[1].delivery);
  const PeerStats stats = pair.client->StatsOf(pair.to_server);
  EXPECT_EQ(stats.bytes_sent, 120u);
  EXPECT_EQ(stats.bytes_received, 120u);
  EXPECT_EQ(pair.client->AddressOf(pair.to_server), "127.0.0.1:" + std::to_string(pair.server->port()));
}

TEST(EndpointTest, LargeReliableMessagesArriveWholeAndInOrder) {
  Pair pair;
  ASSERT_TRUE(pair.ConnectBoth());
  const std::vector<std::size_t> sizes = {kMaxMessageBytes, 0, 1, 100'000, kMaxDatagramBytes + 1, 100'000};
  for (std::size_t i = 0; i < sizes.size(); ++i) {
    ASSERT_TRUE(pair.client->Send(pair.to_server, Delivery::kReliable, Pattern(sizes[i], unsigned(i))).ok());
  }
  ASSERT_TRUE(pair.Until([&] { return pair.at_server.size() == sizes.size(); }));
  for (std::size_t i = 0; i < sizes.size(); ++i) EXPECT_EQ(pair.at_server[i].bytes, Pattern(sizes[i], unsigned(i)));
}

TEST(EndpointTest, AFullDatagramStaysADatagram) {
  Pair pair;
  ASSERT_TRUE(pair.ConnectBoth());
  const Bytes full = Pattern(kMaxDatagramBytes, 3);
  ASSERT_TRUE(pair.server->Send(pair.to_client, Delivery::kUnsequenced, full).ok());
  ASSERT_TRUE(pair.Until([&] { return pair.at_client.size() == 1; }));
  EXPECT_EQ(pair.at_client[0].delivery, Delivery::kUnsequenced);  // fragments would come back as reliable
  EXPECT_EQ(pair.at_client[0].bytes, full);
}

TEST(EndpointTest, TooLongMessagesAreRefused) {
  Pair pair;
  ASSERT_TRUE(pair.ConnectBoth());
  const absl::Status datagram =
      pair.client->Send(pair.to_server, Delivery::kUnsequenced, Pattern(kMaxDatagramBytes + 1, 0));
  EXPECT_EQ(datagram.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(datagram.message(), "message of 1149 bytes; at most 1148");
  EXPECT_EQ(pair.client->Send(pair.to_server, Delivery::kReliable, Pattern(kMaxMessageBytes + 1, 0)).code(),
            absl::StatusCode::kInvalidArgument);
}

// ENet's throttle would drop some of these once the round trip varies.
TEST(EndpointTest, NoDatagramIsDroppedOnPurpose) {
  Pair pair;
  ASSERT_TRUE(pair.ConnectBoth());
  constexpr std::size_t kRounds = 400, kPerRound = 8;
  for (std::size_t round = 0; round < kRounds; ++round) {
    for (std::size_t i = 0; i < kPerRound; ++i) {
      ASSERT_TRUE(pair.server->Send(pair.to_client, Delivery::kUnsequenced, Pattern(1000, unsigned(i))).ok());
    }
    ASSERT_TRUE(pair.server->Send(pair.to_client, Delivery::kReliable, Pattern(3000, 1)).ok());
    const std::size_t expected = (round + 1) * (kPerRound + 1);
    ASSERT_TRUE(pair.Until([&] { return pair.at_client.size() == expected; })) << "round " << round;
  }
}

TEST(EndpointTest, DisconnectDeliversWhatIsQueuedAndIsHeardOnce) {
  Pair pair;
  ASSERT_TRUE(pair.ConnectBoth());
  const Bytes last_words = Pattern(5000, 9);
  ASSERT_TRUE(pair.server->Send(pair.to_client, Delivery::kReliable, last_words).ok());
  pair.server->Disconnect(pair.to_client);
  EXPECT_EQ(pair.server->Send(pair.to_client, Delivery::kReliable, last_words).code(), absl::StatusCode::kNotFound);
  ASSERT_TRUE(pair.Until([&] { return pair.at_client.size() == 2; }));
  EXPECT_EQ(pair.at_client[0].bytes, last_words);
  EXPECT_EQ(pair.at_client[1].kind, Event::Kind::kDisconnected);
  EXPECT_TRUE(pair.at_server.empty());
  EXPECT_EQ(pair.client->Send(pair.to_server, Delivery::kReliable, last_words).code(), absl::StatusCode::kNotFound);
  pair.client->Disconnect(pair.to_server);  // of a peer that is gone: nothing
  EXPECT_EQ(pair.client->StatsOf(pair.to_server).bytes_received, 0u);
}

TEST(EndpointTest, HandlesAreNeverReused) {
  Pair pair({.max_peers = 1}, {.max_peers = 1});
  std::set<PeerHandle> seen;
  for (int round = 0; round < 5; ++round) {
    ASSERT_TRUE(pair.ConnectBoth()) << round;
    EXPECT_TRUE(seen.insert(pair.to_client).second);
    pair.client->Disconnect(pair.to_server);
    ASSERT_TRUE(pair.Until([&] { return pair.at_server.size() == 1; }));
    EXPECT_EQ(pair.at_server[0].kind, Event::Kind::kDisconnected);
    pair.at_server.clear();
    // The client's one slot is free when the farewell has been acknowledged.
    ASSERT_TRUE(pair.Until([&] {
      const auto probe = Dial(*pair.client, pair.server->port());
      if (probe.ok()) pair.client->Disconnect(*probe);
      return probe.ok();
    }));
    pair.at_server.clear();
    pair.at_client.clear();
  }
}

TEST(EndpointTest, ASilentPeerCountsAsGoneAfterTheTimeout) {
  Pair pair({.peer_timeout = milliseconds(300)});
  ASSERT_TRUE(pair.ConnectBoth());
  const auto limit = Clock::now() + kPatience;
  std::vector<Event> events;  // the client is not serviced: it says nothing more
  while (events.empty() && Clock::now() < limit) events = pair.server->Service(milliseconds(20));
  ASSERT_EQ(events.size(), 1u);
  EXPECT_EQ(events[0].kind, Event::Kind::kDisconnected);
  EXPECT_EQ(events[0].peer, pair.to_client);
}

TEST(EndpointTest, ConnectingToNobodyEndsInADisconnect) {
  std::uint16_t closed_port;
  { closed_port = Listen()->port(); }
  auto client = Listen({.peer_timeout = milliseconds(200)});
  const auto peer = Dial(*client, closed_port);
  ASSERT_TRUE(peer.ok()) << peer.status();
  EXPECT_EQ(client->Send(*peer, Delivery::kReliable, Pattern(1, 0)).code(), absl::StatusCode::kNotFound);
  const auto limit = Clock::now() + kPatience;
  std::vector<Event> events;
  while (events.empty() && Clock::now() < limit) events = client->Service(milliseconds(20));
  ASSERT_EQ(events.size(), 1u);
  EXPECT_EQ(events[0].kind, Event::Kind::kDisconnected);
  EXPECT_EQ(events[0].peer, *peer);
  EXPECT_TRUE(events[0].outgoing);
}

TEST(EndpointTest, AnEndingEndpointTellsItsPeers) {
  Pair pair;
  ASSERT_TRUE(pair.ConnectBoth());
  pair.server.reset();
  const auto limit = Clock::now() + kPatience;
  std::vector<Event> events;
  while (events.empty() && Clock::now() < limit) events = pair.client->Service(milliseconds(20));
  ASSERT_EQ(events.size(), 1u);
  EXPECT_EQ(events[0].kind, Event::Kind::kDisconnected);
}

TEST(EndpointTest, APortInUseIsNamed) {
  const auto first = Listen();
  const auto second = Endpoint::Create({.bind_address = "127.0.0.1", .port = first->port()});
  EXPECT_EQ(second.status().code(), absl::StatusCode::kAlreadyExists);
  EXPECT_EQ(second.status().message(), "port " + std::to_string(first->port()) + " on 127.0.0.1 is in use");
}

TEST(EndpointTest, WrongOptionsAreNamed) {
  const auto word = Endpoint::Create({.bind_address = "nowhere"});
  EXPECT_EQ(word.status().message(), "bind_address nowhere is not an IPv4 address");
  const auto foreign = Endpoint::Create({.bind_address = "192.0.2.1"});
  EXPECT_EQ(foreign.status().message(), "bind_address 192.0.2.1 is not an address of this machine");
  EXPECT_EQ(Endpoint::Create({.max_peers = 0}).status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(Endpoint::Create({.max_peers = 4096}).status().code(), absl::StatusCode::kInvalidArgument);
}

TEST(EndpointTest, WrongAddressesAreNamed) {
  const auto endpoint = Listen();
  EXPECT_EQ(endpoint->Connect("127.0.0.1", 0, RegionId(2), Pass()).status().code(), absl::StatusCode::kInvalidArgument);
  const auto unknown = endpoint->Connect("no such host", 7777, RegionId(2), Pass());
  EXPECT_EQ(unknown.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_NE(unknown.status().message().find("no such host"), std::string_view::npos) << unknown.status();
}

TEST(EndpointTest, ServesManyPeersAndRefusesOneTooMany) {
  constexpr std::size_t kPeers = 200;
  Pair pair({.max_peers = kPeers}, {.max_peers = kPeers, .peer_timeout = milliseconds(10'000)});
  std::map<PeerHandle, unsigned> number_of;
  for (unsigned i = 0; i < kPeers; ++i) {
    const auto peer = Dial(*pair.client, pair.server->port());
    ASSERT_TRUE(peer.ok()) << peer.status();
    number_of[*peer] = i;
  }
  EXPECT_EQ(Dial(*pair.client, pair.server->port()).status().code(), absl::StatusCode::kResourceExhausted);
  ASSERT_TRUE(pair.Until([&] { return pair.at_client.size() == kPeers && pair.at_server.size() == kPeers; }));
  for (const auto& [peer, number] : number_of) {
    ASSERT_TRUE(pair.client->Send(peer, Delivery::kReliable, Pattern(500, number)).ok());
  }
  pair.at_server.clear();
  ASSERT_TRUE(pair.Until([&] { return pair.at_server.size() == kPeers; }));
  std::set<Bytes> distinct;
  std::set<PeerHandle> from;
  for (const Event& event : pair.at_server) {
    distinct.insert(event.bytes);
    from.insert(event.peer);
  }
  EXPECT_EQ(distinct.size(), kPeers);
  EXPECT_EQ(from.size(), kPeers);
}

TEST(EndpointTest, WhoIsRefusedHearsWhy) {
  Pair pair;
  ASSERT_TRUE(pair.client->Connect("127.0.0.1", pair.server->port(), RegionId(9), Pass()).ok());
  ASSERT_TRUE(pair.Until([&] { return !pair.at_client.empty(); }));
  EXPECT_EQ(pair.at_client[0].kind, Event::Kind::kDisconnected);
  EXPECT_TRUE(pair.at_client[0].outgoing);
  ASSERT_TRUE(pair.at_client[0].refusal.has_value());
  EXPECT_EQ(pair.at_client[0].refusal->reason, Refused::kWrongRegion);
  EXPECT_EQ(pair.at_client[0].refusal->detail, "this is region 2, not 9");
  EXPECT_TRUE(pair.at_server.empty());
  EXPECT_EQ(pair.server->connections(), 0u);
}

TEST(EndpointTest, AFullPortSaysSo) {
  Pair pair({.max_peers = 1});
  ASSERT_TRUE(pair.ConnectBoth());
  ASSERT_TRUE(Dial(*pair.client, pair.server->port()).ok());
  ASSERT_TRUE(pair.Until([&] { return !pair.at_client.empty(); }));
  ASSERT_TRUE(pair.at_client[0].refusal.has_value());
  EXPECT_EQ(pair.at_client[0].refusal->reason, Refused::kFull);
}

TEST(EndpointTest, AClosedPortRefusesNewcomersAndKeepsItsPeers) {
  Pair pair;
  ASSERT_TRUE(pair.ConnectBoth());
  pair.server->Close("the instance ends");
  ASSERT_TRUE(Dial(*pair.client, pair.server->port()).ok());
  ASSERT_TRUE(pair.Until([&] { return !pair.at_client.empty(); }));
  ASSERT_TRUE(pair.at_client[0].refusal.has_value());
  EXPECT_EQ(pair.at_client[0].refusal->reason, Refused::kStopping);
  ASSERT_TRUE(pair.client->Send(pair.to_server, Delivery::kReliable, Pattern(10, 1)).ok());
  EXPECT_TRUE(pair.Until([&] { return !pair.at_server.empty(); }));
}

TEST(EndpointTest, WhoDialsBeforeThePortIsOpenComesInOnceItIs) {
  auto server = *Endpoint::Create({.bind_address = "127.0.0.1"});
  const auto client = Listen();
  ASSERT_TRUE(Dial(*client, server->port()).ok());
  for (int i = 0; i < 20; ++i) {
    EXPECT_TRUE(server->Service(milliseconds(1)).empty());
    EXPECT_TRUE(client->Service(milliseconds(1)).empty());
  }
  server->Open(Plate());
  std::vector<Event> events;
  const auto limit = Clock::now() + kPatience;
  while (events.empty() && Clock::now() < limit) {
    server->Service(milliseconds(1));
    events = client->Service(milliseconds(1));
  }
  ASSERT_EQ(events.size(), 1u);
  EXPECT_EQ(events[0].kind, Event::Kind::kConnected);
}

// Two that call each other use the same socket for both ways, as regions do.
TEST(EndpointTest, BothSidesMayDial) {
  Pair pair;
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

// 64 of these took all places of bare ENet for half a minute.
TEST(EndpointTest, BlindConnectsLeaveNoTraceAndDrawNothing) {
  Pair pair({.max_peers = 4});
  Strangers strangers(64);
  for (std::uint32_t i = 0; i < 2000; ++i) {
    strangers.Send(pair.server->port(), BlindConnect(i + 1));
    if (i % 50 == 0) pair.ServiceOnce();
  }
  EXPECT_EQ(pair.server->connections(), 0u);
  EXPECT_TRUE(pair.ConnectBoth());
  strangers.Drain();
  EXPECT_EQ(strangers.bytes_received(), 0u);
  EXPECT_GT(strangers.bytes_sent(), 0u);
}

TEST(EndpointTest, BlindHellosDrawLessThanTheySend) {
  Pair pair({.max_peers = 4});
  Strangers strangers(64);
  for (std::uint32_t i = 0; i < 2000; ++i) {
    strangers.Send(pair.server->port(), BlindHello(i + 1));
    if (i % 50 == 0) pair.ServiceOnce();
  }
  EXPECT_TRUE(pair.ConnectBoth());
  strangers.Drain();
  EXPECT_GT(strangers.bytes_received(), 0u);
  EXPECT_LT(strangers.bytes_received(), strangers.bytes_sent());
}

// A socket between two endpoints that keeps what passes.
class Wire {
 public:
  explicit Wire(std::uint16_t server) : server_(server), fd_(socket(AF_INET, SOCK_DGRAM | SOCK_NONBLOCK, 0)) {
    sockaddr_in any{};
    any.sin_family = AF_INET;
    any.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    EXPECT_EQ(bind(fd_, reinterpret_cast<const sockaddr*>(&any), sizeof any), 0);
    socklen_t size = sizeof any;
    getsockname(fd_, reinterpret_cast<sockaddr*>(&any), &size);
    port = ntohs(any.sin_port);
  }
  ~Wire() { close(fd_); }

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

TEST(EndpointTest, WhatIsOnTheWireIsSecretWholeAndTakenOnce) {
  Pair pair;
  Wire wire(pair.server->port());
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
  // All of it once more, whole, cut and damaged: the farewell and everything else is only taken from its sender.
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
  EXPECT_GT(pair.server->door_stats().replayed, 0u);
}

// A token's holder that stops half way: ENet alone would keep its place for half a minute.
TEST(EndpointTest, OneThatNeverFinishesDoesNotKeepItsPlace) {
  const auto server = Listen({.max_peers = 1});
  const int fd = socket(AF_INET, SOCK_DGRAM | SOCK_NONBLOCK, 0);
  sockaddr_in to{};
  to.sin_family = AF_INET;
  to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  to.sin_port = htons(server->port());
  const auto send = [&](std::span<const std::uint8_t> bytes) {
    (void)sendto(fd, bytes.data(), bytes.size(), 0, reinterpret_cast<const sockaddr*>(&to), sizeof to);
  };
  Door door({.max_sessions = 1});
  const Address house{.host = to.sin_addr.s_addr, .port = server->port()};
  const SessionNumber dial = *door.Dial(Clock::now(), house, RegionId(2), Pass());
  const auto limit = Clock::now() + kPatience;
  while (!door.IsOpen(dial) && Clock::now() < limit) {
    for (const Door::Outgoing& out : door.Due(Clock::now())) send(out.bytes);
    server->Service(milliseconds(1));
    Bytes bytes(2048);
    const ssize_t got = recv(fd, bytes.data(), bytes.size(), 0);
    if (got < 0) continue;
    const auto received = door.Receive(Clock::now(), 0, house, std::span(bytes).first(static_cast<std::size_t>(got)));
    if (received.kind == Door::Received::Kind::kReply) send(received.bytes);
  }
  ASSERT_TRUE(door.IsOpen(dial));
  Bytes connect = BlindConnect(1);
  connect.erase(connect.begin() + 4, connect.begin() + 8);  // without the field of its checksum
  const std::size_t payload = connect.size();
  connect.insert(connect.begin(), kSealHeaderBytes, 0);
  connect.resize(connect.size() + kSealTagBytes);
  door.Seal(dial, connect, payload);
  send(connect);
  while (server->connections() == 0 && Clock::now() < limit) server->Service(milliseconds(1));
  ASSERT_EQ(server->connections(), 1u);
  while (server->connections() > 0 && Clock::now() < limit) EXPECT_TRUE(server->Service(milliseconds(10)).empty());
  EXPECT_EQ(server->connections(), 0u);
  close(fd);
}

}  // namespace
}  // namespace tessera::net
