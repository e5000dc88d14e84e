// The life of an instance on its record and entries alone. The states themselves are tested in life_test.cpp.
#include "control_plane/cluster/instances.h"

#include <gmock/gmock.h>

#include <algorithm>

#include "control_plane/cluster/hosts.h"
#include "control_plane/testing/state_rig.h"

namespace tessera::control {
namespace {

using std::chrono::milliseconds;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

class InstancesTest : public ::testing::Test {
 protected:
  void Enter(const std::optional<records::Instance>& next) {
    ASSERT_TRUE(next.has_value());
    const v1::InstanceState previous = instance_.record.state();
    ASSERT_TRUE(rig_.state->StoreInstance(instance_, *next).ok());
    instances_.Entered(instance_, previous, rig_.now);
  }
  void SetState(v1::InstanceState state) {
    records::Instance next = instance_.record;
    next.set_state(state);
    Enter(next);
  }

  StateRig rig_;
  HostEntry &alpha_ = rig_.AddHost("alpha"), &beta_ = rig_.AddHost("beta");
  InstanceEntry& instance_ = rig_.AddRunning({&alpha_, &beta_});
  Instances instances_{*rig_.state, rig_.settings};
};

TEST_F(InstancesTest, StopsEndsAndIsForgotten) {
  EXPECT_FALSE(instances_.NextInLife(instance_, 0, rig_.now)) << "it runs in good health";
  Enter(Instances::NextStopped(instance_));
  EXPECT_FALSE(Instances::NextStopped(instance_)) << "once";
  EXPECT_TRUE(alpha_.desired_changed);
  for (WorkerEntry& worker : instance_.workers) rig_.state->SetGone(instance_, worker, "");
  Enter(instances_.NextInLife(instance_, 0, rig_.now));
  EXPECT_EQ(instance_.record.state(), v1::INSTANCE_STATE_ENDED);
  rig_.Pass(rig_.settings.keep_ended);
  EXPECT_THAT(instances_.ForgetEnded(rig_.now), ElementsAre());
  rig_.Pass(milliseconds(1));
  EXPECT_THAT(instances_.ForgetEnded(rig_.now), ElementsAre(1));
  EXPECT_TRUE(rig_.state->instances().empty());
  EXPECT_THAT(rig_.state->effects().forgotten, ElementsAre("inst-1"));
}

TEST_F(InstancesTest, WorkersThatDoNotEndAreWithdrawnAfterTheGrace) {
  Enter(Instances::NextStopped(instance_));
  rig_.Pass(rig_.settings.stop_grace);
  instances_.WithdrawLate(instance_, rig_.now);
  EXPECT_FALSE(instance_.withdrawn);
  rig_.Pass(milliseconds(1));
  instances_.WithdrawLate(instance_, rig_.now);
  EXPECT_TRUE(instance_.withdrawn);
}

TEST_F(InstancesTest, WhatTakesLongIsLoggedOnceAMinute) {
  SetState(v1::INSTANCE_STATE_STARTING);
  const auto said = [&] {
    const auto& log = rig_.state->effects().log;
    return std::count_if(log.begin(), log.end(),
                         [](const LogLine& line) { return line.text.starts_with("still under way id=inst-1 op="); });
  };
  const auto pass = [&](std::chrono::seconds span) {
    for (; span.count() > 0; span -= std::chrono::seconds(1)) {
      instances_.NoteHealth(instance_, rig_.now);
      rig_.Pass(std::chrono::seconds(1));
    }
  };
  pass(std::chrono::seconds(60));
  EXPECT_EQ(said(), 0) << "most starts take seconds";
  pass(std::chrono::seconds(1));
  EXPECT_EQ(said(), 1);
  EXPECT_THAT(rig_.state->effects().log.back().text, HasSubstr(" minutes=1: starts"));
  pass(std::chrono::seconds(120));
  EXPECT_EQ(said(), 3);
  SetState(v1::INSTANCE_STATE_RUNNING);
  pass(std::chrono::seconds(120));
  EXPECT_EQ(said(), 3) << "nothing is under way any more";
}

TEST_F(InstancesTest, ALostHostDegradesARunningInstance) {
  instances_.NoteHealth(instance_, rig_.now);
  EXPECT_EQ(instance_.degraded, "");
  beta_.lost = true;
  instances_.NoteHealth(instance_, rig_.now);
  EXPECT_EQ(instance_.degraded, "host beta is silent: region 2");
  beta_.lost = false;
  instances_.NoteHealth(instance_, rig_.now);
  EXPECT_EQ(instance_.degraded, "");
}

TEST_F(InstancesTest, WhilePlacingItLooksForOtherHostsIfItsOwnAreNotReady) {
  SetState(v1::INSTANCE_STATE_PLACING);
  EXPECT_EQ(instances_.NextPlaced(instance_, rig_.now)->state(), v1::INSTANCE_STATE_STARTING);
  beta_.lost = true;
  const auto moved = instances_.NextPlaced(instance_, rig_.now);
  ASSERT_TRUE(moved.has_value());
  EXPECT_EQ(moved->placements(1).host_id(), alpha_.record.id());
  EXPECT_GT(moved->placements(1).incarnation(), instance_.record.last_incarnation());
  alpha_.lost = true;
  Enter(instances_.NextPlaced(instance_, rig_.now));
  EXPECT_EQ(instance_.record.state(), v1::INSTANCE_STATE_PLACING);
  EXPECT_THAT(instance_.record.reason(), HasSubstr("no host is ready"));
  EXPECT_FALSE(instances_.NextPlaced(instance_, rig_.now)) << "said once";
  rig_.Pass(rig_.settings.start_timeout);
  Enter(instances_.NextPlaced(instance_, rig_.now));
  EXPECT_EQ(instance_.record.state(), v1::INSTANCE_STATE_FAILED);
}

}  // namespace
}  // namespace tessera::control
