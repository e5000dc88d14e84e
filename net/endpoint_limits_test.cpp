// Attacks on real sockets of the loopback interface.
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <thread>
#include <utility>

#include "net/endpoint.h"
#include "net/testing/endpoint_pair.h"
#include "net/testing/spoofed_flood.h"

namespace tessera::net {
namespace {

constexpr double kFloodPerSecond = 100'000;
constexpr int kHellosOfADial = 64;  // at most

// Sends hellos from 256 addresses, as fast as 100 000 a second, in a thread of its own.
class HelloFlood {
 public:
  explicit HelloFlood(std::uint16_t port, const Knock& knock = {})
      : thread_([this, port, knock] { Run(port, knock); }) {}
  ~HelloFlood() { Stop(); }
  void Stop() {
    stopped_ = true;
    if (thread_.joinable()) thread_.join();
  }
  std::uint64_t sent() const { return sent_; }

 private:
  void Run(std::uint16_t port, const Knock& knock) {
    SpoofedFlood flood(256);
    const auto begin = Clock::now();
    for (std::uint32_t number = 0; !stopped_;) {
      const double passed_s = std::chrono::duration<double>(Clock::now() - begin).count();
      for (const auto due = static_cast<std::uint32_t>(passed_s * kFloodPerSecond); number < due; ++number) {
        flood.Send(port, BlindHello(number, knock));
      }
      flood.Drain();
      sent_ = flood.datagrams();
      std::this_thread::yield();
    }
  }
  std::atomic<bool> stopped_ = false;
  std::atomic<std::uint64_t> sent_ = 0;
  std::thread thread_;
};

// The hellos are strangers', and then those of one who has overheard a player's.
TEST(EndpointLimitsTest, AnHonestPlayerComesInThroughAFloodOfHellosThatCostsLittle) {
  const Knock overheard = KnockOf(TestIdentity().instance_key);
  for (const auto& [knock, rate] : {std::pair(Knock{}, kStrangersHellos), std::pair(overheard, kHellos)}) {
    SCOPED_TRACE(rate.per_s);
    EndpointPair pair({.max_peers = 16, .accepted = kPlayerLimits, .datagrams_per_service = kDatagramsPerService});
    HelloFlood flood(pair.server->port(), knock);
    // The flood is there, and the filter with it.
    const auto most_at_first = static_cast<std::uint64_t>(rate.burst);
    ASSERT_TRUE(pair.Until([&] {
      return pair.server->acceptor_stats().hellos > most_at_first && pair.server->receive_stats().kernel_dropped > 0;
    }));
    const auto begin = Clock::now();
    const std::uint64_t before = pair.server->acceptor_stats().hellos;
    bool in = false;
    int dials = 0;
    for (; !in && Clock::now() - begin < 3 * kPatience; ++dials) {
      const auto peer = Dial(*pair.client, pair.server->port());
      ASSERT_TRUE(peer.ok());
      ASSERT_TRUE(pair.Until([&] { return !pair.at_client.empty(); }));
      in = pair.at_client.front().kind == Event::Kind::kConnected;
      pair.at_client.clear();
    }
    EXPECT_TRUE(in);
    if (knock != overheard) {
      EXPECT_EQ(dials, 1) << "strangers keep nobody waiting";
    }
    const double span_s = std::chrono::duration<double>(Clock::now() - begin).count();
    const auto answered = static_cast<double>(pair.server->acceptor_stats().hellos - before);
    EXPECT_LE(answered, rate.per_s * span_s + rate.burst + kHellosOfADial * dials);
    const std::uint64_t all = pair.server->acceptor_stats().hellos;
    flood.Stop();  // only then has it counted all that it sent
    EXPECT_GT(flood.sent(), all);
    // Once it is over all hellos pass again.
    const std::uint64_t limited = pair.server->acceptor_stats().hellos_limited;
    const auto quiet = Clock::now() + milliseconds(500);
    ASSERT_TRUE(pair.Until([&] { return Clock::now() > quiet; }));
    const std::uint64_t dropped = pair.server->receive_stats().kernel_dropped;
    SpoofedFlood few(16);
    for (std::uint32_t i = 0; i < 64; ++i) few.Send(pair.server->port(), BlindHello(i));
    const std::uint64_t hellos = pair.server->acceptor_stats().hellos;
    EXPECT_TRUE(pair.Until([&] { return pair.server->acceptor_stats().hellos == hellos + 64; }));
    EXPECT_GE(pair.server->acceptor_stats().hellos_limited, limited);
    EXPECT_EQ(pair.server->receive_stats().kernel_dropped, dropped);
  }
}

TEST(EndpointLimitsTest, OneCallLooksAtABoundedNumberAndTheRestWaits) {
  const auto server = Listen({.datagrams_per_service = 256});
  SpoofedFlood flood(16);
  for (std::uint32_t i = 0; i < 1000; ++i) flood.Send(server->port(), BlindHello(i));
  ASSERT_EQ(flood.datagrams(), 1000u);
  server->Service(milliseconds(0));
  EXPECT_EQ(server->acceptor_stats().hellos, 256u);
  EXPECT_EQ(server->receive_stats().cut_short, 1u);
  for (const auto limit = Clock::now() + kPatience; server->acceptor_stats().hellos < 1000 && Clock::now() < limit;) {
    server->Service(milliseconds(0));
  }
  EXPECT_EQ(server->acceptor_stats().hellos, 1000u);
}

constexpr SessionLimits kShort{
    .datagrams = {.per_s = 1000, .burst = 200}, .bytes = {.per_s = 1e6, .burst = 1e6}, .patience = milliseconds(300)};

std::size_t CountOf(const std::vector<Event>& events, Event::Kind kind, PeerHandle peer) {
  return static_cast<std::size_t>(std::count_if(
      events.begin(), events.end(), [&](const Event& event) { return event.kind == kind && event.peer == peer; }));
}

TEST(EndpointLimitsTest, AVolleyOfOnePlayerIsCutAndItPlaysOn) {
  EndpointPair pair({.accepted = kShort});
  ASSERT_TRUE(pair.ConnectBoth());
  for (int i = 0; i < 8192; ++i) {
    ASSERT_TRUE(pair.client->Send(pair.to_server, Delivery::kUnsequenced, Pattern(20, 1)).ok());
  }
  pair.client->Flush();
  ASSERT_TRUE(pair.Until([&] { return pair.server->acceptor_stats().excess > 0; }));
  const auto calm = Clock::now() + kFloodPause;
  ASSERT_TRUE(pair.Until([&] { return Clock::now() > calm; }));
  EXPECT_LT(CountOf(pair.at_server, Event::Kind::kMessage, pair.to_client), 8192u / 2);
  EXPECT_EQ(CountOf(pair.at_server, Event::Kind::kFloods, pair.to_client), 0u);
  pair.at_server.clear();
  ASSERT_TRUE(pair.client->Send(pair.to_server, Delivery::kUnsequenced, Pattern(20, 1)).ok());
  EXPECT_TRUE(pair.Until([&] { return CountOf(pair.at_server, Event::Kind::kMessage, pair.to_client) == 1; }));
}

TEST(EndpointLimitsTest, WhoFloodsForLongIsReportedOnceAndThenShutOut) {
  EndpointPair pair({.accepted = kShort});
  const Credentials credentials = TestCredentials();
  const auto dial = [&](Endpoint& from) {
    return from.Connect("127.0.0.1", pair.server->port(), RegionId(2), Incarnation(), credentials);
  };
  pair.to_server = *dial(*pair.client);
  ASSERT_TRUE(pair.Until([&] { return pair.at_client.size() == 1 && pair.at_server.size() == 1; }));
  pair.to_client = pair.at_server[0].peer;
  const auto flood = [&] {
    for (int i = 0; i < 50; ++i) (void)pair.client->Send(pair.to_server, Delivery::kUnsequenced, Pattern(20, 1));
  };
  ASSERT_TRUE(pair.Until([&] {
    flood();
    return CountOf(pair.at_server, Event::Kind::kFloods, pair.to_client) > 0;
  }));
  EXPECT_EQ(pair.server->acceptor_stats().floods, 1u);
  pair.server->NoteRefused(pair.to_client, true);
  // Nothing of it reaches the server any more.
  const std::uint64_t dropped = pair.server->receive_stats().kernel_dropped;
  ASSERT_TRUE(pair.Until([&] {
    flood();
    return pair.server->receive_stats().kernel_dropped > dropped + 100;
  }));
  pair.server->Disconnect(pair.to_client);
  // From another port its credential opens nothing, and it hears so.
  const auto elsewhere = Listen();
  ASSERT_TRUE(dial(*elsewhere).ok());
  std::vector<Event> events;
  for (const auto limit = Clock::now() + kPatience; events.empty() && Clock::now() < limit;) {
    pair.server->Service(milliseconds(1));
    events = elsewhere->Service(milliseconds(1));
  }
  ASSERT_EQ(events.size(), 1u);
  ASSERT_TRUE(events[0].refusal.has_value());
  EXPECT_EQ(events[0].refusal->reason, Refused::kBadCredential);
  EXPECT_EQ(pair.server->acceptor_stats().held_off, 1u);
}

TEST(EndpointLimitsTest, WhoIsRefusedAgainAndAgainIsNotLookedAtForAWhile) {
  EndpointPair pair;
  const Credentials credentials = TestCredentials();
  const std::uint64_t tries = kRefusalsAtOnce + 5;
  for (std::uint64_t i = 0; i < tries; ++i) {
    ASSERT_TRUE(pair.client->Connect("127.0.0.1", pair.server->port(), RegionId(2), Incarnation(), credentials).ok());
    ASSERT_TRUE(pair.Until([&] {
      for (const Event& event : pair.at_server) {
        if (event.kind != Event::Kind::kConnected) continue;
        pair.server->NoteRefused(event.peer, false);
        pair.server->Disconnect(event.peer);
      }
      pair.at_server.clear();
      return !pair.at_client.empty() && pair.at_client.back().kind == Event::Kind::kDisconnected;
    }));
    pair.at_client.clear();
  }
  EXPECT_EQ(pair.server->acceptor_stats().accepted, static_cast<std::uint64_t>(kRefusalsAtOnce));
  EXPECT_EQ(pair.server->acceptor_stats().held_off, tries - kRefusalsAtOnce);
  // Another player does not suffer for it.
  ASSERT_TRUE(Dial(*pair.client, pair.server->port(), 8).ok());
  EXPECT_TRUE(pair.Until([&] { return !pair.at_client.empty(); }));
  EXPECT_EQ(pair.at_client[0].kind, Event::Kind::kConnected);
}

}  // namespace
}  // namespace tessera::net
