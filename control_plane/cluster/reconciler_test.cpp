// Steps of an instance by all parts that propose them, on records and entries alone.
#include "control_plane/cluster/reconciler.h"

#include <gmock/gmock.h>

#include <string>

#include "control_plane/testing/state_rig.h"

namespace tessera::control {
namespace {

using ::testing::ElementsAre;
using ::testing::Field;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

class ReconcilerTest : public ::testing::Test {
 protected:
  // Asks the instance to stop; its workers have ended.
  void StopWithAllWorkersGone() {
    ASSERT_TRUE(reconciler_.Enter(rig_.now, instance_, *Instances::NextStopped(instance_)).ok());
    for (WorkerEntry& worker : instance_.workers) rig_.state->SetGone(instance_, worker, "");
    rig_.state->effects().log.clear();
  }

  StateRig rig_;
  HostEntry &alpha_ = rig_.AddHost("alpha"), &beta_ = rig_.AddHost("beta");
  InstanceEntry& instance_ = rig_.AddRunning({&alpha_, &beta_});
  Instances instances_{*rig_.state, rig_.settings};
  PlannedChanges changes_{*rig_.state, rig_.settings};
  Failovers failovers_{*rig_.state, rig_.settings};
  InstanceCheckpoints checkpoints_{*rig_.state};
  InstancePlayers players_{*rig_.state, rig_.settings};
  Reconciler reconciler_{*rig_.state, {instances_, changes_, failovers_, checkpoints_, players_}};
};

TEST_F(ReconcilerTest, WhatRunsInGoodHealthStaysAsItIs) {
  const std::string before = instance_.record.SerializeAsString();
  reconciler_.Reconcile(rig_.now, InstanceNumbers{instance_.number});
  EXPECT_EQ(instance_.record.SerializeAsString(), before);
  EXPECT_EQ(instance_.degraded, "");
}

TEST_F(ReconcilerTest, LeadsAStoppedInstanceToItsEnd) {
  StopWithAllWorkersGone();
  reconciler_.Reconcile(rig_.now, instance_);
  EXPECT_EQ(instance_.record.state(), v1::INSTANCE_STATE_ENDED);
}

TEST_F(ReconcilerTest, AStepThatCannotBeStoredIsLoggedOnceAndTakenLater) {
  StopWithAllWorkersGone();
  rig_.store.FailNext(2);
  reconciler_.Reconcile(rig_.now, instance_);
  reconciler_.Reconcile(rig_.now, instance_);
  EXPECT_EQ(instance_.record.state(), v1::INSTANCE_STATE_STOPPING);
  EXPECT_THAT(rig_.state->effects().log,
              ElementsAre(Field(&LogLine::text, HasSubstr("store cannot be written")),
                          Field(&LogLine::text, HasSubstr("instance cannot go on for now id=inst-1"))));
  EXPECT_EQ(rig_.state->effects().log[0].severity, Severity::kError);
  reconciler_.Reconcile(rig_.now, instance_);
  EXPECT_EQ(instance_.record.state(), v1::INSTANCE_STATE_ENDED);
  EXPECT_THAT(instance_.trouble, IsEmpty());
}

// A world whose dead region cannot be carried on, because that cannot be stored, is not in good health.
TEST_F(ReconcilerTest, AWorldWhoseStepCannotBeStoredIsDegradedUntilItCan) {
  rig_.state->SetGone(instance_, instance_.workers[0], "was killed by signal 9");
  rig_.store.FailNext(1);
  reconciler_.Reconcile(rig_.now, instance_);
  EXPECT_FALSE(instance_.record.has_failover());
  EXPECT_THAT(instance_.degraded, HasSubstr("its next step is not stored"));
  EXPECT_THAT(rig_.state->store_trouble(), Not(IsEmpty()));
  EXPECT_EQ(rig_.state->failed_writes(), 1u);

  reconciler_.Reconcile(rig_.now, instance_);
  EXPECT_THAT(instance_.degraded, Not(HasSubstr("is not stored")));
  EXPECT_THAT(rig_.state->store_trouble(), IsEmpty());
}

// One that wants no step goes on as before: that the store is full is not its fault.
TEST_F(ReconcilerTest, AFullStoreDegradesNoWorldThatWantsNoStep) {
  rig_.store.FailNext(1);
  EXPECT_FALSE(rig_.state->StoreHost(alpha_, alpha_.record).ok());
  reconciler_.Reconcile(rig_.now, instance_);
  EXPECT_EQ(instance_.degraded, "");
}

}  // namespace
}  // namespace tessera::control
