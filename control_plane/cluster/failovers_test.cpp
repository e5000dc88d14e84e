// Failovers on records and entries alone: the walk of a death, step by step.
#include "control_plane/cluster/failovers.h"

#include <gmock/gmock.h>

#include <algorithm>

#include "control_plane/cluster/orders.h"
#include "control_plane/standbys.h"
#include "control_plane/testing/state_rig.h"

namespace tessera::control {
namespace {

using std::chrono::milliseconds;
using ::testing::EndsWith;
using ::testing::HasSubstr;

const CutBetween kNoCuts = [](RegionId, RegionId) { return false; };

// Regions 1 and 2 on alpha, 3 and 4 on beta.
class FailoversTest : public ::testing::Test {
 protected:
  // Stores the step as Cluster does. False: there was none.
  bool Take(const FailoverStep& step) {
    const Players& players = step.players ? *step.players : instance_.players;
    return step.next && rig_.state->StoreWithPlayers(instance_, *step.next, players).ok();
  }
  // Tells it as Cluster does. False: there was nothing to tell.
  bool Tell(const FailoverStep& step) {
    instance_.told.reset();
    if (step.told) instance_.told = {*step.told, step.players.value_or(instance_.players)};
    return step.told.has_value();
  }
  FailoverStep Next() { return failovers_.Next(instance_, kNoCuts, rig_.now); }

  // The region owns one body, and holds a copy of each dead primary of its with one body.
  void SendInventory(std::uint32_t region) {
    const WorkerEntry& worker = StateRig::WorkerOf(instance_, region);
    v1::InventoryReport report;
    *report.mutable_identity() = StateRig::IdentityOf(instance_, worker);
    v1::Inventory& inventory = *report.mutable_inventory();
    inventory.set_version(instance_.record.map().version());
    inventory.set_region(region);
    inventory.set_tick(100);
    Own(region, *inventory.mutable_owned());
    for (const records::Dead& dead : instance_.record.failover().dead()) {
      if (dead.standby() != region) continue;
      v1::StandbyCopyInventory& copy = *inventory.add_standby_copies();
      copy.set_region(dead.region());
      copy.set_incarnation(dead.incarnation());
      copy.set_tick(100);
      Own(dead.region(), *copy.mutable_bodies());
    }
    const auto* host = rig_.state->FindHost(
        instance_.record.placements(static_cast<int>(&worker - instance_.workers.data())).host_id());
    EXPECT_EQ(failovers_.NoteInventory(*host, report, rig_.now), &instance_);
  }
  static void Own(std::uint32_t region, v1::BodyEpochs& bodies) {
    bodies.add_bodies(1000 * region);
    bodies.add_epochs(1);
  }
  // Alpha's agent and workers are heard, beta's agent is not.
  void PassWithoutBeta(milliseconds span) {
    const Steady last = beta_.last_heard;
    rig_.Pass(span);
    beta_.last_heard = last;
    for (WorkerEntry& worker : instance_.workers) {
      if (worker.region <= 2 && !worker.gone) worker.reported_at = rig_.now.steady;
    }
  }
  bool Runs(std::uint32_t region) const {
    return std::any_of(instance_.workers.begin(), instance_.workers.end(),
                       [region](const WorkerEntry& worker) { return worker.region == region; });
  }
  // Region 1 dies while beta, which has its standby, is silent. Gives the standby, which is waited for by name.
  std::uint32_t LoseWhileBetaIsSilent() {
    const std::uint32_t standby = StandbyOf(instance_.record, 1);
    EXPECT_GE(standby, 3U) << "on beta";
    beta_.last_heartbeat_time = std::chrono::seconds(1'576'800'000);
    PassWithoutBeta(rig_.settings.failover_after + milliseconds(1));
    rig_.state->SetGone(instance_, StateRig::WorkerOf(instance_, 1), "killed");
    EXPECT_TRUE(Take(Next()));
    EXPECT_TRUE(Runs(standby)) << "it is only silent";
    EXPECT_TRUE(Take(Next())) << "an event says so";
    SendInventory(2);
    return standby;
  }
  void KeepCheckpoint() {
    records::Instance next = instance_.record;
    next.add_checkpoints()->set_tick(50);
    ASSERT_TRUE(rig_.state->StoreInstance(instance_, next).ok());
  }
  void ResumeAll() {
    for (WorkerEntry& worker : instance_.workers) worker.report.set_map_version(instance_.record.map().version());
  }

  // Region 3 dies and is carried on within 100 ms.
  void CarryOn3() {
    rig_.state->SetGone(instance_, StateRig::WorkerOf(instance_, 3), "worker was killed by signal 9");
    ASSERT_TRUE(Take(Next()));
    for (const std::uint32_t region : {1, 2, 4}) SendInventory(region);
    ASSERT_TRUE(Tell(Next()));
    ASSERT_TRUE(Take(Next()));
    rig_.Pass(milliseconds(100));
    ResumeAll();
    ASSERT_TRUE(Take(Next()));
    ASSERT_FALSE(instance_.record.has_failover());
  }
  // As the regions report it of their last failover.
  void SetGaps(std::uint64_t gap_ms) {
    for (WorkerEntry& worker : instance_.workers) worker.report.set_last_gap_ms(gap_ms);
  }
  std::string LastEvent() const { return instance_.record.events().rbegin()->text(); }

  StateRig rig_;
  HostEntry &alpha_ = rig_.AddHost("alpha"), &beta_ = rig_.AddHost("beta");
  InstanceEntry& instance_ = rig_.AddRunning({&alpha_, &alpha_, &beta_, &beta_});
  Failovers failovers_{*rig_.state, rig_.settings};
};

TEST_F(FailoversTest, OnlyTheHostThatRanAWorkerSaysThatItEnded) {
  const WorkerEntry& silent = StateRig::WorkerOf(instance_, 3);
  v1::WorkerExited exited;
  *exited.mutable_identity() = StateRig::IdentityOf(instance_, silent);
  records::Instance next = instance_.record;
  records::Dead& dead = *next.mutable_failover()->add_dead();
  dead.set_region(3);
  dead.set_incarnation(silent.incarnation);
  dead.set_host_id(beta_.record.id());
  ASSERT_TRUE(rig_.state->StoreInstance(instance_, next).ok());
  EXPECT_EQ(failovers_.NoteExit(alpha_, exited), nullptr) << "its lease has to run out";
  EXPECT_EQ(failovers_.NoteExit(beta_, exited), &instance_);
}

// Its own time counts from when it is known that somebody died.
TEST_F(FailoversTest, ItsEventSaysHowLongTheWorldStoodFromTheLastSignOfTheDeadOn) {
  for (WorkerEntry& worker : instance_.workers) worker.reported_at = rig_.now.steady;
  rig_.Pass(milliseconds(4000));
  CarryOn3();
  EXPECT_THAT(LastEvent(), EndsWith(": 1 bodies promoted, 0 lost, 100 ms; the world stood up to 4100 ms"));
  EXPECT_FALSE(Take(Next()));
  SetGaps(4300);
  EXPECT_FALSE(Take(Next())) << "about as long";
  SetGaps(91'456);
  EXPECT_TRUE(Take(Next()));
  EXPECT_EQ(LastEvent(), "the world stood 91456 ms for the failover before, as its regions say");
  EXPECT_FALSE(Take(Next())) << "once";
}

// Nobody led when the worker died: its neighbours alone know since when they have stood.
TEST_F(FailoversTest, OfADeathInAnEarlierLifeTheRegionsSayHowLongTheWorldStood) {
  SetGaps(50'000);  // by an earlier failover
  WorkerEntry& dead = StateRig::WorkerOf(instance_, 3);
  dead.reported_at = dead.witnessed_at = Steady(0);
  CarryOn3();
  EXPECT_THAT(LastEvent(), EndsWith(": 1 bodies promoted, 0 lost, 100 ms"));
  EXPECT_FALSE(Take(Next())) << "an earlier failover's";
  SetGaps(91'456);
  EXPECT_TRUE(Take(Next()));
  EXPECT_EQ(LastEvent(), "the world stood 91456 ms for the failover before, as its regions say");
}

TEST_F(FailoversTest, AWorldThatIsPausedStandsForNoFailover) {
  records::Instance paused = instance_.record;
  paused.mutable_map()->mutable_terms()->set_paused(true);
  ASSERT_TRUE(rig_.state->StoreInstance(instance_, paused).ok());
  CarryOn3();
  EXPECT_THAT(LastEvent(), EndsWith(" lost, 100 ms"));
  SetGaps(91'456);
  EXPECT_FALSE(Take(Next()));
}

TEST_F(FailoversTest, AnExitIsWalkedFromTheMapWithoutItToTheWorldThatRunsAgain) {
  EXPECT_FALSE(Take(Next())) << "nobody is dead";
  WorkerEntry& dead = StateRig::WorkerOf(instance_, 3);
  const std::uint32_t standby = StandbyOf(instance_.record, 3);
  rig_.state->SetGone(instance_, dead, "worker was killed by signal 9");

  ASSERT_TRUE(Take(Next()));  // declared dead
  EXPECT_EQ(instance_.record.map().version(), 2U);
  EXPECT_EQ(instance_.workers.size(), 3U);
  EXPECT_EQ(instance_.record.failover().dead(0).standby(), standby);
  EXPECT_THAT(instance_.record.events(0).text(), HasSubstr("region 3 on beta: worker was killed by signal 9"));

  for (const std::uint32_t region : {1, 2, 4}) {
    EXPECT_FALSE(Take(Next())) << "waits for inventories";
    SendInventory(region);
  }
  ASSERT_TRUE(Tell(Next()));  // resolved
  EXPECT_FALSE(instance_.record.failover().has_resolution());
  EXPECT_EQ(MakeOrder(instance_, 0, {}).resolution().takeovers_size(), 1) << "nobody waits for the store";
  ASSERT_TRUE(Take(Next()));
  EXPECT_FALSE(instance_.told) << "the record has it";
  ASSERT_EQ(instance_.record.failover().resolution().takeovers_size(), 1);
  EXPECT_EQ(instance_.record.failover().resolution().takeovers(0).region(), standby);
  EXPECT_EQ(instance_.record.failover().resolution().takeovers(0).body(), 3000U);

  EXPECT_FALSE(Take(Next())) << "waits until all run by the new map";
  ResumeAll();
  ASSERT_TRUE(Take(Next()));  // resumed
  EXPECT_FALSE(instance_.record.has_failover());
  EXPECT_THAT(instance_.record.events(1).text(), HasSubstr("1 bodies promoted, 0 lost"));
  EXPECT_EQ(rig_.state->effects().failovers.size(), 1U);
  EXPECT_FALSE(Take(Next()));
}

TEST_F(FailoversTest, ASilentWorkerIsDeadOnlyWhileItsStandbyIsHeardAndSaysNothingOfIt) {
  PassWithoutBeta(rig_.settings.failover_after);
  EXPECT_FALSE(Next().next) << "not for long enough";
  for (WorkerEntry& worker : instance_.workers) worker.witnessed_at = rig_.now.steady;
  PassWithoutBeta(milliseconds(1));
  EXPECT_FALSE(Next().next) << "a witness has seen it alive";
  for (WorkerEntry& worker : instance_.workers) worker.witnessed_at = Steady(0);
  const FailoverStep step = Next();
  ASSERT_TRUE(step.next);
  EXPECT_EQ(step.next->failover().dead_size(), 2);
  EXPECT_FALSE(step.next->failover().dead(0).exit_seen());
  for (WorkerEntry& worker : instance_.workers) worker.report.clear_standby_copies();
  EXPECT_FALSE(Next().next) << "nobody could carry it on, and it may well run";
}

TEST_F(FailoversTest, WhoIsSilentIsWaitedForUntilTheLeaseHasRunOut) {
  const WorkerEntry& worker = StateRig::WorkerOf(instance_, 3);
  v1::LeaseRequest request;
  *request.mutable_identity() = StateRig::IdentityOf(instance_, worker);
  failovers_.RenewLease(beta_, request, rig_.now);
  EXPECT_EQ(rig_.state->effects().leases.size(), 1U);
  failovers_.RenewLease(alpha_, request, rig_.now);
  EXPECT_EQ(rig_.state->effects().leases.size(), 1U) << "alpha does not run it";
  for (WorkerEntry& silent : instance_.workers) silent.leased_at = rig_.now.steady;
  alpha_.last_heard = beta_.last_heard + rig_.settings.failover_after;
  for (const std::uint32_t region : {1, 2}) StateRig::WorkerOf(instance_, region).reported_at = alpha_.last_heard;
  rig_.now.steady += rig_.settings.failover_after + milliseconds(1);
  ASSERT_TRUE(Take(Next()));
  for (const std::uint32_t region : {1, 2}) SendInventory(region);
  EXPECT_FALSE(Take(Next())) << "the standbys have just renewed";
  rig_.now.steady += kLeaseTtl + kLeaseDrift;
  ASSERT_TRUE(Tell(Next()));
  ASSERT_TRUE(Take(Next()));
  EXPECT_TRUE(instance_.record.failover().has_resolution());
}

TEST_F(FailoversTest, ARegionThatDiesWithItsStandbyIsGivenUp) {
  for (const std::uint32_t region : {1U, StandbyOf(instance_.record, 1)}) {
    rig_.state->SetGone(instance_, StateRig::WorkerOf(instance_, region), "killed");
  }
  const FailoverStep step = Next();
  EXPECT_FALSE(step.next);
  EXPECT_THAT(step.given_up, HasSubstr("lost together with its standby: region 1"));
}

TEST_F(FailoversTest, AStandbyThatIsOnlySilentIsWaitedForByNameAndTheRegionIsCarriedOnWhenItIsHeard) {
  const std::uint32_t standby = LoseWhileBetaIsSilent();
  EXPECT_THAT(instance_.record.events().rbegin()->text(),
              HasSubstr("waits for host beta, silent since 2019-12-20T00:00:00Z: region"));
  PassWithoutBeta(rig_.settings.silence_patience - milliseconds(1));
  FailoverStep step = Next();
  EXPECT_EQ(step.given_up, "");
  EXPECT_FALSE(step.next) << "the event is said once";
  EXPECT_THAT(step.awaits, HasSubstr("host beta, silent since 2019-12-20T00:00:00Z: region"));
  rig_.Pass(rig_.settings.failover_timeout - milliseconds(1));
  step = Next();
  EXPECT_EQ(step.given_up, "") << "who is heard again has its time to answer";
  EXPECT_EQ(step.awaits, "");
  for (const std::uint32_t region : {3, 4}) {
    if (Runs(region)) SendInventory(region);
  }
  ASSERT_TRUE(Tell(Next()));
  ASSERT_TRUE(Take(Next()));
  const auto& takeovers = instance_.record.failover().resolution().takeovers();
  EXPECT_TRUE(std::any_of(takeovers.begin(), takeovers.end(), [standby](const v1::Takeover& takeover) {
    return takeover.body() == 1000 && takeover.region() == standby;
  }));
  EXPECT_EQ(instance_.record.lost_bodies(), 0U);
}

TEST_F(FailoversTest, ASilentStandbyIsWaitedForNoLongerThanThePatience) {
  LoseWhileBetaIsSilent();
  PassWithoutBeta(rig_.settings.silence_patience);
  const FailoverStep step = Next();
  EXPECT_FALSE(step.next);
  EXPECT_NE(step.given_up, "");
  EXPECT_EQ(step.awaits, "");
}

TEST_F(FailoversTest, AWorldThatCanGoBackToACheckpointWaitsForASilentStandbyAsForAnyAnswer) {
  KeepCheckpoint();
  LoseWhileBetaIsSilent();
  PassWithoutBeta(rig_.settings.failover_timeout - milliseconds(1));
  EXPECT_EQ(Next().given_up, "");
  PassWithoutBeta(milliseconds(1));
  EXPECT_NE(Next().given_up, "");
}

TEST_F(FailoversTest, ASilentStandbyThatIsKnownToBeGoneIsWaitedForNoMore) {
  const std::uint32_t standby = LoseWhileBetaIsSilent();
  rig_.state->SetGone(instance_, StateRig::WorkerOf(instance_, standby), "host beta was evicted");
  EXPECT_THAT(Next().given_up, HasSubstr("lost together with its standby: region 1"));
}

// The control plane after this one finds a failover that may have been resolved.
TEST_F(FailoversTest, AnotherLifeWaitsForTheSilentStandbyAsWell) {
  const std::uint32_t standby = LoseWhileBetaIsSilent();
  Failovers another(*rig_.state, rig_.settings);
  another.Adopt(instance_, rig_.now);
  ASSERT_TRUE(Take(another.Next(instance_, kNoCuts, rig_.now)));
  PassWithoutBeta(rig_.settings.failover_timeout);
  ASSERT_TRUE(Take(another.Next(instance_, kNoCuts, rig_.now))) << "another event";
  const FailoverStep step = another.Next(instance_, kNoCuts, rig_.now);
  EXPECT_EQ(step.given_up, "");
  EXPECT_THAT(step.awaits, HasSubstr("host beta"));
  EXPECT_TRUE(Runs(standby));
}

// Its agent is heard before it has said which of its workers it found dead.
TEST_F(FailoversTest, AnAgentIsNoWitnessForAWorkerOfWhichItHasSaidNothing) {
  const Steady last = alpha_.last_heard;
  PassWithoutBeta(rig_.settings.failover_after + milliseconds(1));
  for (WorkerEntry& worker : instance_.workers) worker.reported_at = last;
  EXPECT_FALSE(Next().next) << "both were last heard of at one time";
  PassWithoutBeta(milliseconds(1));
  EXPECT_TRUE(Next().next);
}

// Nothing is heard of region 1 either, whose only copy is the standby's.
TEST_F(FailoversTest, WhoMayHaveTheLastCopyOfAnotherSilentRegionIsNotDeclaredDead) {
  HostEntry& gamma = rig_.AddHost("gamma");
  InstanceEntry& world = rig_.AddRunning({&alpha_, &beta_, &gamma});
  const std::uint32_t standby = StandbyOf(world.record, 1);
  ASSERT_NE(standby, 0U);
  HostEntry& second = standby == 2 ? beta_ : gamma;
  HostEntry& third = standby == 2 ? gamma : beta_;
  rig_.Pass(rig_.settings.failover_after + milliseconds(1));
  alpha_.last_heard = second.last_heard = rig_.now.steady - rig_.settings.failover_after - milliseconds(1);
  for (WorkerEntry& worker : world.workers) {
    const HostEntry* host = HostAt(*rig_.state, world, static_cast<std::size_t>(&worker - world.workers.data()));
    if (host != &third) continue;
    worker.reported_at = rig_.now.steady;
    worker.report.add_standby_copies()->set_incarnation(StateRig::WorkerOf(world, standby).incarnation);
  }
  const auto dies = [&] {
    const FailoverStep step = failovers_.Next(world, kNoCuts, rig_.now);
    return step.next && std::any_of(step.next->failover().dead().begin(), step.next->failover().dead().end(),
                                    [&](const records::Dead& dead) { return dead.region() == standby; });
  };
  EXPECT_FALSE(dies()) << "region 1 may have died";
  alpha_.last_heard = rig_.now.steady;
  EXPECT_FALSE(dies()) << "its agent may not have found out";
  StateRig::WorkerOf(world, 1).reported_at = rig_.now.steady;
  EXPECT_TRUE(dies()) << "it has not";
}

TEST_F(FailoversTest, AFailoverThatNobodyAnswersIsGivenUpInTheEnd) {
  rig_.state->SetGone(instance_, StateRig::WorkerOf(instance_, 3), "killed");
  ASSERT_TRUE(Take(Next()));
  rig_.Pass(rig_.settings.failover_timeout - milliseconds(1));
  EXPECT_EQ(Next().given_up, "");
  rig_.Pass(milliseconds(1));
  EXPECT_THAT(Next().given_up, HasSubstr("timed out waiting for the inventories of regions 1, 2, 4"));
}

TEST_F(FailoversTest, WhatTheLivingWereToldIsStoredOnceTheirAgentsHaveIt) {
  rig_.state->SetGone(instance_, StateRig::WorkerOf(instance_, 3), "killed");
  ASSERT_TRUE(Take(Next()));
  for (const std::uint32_t region : {1, 2, 4}) SendInventory(region);
  ASSERT_TRUE(Tell(Next()));
  alpha_.stream = 1;
  alpha_.desired_changed = true;
  EXPECT_FALSE(Next().next) << "a slow write would hold up its orders";
  rig_.Pass(milliseconds(500));
  EXPECT_TRUE(Next().next) << "one that takes none holds up nothing";
  alpha_.desired_changed = false;
  EXPECT_TRUE(Next().next);
}

TEST_F(FailoversTest, ADeathAfterItWasToldBeginsAnewFromWhatWasTold) {
  rig_.state->SetGone(instance_, StateRig::WorkerOf(instance_, 3), "killed");
  ASSERT_TRUE(Take(Next()));
  for (const std::uint32_t region : {1, 2, 4}) SendInventory(region);
  ASSERT_TRUE(Tell(Next()));
  const std::uint32_t heir = instance_.record.failover().dead(0).standby();
  rig_.state->SetGone(instance_, StateRig::WorkerOf(instance_, heir), "killed");
  ASSERT_TRUE(Next().next);  // and cannot be stored
  ASSERT_TRUE(Take(Next())) << "its bodies may have been its heir's, whose standby is asked";
  EXPECT_EQ(instance_.record.map().version(), 3U);
  EXPECT_TRUE(instance_.record.failover().dead(0).resolved());
  EXPECT_FALSE(instance_.record.failover().dead(1).resolved());
  EXPECT_FALSE(instance_.told);
}

// It cannot know whether the one before told anybody a resolution.
TEST_F(FailoversTest, AnotherLifeBeginsAnewWhatIsNotResolved) {
  rig_.state->SetGone(instance_, StateRig::WorkerOf(instance_, 3), "killed");
  ASSERT_TRUE(Take(Next()));
  Failovers another(*rig_.state, rig_.settings);
  another.Adopt(instance_, rig_.now);
  ASSERT_TRUE(another.Next(instance_, kNoCuts, rig_.now).next);  // and cannot be stored
  ASSERT_TRUE(Take(another.Next(instance_, kNoCuts, rig_.now)));
  EXPECT_EQ(instance_.record.map().version(), 3U);
  EXPECT_TRUE(instance_.record.failover().dead(0).resolved());
  EXPECT_THAT(instance_.record.events().rbegin()->text(), HasSubstr("begins anew"));
  EXPECT_FALSE(another.Next(instance_, kNoCuts, rig_.now).next) << "once";
  rig_.Pass(rig_.settings.failover_timeout);
  EXPECT_THAT(another.Next(instance_, kNoCuts, rig_.now).given_up, HasSubstr("the inventories of regions 1, 2, 4"));
}

}  // namespace
}  // namespace tessera::control
