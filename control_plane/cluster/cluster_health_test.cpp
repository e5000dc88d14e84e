// A world says that it is DEGRADED, and why, whenever it is not what RUNNING promises.
#include <gmock/gmock.h>

#include "control_plane/testing/cluster_harness.h"

namespace tessera::control {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using ::testing::HasSubstr;
using ::testing::SizeIs;

class ClusterHealthTest : public ::testing::Test {
 protected:
  ClusterHealthTest() {
    harness_.AddHost("alpha", 8);
    harness_.AddHost("beta", 8);
  }
  v1::WorkerReport& Report(const std::string& id, std::uint32_t region) {
    return harness_.AgentOf(id, region).fake.workers.at({id, region}).report;
  }
  InstanceHealth Health() { return Summarise(harness_.cluster().state()).health.at(0); }
  std::size_t EventsWith(const std::string& id, const std::string& text) {
    const v1::Instance instance = harness_.Get(id);
    return static_cast<std::size_t>(
        std::count_if(instance.events().begin(), instance.events().end(),
                      [&](const v1::InstanceEvent& event) { return event.text().find(text) != std::string::npos; }));
  }

  ClusterHarness harness_;
};

TEST_F(ClusterHealthTest, AWorldInGoodHealthIsRunningForAsLongAsItRuns) {
  const std::string id = Start(harness_, 4);
  harness_.Run(seconds(60));
  const v1::Instance instance = harness_.Get(id);
  EXPECT_EQ(instance.state(), v1::INSTANCE_STATE_RUNNING) << instance.reason();
  EXPECT_TRUE(instance.events().empty()) << instance.events(0).text();
}

TEST_F(ClusterHealthTest, AStandbyThatTakesNothingDegradesTheWorldUntilAnotherHasACopy) {
  const std::string id = Start(harness_, 4);
  const std::uint32_t standby = StandbyOf(harness_.Get(id), 1);
  Report(id, 1).set_unprotected(true);
  harness_.Run(seconds(4));
  EXPECT_EQ(harness_.Get(id).state(), v1::INSTANCE_STATE_RUNNING) << "it may only be slow";
  harness_.Run(milliseconds(1750));
  const v1::Instance degraded = harness_.Get(id);
  EXPECT_EQ(degraded.state(), v1::INSTANCE_STATE_DEGRADED);
  EXPECT_THAT(degraded.reason(), HasSubstr("region 1 on "));
  EXPECT_THAT(degraded.reason(), HasSubstr("its standby, region "));
  EXPECT_THAT(degraded.reason(), HasSubstr("has no whole copy"));
  EXPECT_EQ(Health().uncovered_regions, 1U);
  EXPECT_EQ(EventsWith(id, "degraded: region 1 on "), 1U);
  harness_.Run(seconds(3));
  EXPECT_NE(StandbyOf(harness_.Get(id), 1), standby) << "another one is stored";
  Report(id, 1).set_unprotected(false);
  harness_.Run(seconds(1));
  EXPECT_EQ(harness_.Get(id).state(), v1::INSTANCE_STATE_RUNNING);
  EXPECT_EQ(Health().uncovered_regions, 0U);
}

TEST_F(ClusterHealthTest, ARegionThatDoesNotStepDegradesTheWorldThoughItsHostIsHeard) {
  const std::string id = Start(harness_, 4);
  harness_.Run(seconds(1));
  harness_.AgentOf(id, 2).fake.still = {2};
  harness_.Run(seconds(2));
  EXPECT_EQ(harness_.Get(id).state(), v1::INSTANCE_STATE_RUNNING);
  EXPECT_FALSE(harness_.Get(id).has_degraded_since());
  const auto before = harness_.now.unix_time;
  harness_.Run(milliseconds(750));
  EXPECT_EQ(harness_.Get(id).state(), v1::INSTANCE_STATE_DEGRADED);
  EXPECT_EQ(harness_.Get(id).reason(), "no steps are known of region 2");
  const auto since = FromTimestamp(harness_.Get(id).degraded_since());
  EXPECT_GE(since, before);
  EXPECT_LE(since, harness_.now.unix_time);
  harness_.Run(seconds(5));
  EXPECT_EQ(FromTimestamp(harness_.Get(id).degraded_since()), since) << "it stays so for as long as it lasts";
  EXPECT_EQ(Health().still_regions, 1U);
  EXPECT_EQ(EventsWith(id, "degraded: no steps are known of region 2"), 1U);
  harness_.AgentOf(id, 2).fake.still = {};
  harness_.Run(milliseconds(500));
  EXPECT_EQ(harness_.Get(id).state(), v1::INSTANCE_STATE_RUNNING);
}

TEST_F(ClusterHealthTest, AWorldThatStartsSaysWhomItWaitsForAndSinceWhen) {
  harness_.agents.at("beta").silent = true;
  const auto begun = harness_.now.unix_time;
  const auto created = harness_.cluster().CreateInstance(harness_.now, TestPlan(4), false);
  ASSERT_TRUE(created.ok()) << created.status();
  const std::string id = created->id();
  harness_.Run(seconds(2));
  const v1::Instance starting = harness_.Get(id);
  ASSERT_EQ(starting.state(), v1::INSTANCE_STATE_STARTING);
  ASSERT_THAT(starting.changes(), SizeIs(1));
  EXPECT_THAT(starting.changes(0).text(), HasSubstr("starts: waits for region "));
  EXPECT_THAT(starting.changes(0).text(), HasSubstr(" on beta, which has not begun"));
  EXPECT_THAT(starting.changes(0).text(), HasSubstr(" on alpha, which links"));
  EXPECT_GE(FromTimestamp(starting.changes(0).since()), begun);
  EXPECT_LT(FromTimestamp(starting.changes(0).since()), begun + seconds(2));
  harness_.agents.at("beta").silent = false;
  harness_.Run(seconds(2));
  EXPECT_EQ(harness_.Get(id).state(), v1::INSTANCE_STATE_RUNNING);
  EXPECT_TRUE(harness_.Get(id).changes().empty());
}

TEST_F(ClusterHealthTest, ARegionOfWhichNothingIsHeardIsNotKnownToStepBeforeItsHostIsLost) {
  const std::string id = Start(harness_, 1);
  harness_.Run(seconds(1));
  FakeHost& agent = harness_.AgentOf(id, 1);
  agent.silent = true;
  harness_.Run(seconds(3));
  EXPECT_EQ(harness_.Get(id).state(), v1::INSTANCE_STATE_DEGRADED);
  EXPECT_EQ(harness_.Get(id).reason(), "no steps are known of region 1");
  harness_.Run(seconds(3));
  EXPECT_THAT(harness_.Get(id).reason(), HasSubstr(" is silent: region 1"));
}

TEST_F(ClusterHealthTest, ARestartUnderAWorldThatIsWellDegradesNothing) {
  const std::string id = Start(harness_, 4);
  for (auto& [name, agent] : harness_.agents) agent.silent = true;
  harness_.Restart();
  harness_.Run(milliseconds(1250));
  for (auto& [name, agent] : harness_.agents) agent.silent = false;
  for (int i = 0; i < 40; ++i) {
    EXPECT_EQ(harness_.Get(id).state(), v1::INSTANCE_STATE_RUNNING) << harness_.Get(id).reason();
    harness_.Run(milliseconds(250));
  }
  EXPECT_TRUE(harness_.Get(id).events().empty());
}

TEST_F(ClusterHealthTest, ARestartUnderAWorldThatStandsSaysSoWithinTwoSeconds) {
  const std::string id = Start(harness_, 4);
  harness_.AgentOf(id, 2).fake.still = {1, 2, 3, 4};
  harness_.Restart();
  harness_.Run(milliseconds(2000));
  EXPECT_EQ(harness_.Get(id).state(), v1::INSTANCE_STATE_DEGRADED) << "though its reports came at once";
  EXPECT_THAT(harness_.Get(id).reason(), HasSubstr("not known to step yet: region"));
  EXPECT_EQ(Health().still_regions, 0U) << "an alert is for what lasts";
  harness_.Run(milliseconds(750));
  EXPECT_GT(Health().still_regions, 0U);
  EXPECT_EQ(EventsWith(id, "degraded: not known to step yet: region"), 1U);
}

TEST_F(ClusterHealthTest, ADeathThatCannotBeStoredIsNotCalledRunning) {
  const std::string id = Start(harness_, 4);
  harness_.store.FailNext(1000);
  FakeHost& agent = harness_.AgentOf(id, 2);
  harness_.Send(agent, agent.fake.Kill({id, 2}, 9));
  const v1::Instance degraded = harness_.Get(id);
  EXPECT_EQ(degraded.state(), v1::INSTANCE_STATE_DEGRADED) << "at once";
  EXPECT_THAT(degraded.reason(), HasSubstr("its next step is not stored: "));
  EXPECT_THAT(degraded.reason(), HasSubstr("region 2 on "));
  EXPECT_THAT(degraded.reason(), HasSubstr("has ended: worker was killed by signal 9"));
  harness_.Run(seconds(5));
  EXPECT_EQ(harness_.Get(id).state(), v1::INSTANCE_STATE_DEGRADED);
  harness_.store.FailNext(0);
  harness_.Run(seconds(10));
  EXPECT_EQ(harness_.Get(id).state(), v1::INSTANCE_STATE_RUNNING) << harness_.Get(id).reason();
  EXPECT_EQ(harness_.Get(id).failovers(), 1U);
}

TEST_F(ClusterHealthTest, ALastingCutBetweenNeighboursIsNamed) {
  const std::string id = Start(harness_, 2);
  for (auto& [name, agent] : harness_.agents) agent.fake.unlinked = {2};
  // An order makes them look at their links.
  ASSERT_TRUE(harness_.cluster().Join(harness_.now, JoinRequest(id)).ok());
  harness_.Run(seconds(4));
  EXPECT_EQ(harness_.Get(id).state(), v1::INSTANCE_STATE_RUNNING);
  harness_.Run(seconds(2));
  EXPECT_EQ(harness_.Get(id).state(), v1::INSTANCE_STATE_DEGRADED);
  EXPECT_EQ(harness_.Get(id).reason(), "regions 1 and 2 have no link");
  EXPECT_EQ(Health().cut_links, 1U);
  EXPECT_EQ(EventsWith(id, "degraded: regions 1 and 2 have no link"), 1U);
}

TEST_F(ClusterHealthTest, AWorldOfOneRegionHasNoStandbyByItsNature) {
  const std::string id = Start(harness_, 1);
  harness_.Run(seconds(10));
  EXPECT_EQ(harness_.Get(id).state(), v1::INSTANCE_STATE_RUNNING) << "alone it has none by its nature";
  EXPECT_THAT(harness_.Get(id).unprotected_regions(), SizeIs(0));
}

}  // namespace
}  // namespace tessera::control
