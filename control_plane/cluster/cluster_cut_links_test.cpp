// A world whose regions lose the link between them, under a virtual clock: what the control plane does from the cut to
// the map in which nobody lacks a link.
#include <gmock/gmock.h>

#include <algorithm>
#include <set>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "control_plane/testing/cluster_harness.h"

namespace tessera::control {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

class ClusterCutLinksTest : public ::testing::Test {
 protected:
  void Begin(std::uint32_t regions) {
    id_ = Start(harness_, regions);
    harness_.Run(seconds(1));
  }
  void Cut(const std::set<std::pair<std::uint32_t, std::uint32_t>>& pairs) {
    for (auto& [name, agent] : harness_.agents) agent.fake.cut = pairs;
    // An order makes them look at their links.
    ASSERT_TRUE(harness_.cluster().Join(harness_.now, JoinRequest(id_, absl::StrCat("player ", ++players_))).ok());
  }
  std::string HostOf(std::uint32_t region) {
    const auto at = std::find_if(harness_.agents.begin(), harness_.agents.end(), [&](const auto& agent) {
      return agent.second.fake.workers.contains({id_, region});
    });
    return at == harness_.agents.end() ? "" : at->first;
  }
  std::size_t WorkersOn(const std::string& host) { return harness_.agents.at(host).fake.workers.size(); }
  std::size_t EventsWith(const std::string& text) {
    const v1::Instance instance = harness_.Get(id_);
    return static_cast<std::size_t>(
        std::count_if(instance.events().begin(), instance.events().end(),
                      [&](const v1::InstanceEvent& event) { return event.text().find(text) != std::string::npos; }));
  }
  InstanceHealth Health() { return Summarise(harness_.cluster().state()).health.at(0); }

  ClusterHarness harness_;
  std::string id_;
  int players_ = 0;
};

TEST_F(ClusterCutLinksTest, ALastingCutMovesOneRegionToAHostWithLinksAndTheWorldIsWellAgain) {
  for (const char* name : {"alpha", "beta", "gamma"}) harness_.AddHost(name, 4);
  Begin(2);
  const std::string left = HostOf(1), stays = HostOf(2);
  Cut({{1, 2}});
  harness_.Run(milliseconds(9500));
  EXPECT_EQ(harness_.Get(id_).state(), v1::INSTANCE_STATE_DEGRADED);
  EXPECT_EQ(harness_.Get(id_).map().version(), 1U) << "it may pass";
  EXPECT_EQ(Health().moved_regions, 0U);
  harness_.Run(seconds(10));
  ExpectSettled(harness_, id_, 2);
  ExpectEachBodyOnce(harness_, 2);
  EXPECT_EQ(WorkersOn(left), 0U);
  EXPECT_EQ(WorkersOn(stays), 1U);
  EXPECT_EQ(EventsWith("moving region 1: region 1 on "), 1U);
  EXPECT_EQ(Health().moved_regions, 1U);
  EXPECT_EQ(Health().cut_links, 0U);
  EXPECT_EQ(harness_.Get(id_).failovers(), 0U);
  const auto version = harness_.Get(id_).map().version();
  harness_.Run(seconds(120));
  EXPECT_EQ(harness_.Get(id_).map().version(), version) << "nothing goes back to even it out";
}

TEST_F(ClusterCutLinksTest, ACutThatHealsEarlierMovesNobody) {
  for (const char* name : {"alpha", "beta", "gamma"}) harness_.AddHost(name, 4);
  Begin(2);
  Cut({{1, 2}});
  harness_.Run(seconds(9));
  Cut({});
  harness_.Run(seconds(30));
  EXPECT_EQ(harness_.Get(id_).state(), v1::INSTANCE_STATE_RUNNING) << harness_.Get(id_).reason();
  EXPECT_EQ(harness_.Get(id_).map().version(), 1U);
  EXPECT_EQ(EventsWith("moving region"), 0U);
}

TEST_F(ClusterCutLinksTest, WithoutRoomItStaysDegradedAndSaysOnceWhatToDo) {
  for (const char* name : {"alpha", "beta"}) harness_.AddHost(name, 1);
  Begin(2);
  Cut({{1, 2}});
  harness_.Run(seconds(60));
  EXPECT_EQ(harness_.Get(id_).state(), v1::INSTANCE_STATE_DEGRADED);
  EXPECT_EQ(harness_.Get(id_).map().version(), 1U);
  EXPECT_EQ(EventsWith("no other host has room for either: add a host, or let UDP through between "), 1U);
  harness_.AddHost("gamma", 1);
  harness_.Run(seconds(20));
  ExpectSettled(harness_, id_, 2);
  EXPECT_EQ(WorkersOn("gamma"), 1U);
}

// A body that was on its way over the link when that was cut stays on its way.
TEST_F(ClusterCutLinksTest, ARegionWhoseBodiesWaitForTheLinkIsCarriedOnByItsStandby) {
  for (const char* name : {"alpha", "beta", "gamma"}) harness_.AddHost(name, 4);
  Begin(2);
  harness_.AgentOf(id_, 1).fake.workers.at({id_, 1}).report.set_bodies_outside(1);
  Cut({{1, 2}});
  harness_.Run(seconds(30));
  ExpectSettled(harness_, id_, 2);
  ExpectEachBodyOnce(harness_, 2);
  EXPECT_EQ(EventsWith("region 1 to be carried on by region 3: its bodies wait for a cut link"), 1U);
  EXPECT_EQ(harness_.Get(id_).failovers(), 1U);
  EXPECT_EQ(harness_.Get(id_).lost_bodies(), 0U);
  EXPECT_EQ(Health().moved_regions, 1U) << "one move, whose end that was";
}

}  // namespace
}  // namespace tessera::control
