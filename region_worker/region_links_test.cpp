// Links in this process, to a neighbour that the test plays.
#include "region_worker/region_links.h"

#include <gtest/gtest.h>

#include <chrono>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "core/region/rules.h"
#include "core/world/byte_view.h"
#include "net/protocol.h"
#include "net/testing/test_identity.h"
#include "prometheus/text_serializer.h"
#include "region_worker/link_budget.h"
#include "region_worker/link_parts.h"

namespace tessera::worker {
namespace {

constexpr TimePoint kLinksStart = TimePoint(std::chrono::hours(1));
constexpr char kWorld[] = "inst-1";
constexpr RegionId kNeighbour{1}, kOwn{2};

TEST(LinkBudgetTest, MessagesAndBytesHaveARateAndABurst) {
  const LinkLimits limits{.messages = {.per_s = 10, .burst = 3}, .bytes = {.per_s = 100, .burst = 1000}};
  LinkBudget budget;
  for (int i = 0; i < 3; ++i) EXPECT_TRUE(budget.Take(kLinksStart, limits, 1));
  EXPECT_FALSE(budget.Take(kLinksStart, limits, 1));
  EXPECT_TRUE(budget.Take(kLinksStart + std::chrono::milliseconds(101), limits, 900));
  EXPECT_FALSE(budget.Take(kLinksStart + std::chrono::seconds(1), limits, 900)) << "bytes come back slower";
  EXPECT_TRUE(budget.Take(kLinksStart + std::chrono::seconds(10), limits, 900));
}

TEST(LinkBudgetTest, ABusyNeighbourStaysBelow) {
  const LinkLimits limits;
  LinkBudget budget;
  TimePoint now = kLinksStart;
  EXPECT_TRUE(budget.Take(now, limits, std::size_t{500} << 20)) << "the state of a large region, once";
  for (int i = 0; i < 100'000; ++i) {
    now += std::chrono::microseconds(100);
    ASSERT_TRUE(budget.Take(now, limits, 10'000)) << i;
  }
}

TEST(LinkPartsTest, CountsGoOnWhereTheLinkBeginsToCountAnew) {
  using Counts = LinkParts::Counts;
  LinkParts parts;
  EXPECT_EQ(parts.Since({.sent = 100, .resent = 3}), (Counts{.sent = 100, .resent = 3}));
  EXPECT_EQ(parts.Since({.sent = 150, .resent = 3}), (Counts{.sent = 50, .resent = 0}));
  EXPECT_EQ(parts.Since({.sent = 40, .resent = 1}), (Counts{.sent = 40, .resent = 1})) << "from 0";
  EXPECT_EQ(parts.Since({.sent = 60, .resent = 0}), (Counts{.sent = 60, .resent = 0})) << "a busier span";
}

class RegionLinksTest : public ::testing::Test {
 protected:
  RegionLinksTest() : links_(EndpointOf(), metrics_, {.messages = {.per_s = 1, .burst = 20}}) {
    links_.Open({.self = net::TestWorker(key_, kWorld, kOwn, Incarnation(2), true)});
    Actions actions;
    const std::vector<PeerAddress> peers = {{kNeighbour, Incarnation(1), "127.0.0.1", neighbour_->port(), 0}};
    const std::vector<RegionId> partners = {kNeighbour};
    table_.SetAddresses(peers, actions);
    table_.SetPartners(partners, actions);
    const net::EndpointIdentity self = net::TestWorker(key_, kWorld, kNeighbour, Incarnation(1), true);
    auto peer = neighbour_->Connect("127.0.0.1", links_.port(), kOwn, Incarnation(2), net::CredentialsOf(self));
    EXPECT_TRUE(peer.ok()) << peer.status();
    peer_ = *peer;
  }
  static std::unique_ptr<net::Endpoint> EndpointOf() {
    auto endpoint = net::Endpoint::Create({.bind_address = "127.0.0.1", .max_message_bytes = net::kMaxFrameBytes});
    EXPECT_TRUE(endpoint.ok()) << endpoint.status();
    return *std::move(endpoint);
  }
  bool Until(const std::function<bool()>& done) {
    const LinkEvents events{.up = [this](RegionId, Incarnation) { ++up_; },
                            .down = [this](RegionId) { ++down_; },
                            .message = [](RegionId, const LinkMessage&) {}};
    const auto patience = Clock::now() + std::chrono::seconds(60);
    while (!done() && Clock::now() < patience) {
      links_.Service(Clock::now(), table_, MapVersion(1), events);
      links_.Flush();
      for (const net::Event& event : neighbour_->Service(std::chrono::milliseconds(1))) {
        if (event.kind == net::Event::Kind::kConnected) connected_ = true;
        if (event.kind == net::Event::Kind::kDisconnected) connected_ = false;
      }
    }
    return done();
  }
  void Send(const std::string& text) {
    EXPECT_TRUE(neighbour_->Send(peer_, net::Delivery::kReliable, AsBytes(text)).ok());
  }
  void Link() {
    ASSERT_TRUE(Until([this] { return connected_; }));
    v1::LinkHello hello;
    hello.set_region(kNeighbour.value());
    hello.set_incarnation(1);
    hello.set_map_version(1);
    hello.set_rules(region::RulesOf(region::RegionSettings()));
    Send(hello.SerializeAsString());
    ASSERT_TRUE(Until([this] { return up_ == 1; }));
  }

  const net::SigningKey key_ = net::SigningKey::Make();
  std::unique_ptr<net::Endpoint> neighbour_ = EndpointOf();
  WorkerMetrics metrics_;
  LinkTable table_{kOwn};
  RegionLinks links_;
  net::PeerHandle peer_;
  bool connected_ = false;
  int up_ = 0, down_ = 0;
};

TEST_F(RegionLinksTest, ANeighbourThatFloodsIsCutAndCounted) {
  Link();
  for (int i = 0; i < 50; ++i) Send("no message that a region sends");
  EXPECT_TRUE(Until([this] { return down_ == 1 && !connected_; }));
  EXPECT_EQ(links_.linked(), 0u);
  const std::string metrics = prometheus::TextSerializer().Serialize(metrics_.registry()->Collect());
  EXPECT_NE(metrics.find("tessera_region_floods_total{port=\"links\"} 1"), std::string::npos) << metrics;
}

TEST_F(RegionLinksTest, WhatALinkSendsIsCountedByItsNeighbour) {
  Link();
  const auto value = [this](const std::string& series) {
    const std::string metrics = prometheus::TextSerializer().Serialize(metrics_.registry()->Collect());
    const std::size_t at = metrics.find(series + "{neighbour=\"1\"} ");
    return at == std::string::npos ? -1 : std::stod(metrics.substr(metrics.find(' ', at)));
  };
  EXPECT_TRUE(Until([&] { return value("tessera_region_link_parts_total") > 0; }));
  EXPECT_GE(value("tessera_region_link_parts_resent_total"), 0);
}

TEST_F(RegionLinksTest, OneThatSendsAFewStays) {
  Link();
  for (int i = 0; i < 10; ++i) Send("no message that a region sends");
  const auto dropped = [this] {
    const std::string metrics = prometheus::TextSerializer().Serialize(metrics_.registry()->Collect());
    return metrics.find("reason=\"malformed\"} 10") != std::string::npos;
  };
  EXPECT_TRUE(Until(dropped));
  EXPECT_TRUE(connected_);
  EXPECT_EQ(down_, 0);
}

}  // namespace
}  // namespace tessera::worker
