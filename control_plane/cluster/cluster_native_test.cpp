// Worlds that run a native game, through the whole cluster: where they are placed, and what ends them.
#include <gmock/gmock.h>

#include "control_plane/testing/cluster_harness.h"

namespace tessera::control {
namespace {

using std::chrono::seconds;
using ::testing::HasSubstr;
using ::testing::StartsWith;

const std::string kBuildA(64, 'a'), kBuildB(64, 'b');

class ClusterNativeTest : public ::testing::Test {
 protected:
  FakeHost& AddHost(const std::string& name, const std::string& build) {
    FakeHost& agent = harness_.AddHost(name, 8);
    if (!build.empty()) SetBuild(agent, build);
    return agent;
  }
  void SetBuild(FakeHost& agent, const std::string& build) {
    v1::AgentMessage message;
    v1::GameModule& module = *message.mutable_game_modules()->add_modules();
    module.set_name("arena");
    module.set_hash(build);
    module.set_abi(1);
    module.set_movement(true);
    harness_.Send(agent, message);
    EXPECT_NE(agent.stream, 0U) << "the message was refused";
  }
  static InstancePlan Plan(std::uint32_t regions, const std::string& build = "") {
    InstancePlan plan = TestPlan(regions);
    plan.game_name = "arena";
    plan.game_hash = build;
    plan.game_native = true;
    return plan;
  }
  // A game in Lua with the library's movement.
  static InstancePlan PlanMoving(std::uint32_t regions, const std::string& build = "") {
    InstancePlan plan = TestPlan(regions);
    plan.game_name = "drive.lua";
    plan.game_hash = std::string(64, 'c');
    plan.contents.game = "x = 1";
    plan.movement.emplace();
    plan.movement->set_name("arena");
    plan.movement->set_hash(build);
    return plan;
  }
  std::string Run(std::uint32_t regions) { return Run(Plan(regions)); }
  std::string Run(const InstancePlan& plan) {
    const std::string id = Create(harness_, plan);
    harness_.Run(seconds(1));
    EXPECT_EQ(harness_.Get(id).state(), v1::INSTANCE_STATE_RUNNING);
    return id;
  }
  std::string Refusal(const InstancePlan& plan) {
    const auto made = harness_.cluster().CreateInstance(harness_.now, plan, false);
    EXPECT_EQ(made.status().code(), absl::StatusCode::kFailedPrecondition) << made.status();
    EXPECT_TRUE(harness_.cluster().state().instances().empty());
    return std::string(made.status().message());
  }
  void DieInGame(const std::string& id, std::uint32_t region) {
    FakeHost& agent = harness_.AgentOf(id, region);
    v1::AgentMessage message = agent.fake.Kill({id, region}, 11);
    message.mutable_exited()->set_died_in_game("arena: Segmentation fault in kinds.ball.on_contact");
    harness_.Send(agent, message);
  }

  ClusterHarness harness_;
};

TEST_F(ClusterNativeTest, RunsOnHostsThatHaveTheGameAndNowhereElse) {
  AddHost("alpha", kBuildA);
  FakeHost& beta = AddHost("beta", "");
  AddHost("gamma", kBuildA);
  const std::string id = Run(4);
  EXPECT_TRUE(beta.fake.workers.empty());
  const v1::WorkerOrder& order = harness_.AgentOf(id, 1).fake.workers.at({id, 1}).order;
  EXPECT_TRUE(order.game_native());
  EXPECT_EQ(order.game_name(), "arena");
  EXPECT_EQ(order.game_hash(), kBuildA) << "the build that the hosts have";
  EXPECT_TRUE(harness_.Get(id).game_native());
  // A worker that dies is replaced by one on a host that has it, too.
  FakeHost& agent = harness_.AgentOf(id, 2);
  harness_.Send(agent, agent.fake.Kill({id, 2}, 9));
  harness_.Run(seconds(10));
  EXPECT_EQ(harness_.Get(id).map().regions_size(), 4);
  EXPECT_TRUE(beta.fake.workers.empty());
}

TEST_F(ClusterNativeTest, IsRefusedByTheHostsThatLackIt) {
  AddHost("alpha", "");
  AddHost("beta", kBuildB);
  EXPECT_EQ(Refusal(Plan(1, kBuildA)),
            "spec.native_game: no host that takes regions has native:arena@aaaaaaaa: alpha (has no such game module), "
            "beta (has build bbbbbbbb)");
}

TEST_F(ClusterNativeTest, DifferentBuildsWithoutAChoiceAreRefused) {
  AddHost("alpha", kBuildA);
  AddHost("beta", kBuildB);
  EXPECT_THAT(Refusal(Plan(1)), StartsWith("spec.native_game: hosts have different builds of native:arena"));
}

TEST_F(ClusterNativeTest, AHostThatGetsTheGameLaterTakesRegionsFromThenOnAndAfterARestart) {
  FakeHost& alpha = AddHost("alpha", "");
  EXPECT_THAT(Refusal(Plan(1)), HasSubstr("no such game module"));
  SetBuild(alpha, kBuildA);
  harness_.Restart();
  const auto placed = harness_.cluster().CreateInstance(harness_.now, Plan(1), true);
  EXPECT_TRUE(placed.ok()) << placed.status();
}

TEST_F(ClusterNativeTest, ItsGameIsNotChangedWhileItRuns) {
  AddHost("alpha", kBuildA);
  const std::string id = Run(2);
  v1::SetGameRequest request;
  request.set_id(id);
  request.mutable_game()->set_name("arena.lua");
  const auto changed = harness_.cluster().SetGame(harness_.now, request, "feed");
  EXPECT_EQ(changed.status().message(), "id: " + id +
                                            " runs native:arena@aaaaaaaa, and a native game is not changed "
                                            "while its world runs");
}

TEST_F(ClusterNativeTest, ADeathInTheGameIsCarriedOnAndSaysSo) {
  AddHost("alpha", kBuildA);
  AddHost("beta", kBuildA);
  const std::string id = Run(4);
  DieInGame(id, 2);
  harness_.Run(seconds(10));
  const v1::Instance instance = harness_.Get(id);
  EXPECT_EQ(instance.state(), v1::INSTANCE_STATE_RUNNING);
  EXPECT_EQ(instance.failovers(), 1U);
  ASSERT_FALSE(instance.events().empty());
  EXPECT_THAT(instance.events(0).text(),
              HasSubstr("worker died in game module arena: Segmentation fault in kinds.ball.on_contact"));
}

TEST_F(ClusterNativeTest, TheThirdInARowStopsTheWorldForGood) {
  AddHost("alpha", kBuildA);
  AddHost("beta", kBuildA);
  const std::string id = Run(4);
  for (const std::uint32_t region : {1, 2}) {
    DieInGame(id, region);
    harness_.Run(seconds(3));
    EXPECT_EQ(harness_.Get(id).state(), v1::INSTANCE_STATE_RUNNING) << region;
  }
  harness_.Restart();  // the count is stored
  harness_.Run(seconds(1));
  DieInGame(id, 3);
  const v1::Instance instance = harness_.Get(id);
  EXPECT_EQ(instance.state(), v1::INSTANCE_STATE_FAILED);
  EXPECT_THAT(instance.reason(), HasSubstr("native:arena@aaaaaaaa crashed 3 workers in a row"));
  EXPECT_THAT(instance.reason(), HasSubstr("region 3 on "));
  EXPECT_THAT(instance.reason(), HasSubstr("Segmentation fault in kinds.ball.on_contact"));
  harness_.Run(seconds(15));
  EXPECT_EQ(harness_.Workers(), 0U);
  EXPECT_EQ(harness_.Get(id).state(), v1::INSTANCE_STATE_FAILED);
}

TEST_F(ClusterNativeTest, AMinuteOfStepsForgives) {
  AddHost("alpha", kBuildA);
  AddHost("beta", kBuildA);
  const std::string id = Run(4);
  for (const std::uint32_t region : {1, 2, 3, 4}) {
    DieInGame(id, region);
    harness_.Run(seconds(65));
    EXPECT_EQ(harness_.Get(id).state(), v1::INSTANCE_STATE_RUNNING) << region;
  }
}

TEST_F(ClusterNativeTest, AMovementIsNeededAndOrderedAsANativeGameIs) {
  AddHost("alpha", kBuildA);
  FakeHost& beta = AddHost("beta", "");
  AddHost("gamma", kBuildA);
  const std::string id = Run(PlanMoving(4));
  EXPECT_TRUE(beta.fake.workers.empty());
  const v1::WorkerOrder& order = harness_.AgentOf(id, 1).fake.workers.at({id, 1}).order;
  EXPECT_FALSE(order.game_native());
  EXPECT_EQ(order.game_name(), "drive.lua");
  EXPECT_EQ(order.movement_name(), "arena");
  EXPECT_EQ(order.movement_hash(), kBuildA) << "the build that the hosts have";
  EXPECT_EQ(harness_.Get(id).movement().hash(), kBuildA);
  for (const std::uint32_t region : {1, 2, 3}) {
    DieInGame(id, region);
    harness_.Run(seconds(3));
  }
  EXPECT_EQ(harness_.Get(id).state(), v1::INSTANCE_STATE_FAILED);
  EXPECT_THAT(harness_.Get(id).reason(), HasSubstr("the movement native:arena@aaaaaaaa crashed 3 workers in a row"));
}

TEST_F(ClusterNativeTest, AMovementThatNoHostHasIsRefusedByItsField) {
  AddHost("alpha", kBuildB);
  EXPECT_EQ(Refusal(PlanMoving(1, kBuildA)),
            "spec.movement: no host that takes regions has native:arena@aaaaaaaa: alpha (has build bbbbbbbb)");
}

TEST_F(ClusterNativeTest, OtherDeathsDoNotCount) {
  AddHost("alpha", kBuildA);
  AddHost("beta", kBuildA);
  const std::string id = Run(4);
  for (const std::uint32_t region : {1, 2, 3}) {
    FakeHost& agent = harness_.AgentOf(id, region);
    harness_.Send(agent, agent.fake.Kill({id, region}, 9));
    harness_.Run(seconds(3));
  }
  EXPECT_EQ(harness_.Get(id).state(), v1::INSTANCE_STATE_RUNNING);
}

}  // namespace
}  // namespace tessera::control
