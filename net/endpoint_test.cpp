// Over real sockets on the loopback interface.
#include "net/endpoint.h"

#include <arpa/inet.h>
#include <enet/enet.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include <map>
#include <set>

#include "net/testing/endpoint_pair.h"

namespace tessera::net {
namespace {

TEST(EndpointTest, EchoesBothKinds) {
  EndpointPair pair;
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

TEST(EndpointTest, CountsWhatItSendsAgainWhileNobodyAnswers) {
  EndpointPair pair;
  ASSERT_TRUE(pair.ConnectBoth());
  const std::uint32_t sent = pair.client->StatsOf(pair.to_server).parts_sent;
  ASSERT_TRUE(pair.client->Send(pair.to_server, Delivery::kReliable, Pattern(20, 1)).ok());
  PeerStats stats;
  for (const auto limit = Clock::now() + kPatience; stats.parts_resent == 0 && Clock::now() < limit;) {
    (void)pair.client->Service(milliseconds(1));
    stats = pair.client->StatsOf(pair.to_server);
  }
  EXPECT_GE(stats.parts_resent, 1u);
  EXPECT_GT(stats.parts_sent, sent);
}

// A process of the same user, as another worker is, gets no part of what is sent to it.
TEST(EndpointTest, APortIsItsHoldersAloneWhoeverAsksToShareIt) {
  const auto holder = Endpoint::Create({.bind_address = "127.0.0.1"});
  ASSERT_TRUE(holder.ok()) << holder.status();
  for (const char* where : {"127.0.0.1", "0.0.0.0"}) {
    const int thief = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    const int on = 1;
    ASSERT_EQ(setsockopt(thief, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on), 0);
    ASSERT_EQ(setsockopt(thief, SOL_SOCKET, SO_REUSEPORT, &on, sizeof on), 0);
    sockaddr_in name{};
    name.sin_family = AF_INET;
    name.sin_port = htons((*holder)->port());
    ASSERT_EQ(inet_pton(AF_INET, where, &name.sin_addr), 1);
    EXPECT_NE(bind(thief, reinterpret_cast<const sockaddr*>(&name), sizeof name), 0) << where;
    close(thief);
  }
}

// As on a port for players. Reliable messages to the accepted peer, and unsequenced ones both ways, still arrive.
TEST(EndpointTest, AcceptsNoReliableMessagesWhereItIsToldNotTo) {
  EndpointPair pair({.accept_reliable_messages = false});
  ASSERT_TRUE(pair.ConnectBoth());
  ASSERT_TRUE(pair.client->Send(pair.to_server, Delivery::kReliable, Pattern(20, 1)).ok());
  pair.client->Flush();
  ASSERT_TRUE(pair.client->Send(pair.to_server, Delivery::kUnsequenced, Pattern(30, 2)).ok());
  ASSERT_TRUE(pair.server->Send(pair.to_client, Delivery::kReliable, Pattern(5000, 3)).ok());
  ASSERT_TRUE(pair.Until([&] { return !pair.at_client.empty() && !pair.at_server.empty(); }));
  EXPECT_EQ(pair.at_client[0].bytes, Pattern(5000, 3));
  ASSERT_EQ(pair.at_server.size(), 1u);
  EXPECT_EQ(pair.at_server[0].bytes, Pattern(30, 2));
}

TEST(EndpointTest, LargeReliableMessagesArriveWholeAndInOrder) {
  EndpointPair pair;
  ASSERT_TRUE(pair.ConnectBoth());
  const std::vector<std::size_t> sizes = {kMaxMessageBytes, 0, 1, 100'000, kMaxDatagramBytes + 1, 100'000};
  for (std::size_t i = 0; i < sizes.size(); ++i) {
    ASSERT_TRUE(pair.client->Send(pair.to_server, Delivery::kReliable, Pattern(sizes[i], unsigned(i))).ok());
  }
  ASSERT_TRUE(pair.Until([&] { return pair.at_server.size() == sizes.size(); }));
  for (std::size_t i = 0; i < sizes.size(); ++i) EXPECT_EQ(pair.at_server[i].bytes, Pattern(sizes[i], unsigned(i)));
}

// As two regions' link ports have it, at whose border 50 000 bodies are awake.
TEST(EndpointTest, AFrameOfMoreThanFourMegabytesArrivesWhole) {
  constexpr std::size_t kFrame = 5'500'000;
  static_assert(kFrame > (4 << 20) && kFrame < kMaxFrameBytes);
  EndpointPair pair({.max_message_bytes = kMaxFrameBytes}, {.max_message_bytes = kMaxFrameBytes});
  ASSERT_TRUE(pair.ConnectBoth());
  for (const unsigned tick : {1U, 2U}) {
    ASSERT_TRUE(pair.client->Send(pair.to_server, Delivery::kReliable, Pattern(kFrame, tick)).ok());
    ASSERT_TRUE(pair.server->Send(pair.to_client, Delivery::kReliable, Pattern(kFrame, 10 + tick)).ok());
  }
  ASSERT_TRUE(pair.Until([&] { return pair.at_server.size() == 2 && pair.at_client.size() == 2; }));
  for (const unsigned tick : {1U, 2U}) {
    EXPECT_TRUE(pair.at_server[tick - 1].bytes == Pattern(kFrame, tick));
    EXPECT_TRUE(pair.at_client[tick - 1].bytes == Pattern(kFrame, 10 + tick));
  }
}

TEST(EndpointTest, AFullDatagramStaysADatagram) {
  EndpointPair pair;
  ASSERT_TRUE(pair.ConnectBoth());
  const Bytes full = Pattern(kMaxDatagramBytes, 3);
  ASSERT_TRUE(pair.server->Send(pair.to_client, Delivery::kUnsequenced, full).ok());
  ASSERT_TRUE(pair.Until([&] { return pair.at_client.size() == 1; }));
  EXPECT_EQ(pair.at_client[0].delivery, Delivery::kUnsequenced);  // fragments would come back as reliable
  EXPECT_EQ(pair.at_client[0].bytes, full);
}

TEST(EndpointTest, TooLongMessagesAreRefused) {
  EndpointPair pair;
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
  EndpointPair pair;
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
  EndpointPair pair;
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
  pair.client->Disconnect(pair.to_server);  // the peer is gone: nothing happens
  EXPECT_EQ(pair.client->StatsOf(pair.to_server).bytes_received, 0u);
}

TEST(EndpointTest, HandlesAreNeverReused) {
  EndpointPair pair({.max_peers = 1}, {.max_peers = 1});
  std::set<PeerHandle> seen;
  for (int round = 0; round < 5; ++round) {
    ASSERT_TRUE(pair.ConnectBoth()) << round;
    EXPECT_TRUE(seen.insert(pair.to_client).second);
    pair.client->Disconnect(pair.to_server);
    ASSERT_TRUE(pair.Until([&] { return pair.at_server.size() == 1; }));
    EXPECT_EQ(pair.at_server[0].kind, Event::Kind::kDisconnected);
    pair.at_server.clear();
    // The client's one slot is free when the disconnection has been acknowledged.
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
  EndpointPair pair({.peer_timeout = milliseconds(300)});
  ASSERT_TRUE(pair.ConnectBoth());
  const auto limit = Clock::now() + kPatience;
  std::vector<Event> events;  // the client is not serviced, so it sends nothing more
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
  EndpointPair pair;
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
  EXPECT_EQ(endpoint->Connect("127.0.0.1", 0, RegionId(2), Incarnation(), TestCredentials()).status().code(),
            absl::StatusCode::kInvalidArgument);
  const auto unknown = endpoint->Connect("no such host", 7777, RegionId(2), Incarnation(), TestCredentials());
  EXPECT_EQ(unknown.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_NE(unknown.status().message().find("no such host"), std::string_view::npos) << unknown.status();
}

TEST(EndpointTest, ServesManyPeersAndRefusesOneTooMany) {
  constexpr std::size_t kPeers = 200;
  EndpointPair pair({.max_peers = kPeers}, {.max_peers = kPeers, .peer_timeout = milliseconds(10'000)});
  std::map<PeerHandle, unsigned> number_of;
  for (unsigned i = 0; i < kPeers; ++i) {
    const auto peer = Dial(*pair.client, pair.server->port(), i + 1);
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

// ENet sends a new peer its bandwidth limits after a second, reliably. Refusing that would lose the peer in the end.
TEST(EndpointTest, AConnectionLastsAndCarriesOn) {
  EndpointPair pair({.peer_timeout = milliseconds(4000)}, {.peer_timeout = milliseconds(4000)});
  ASSERT_TRUE(pair.ConnectBoth());
  for (std::size_t round = 0; round < 60; ++round) {
    enet_time_set(enet_time_get() + 250);
    ASSERT_TRUE(pair.client->Send(pair.to_server, Delivery::kReliable, Pattern(3000, unsigned(round))).ok());
    ASSERT_TRUE(pair.Until([&] { return pair.at_server.size() > round; }));
    ASSERT_EQ(pair.at_server.back().kind, Event::Kind::kMessage) << round;
  }
  EXPECT_TRUE(pair.at_client.empty());
}

}  // namespace
}  // namespace tessera::net
