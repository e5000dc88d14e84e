// Players who vanish without leaving, under a virtual clock: grace, and what each policy makes of them.
#include <gmock/gmock.h>

#include "control_plane/testing/cluster_harness.h"

namespace tessera::control {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

// One region, two players, a grace of 10 s.
class LeaversTest : public ::testing::Test {
 protected:
  void Start(v1::LeaverPolicy policy) {
    harness_.AddHost("alpha", 4);
    InstancePlan plan = TestPlan(1);
    plan.leaver_policy = policy;
    plan.leaver_grace = seconds(10);
    const auto made = harness_.cluster().CreateInstance(harness_.now, plan, false);
    ASSERT_TRUE(made.ok()) << made.status();
    id_ = made->id();
    harness_.Pump();
    v1::JoinInstanceRequest join;
    join.set_instance_id(id_);
    for (int i = 0; i < 2; ++i) ASSERT_TRUE(harness_.cluster().Join(harness_.now, join).ok());
    harness_.Run(seconds(1));
    ASSERT_EQ(Worker().report.connected_players_size(), 2);
  }

  FakeWorker& Worker() { return harness_.agents["alpha"].fake.workers.at({id_, 1}); }

  // The worker reports these players from now on.
  void Connected(std::initializer_list<std::uint32_t> players) {
    harness_.agents["alpha"].fake.connect_players = false;
    v1::WorkerReport& report = Worker().report;
    report.clear_connected_players();
    for (const std::uint32_t player : players) report.add_connected_players(player);
    v1::AgentMessage message;
    *message.mutable_report() = report;
    harness_.Send(harness_.agents["alpha"], message);
  }

  const v1::Player& Ordered(std::uint32_t player) {
    for (const v1::Player& ordered : Worker().order.players()) {
      if (ordered.number() == player) return ordered;
    }
    static const v1::Player none;
    return none;
  }

  ClusterHarness harness_;
  std::string id_;
};

TEST_F(LeaversTest, StaysInTheWorldUnlessTheInstanceSaysOtherwise) {
  Start(v1::LEAVER_POLICY_STAY);
  Connected({1});
  harness_.Run(seconds(100));
  EXPECT_FALSE(Ordered(2).parked());
  EXPECT_FALSE(Ordered(2).left());
  EXPECT_EQ(harness_.Get(id_).players(), 2u);
}

TEST_F(LeaversTest, IsParkedAfterTheGraceUntilItIsBack) {
  Start(v1::LEAVER_POLICY_PARK);
  Connected({1});
  harness_.Run(milliseconds(9500));
  EXPECT_FALSE(Ordered(2).parked());
  harness_.Run(seconds(1));
  EXPECT_TRUE(Ordered(2).parked());
  EXPECT_FALSE(Ordered(1).parked());
  EXPECT_EQ(harness_.Get(id_).players(), 2u);
  Connected({1, 2});
  harness_.Pump();  // no time passes
  EXPECT_FALSE(Ordered(2).parked());
}

TEST_F(LeaversTest, WhoIsBackInTimeBeginsANewGrace) {
  Start(v1::LEAVER_POLICY_REMOVE);
  Connected({1});
  harness_.Run(seconds(9));
  Connected({1, 2});
  harness_.Run(seconds(5));
  Connected({1});
  harness_.Run(seconds(9));
  EXPECT_FALSE(Ordered(2).left());
  harness_.Run(seconds(2));
  EXPECT_TRUE(Ordered(2).left());
  EXPECT_FALSE(Ordered(1).left());
  EXPECT_EQ(harness_.Get(id_).players(), 1u);
}

TEST_F(LeaversTest, ANewControlPlaneKeepsWhoIsParkedAndCountsTheGraceAnew) {
  Start(v1::LEAVER_POLICY_PARK);
  Connected({});
  harness_.Run(seconds(11));
  ASSERT_TRUE(Ordered(1).parked());
  Connected({1});
  harness_.Run(seconds(6));
  Connected({});
  harness_.Run(seconds(6));
  harness_.Restart();
  harness_.Run(seconds(6));
  EXPECT_FALSE(Ordered(1).parked());
  EXPECT_TRUE(Ordered(2).parked());
  harness_.Run(seconds(6));
  EXPECT_TRUE(Ordered(1).parked());
}

}  // namespace
}  // namespace tessera::control
