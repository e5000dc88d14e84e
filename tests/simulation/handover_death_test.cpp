// A region dies around a handover: what the granter, the new owner, their standbys and a third know differs, and one
// copy has to live.
#include <gmock/gmock.h>

#include "core/region/testing/kept_bodies.h"
#include "tests/simulation/instance.h"

namespace tessera::simulation {
namespace {

using ::testing::IsEmpty;

constexpr double kHalfSide = 20;  // half the ground's side, m

// One ball that flies over 2 x 2 regions: 1 and 2 at negative z, 3 and 4 beyond them; the standby of each is the next
// one, of 4 it is 1.
struct Flight {
  Flight(Vec3d from, Vec3f velocity, std::uint64_t seed = 1) : builder(kHalfSide) {
    id = builder.Add(Ball(0.5), from, velocity).id;
    instance = std::make_unique<Instance>(builder, 4, SimulationOptions{.seed = seed});
  }
  Simulation& simulation() { return *instance->simulation; }
  ControlModel& control() { return *instance->control; }
  region::Region& region(std::uint32_t number) { return simulation().worker(number).region(); }
  bool Keeps(std::uint32_t granter) { return region::KeptBodies(region(granter)) == std::vector<BodyId>{id}; }

  // In steps far shorter than a tick.
  template <class Condition>
  void RunUntil(Condition condition) {
    for (int i = 0; i < 20'000 && !condition(); ++i) simulation().RunFor(100);
    ASSERT_TRUE(condition());
  }
  void RunUntilOwnedBy(std::uint32_t region) {
    RunUntil([&] { return simulation().OwnerOf(id) == RegionId(region); });
  }
  void ExpectOne(std::uint32_t owner) {
    simulation().RunFor(Milliseconds(600));
    EXPECT_THAT(simulation().problems(), IsEmpty());
    EXPECT_FALSE(control().failing_over());
    EXPECT_EQ(control().totals().lost, 0U);
    EXPECT_EQ(simulation().States().size(), 1U);
    EXPECT_EQ(simulation().OwnerOf(id), RegionId(owner));
    for (const auto& [at, worker] : simulation().workers())
      EXPECT_THAT(region::KeptBodies(worker->region()), IsEmpty()) << at;
  }

  SceneBuilder builder;
  BodyId id;
  std::unique_ptr<Instance> instance;
};

Flight AlongTheFirstRow() { return {{-2, 1, -10}, {6, 0, 0}}; }

// Granter and standby have the body by the same epoch: it is the standby's, and once only.
TEST(HandoverDeathTest, WhatTheStandbyHasIsNotPromotedByAGranterThatNeverHeardTheAcknowledgement) {
  Flight flight = AlongTheFirstRow();
  flight.RunUntilOwnedBy(2);
  flight.simulation().network().Cut(1, 2, true);  // so the acknowledgement is lost
  const Tick owned = flight.region(2).tick();
  flight.RunUntil([&] { return flight.control().StandbyTick(RegionId(2)) >= owned; });
  ASSERT_TRUE(flight.Keeps(1));
  flight.simulation().Kill(RegionId(2));
  flight.ExpectOne(3);
  EXPECT_EQ(flight.control().totals().adopted, 1U);
  EXPECT_EQ(flight.control().totals().from_grant, 0U);
}

// A acknowledgement waits for the standby, however long that takes: until then the granter's copy is all there is.
TEST(HandoverDeathTest, NothingIsConfirmedByATickThatTheStandbyLacks) {
  Flight flight = AlongTheFirstRow();
  flight.simulation().RunTo(Tick(10));
  flight.control().HoldLog(RegionId(2), true);
  flight.RunUntilOwnedBy(2);
  flight.simulation().RunFor(Milliseconds(500));
  EXPECT_TRUE(flight.Keeps(1));
  flight.simulation().Kill(RegionId(2));
  flight.RunUntilOwnedBy(1);
  flight.ExpectOne(3);  // that region has the area now
  EXPECT_EQ(flight.control().totals().adopted, 0U);
  EXPECT_EQ(flight.control().totals().from_grant, 1U);
}

// The other way round: the granter has heard the acknowledgement at a tick that its own standby lacks, and dies. What
// the standby has is the body before it was granted, or the grant; both are over.
TEST(HandoverDeathTest, WhatWasConfirmedAtATickThatTheGrantersStandbyLacksStaysWithItsOwner) {
  for (const bool standby_has_the_grant : {false, true}) {
    Flight flight = AlongTheFirstRow();
    flight.simulation().RunTo(Tick(10));
    if (!standby_has_the_grant) flight.control().HoldLog(RegionId(1), true);
    flight.RunUntil([&] { return flight.Keeps(1); });
    const Tick granted = flight.region(1).tick();
    if (standby_has_the_grant) {
      flight.RunUntil([&] { return flight.control().StandbyTick(RegionId(1)) >= granted; });
      flight.control().HoldLog(RegionId(1), true);
    }
    flight.RunUntil([&] { return flight.simulation().OwnerOf(flight.id) == RegionId(2) && !flight.Keeps(1); });
    flight.simulation().RunFor(Milliseconds(100));
    flight.simulation().Kill(RegionId(1));
    flight.ExpectOne(2);
    EXPECT_EQ(flight.control().totals().adopted + flight.control().totals().from_grant, 0U) << standby_has_the_grant;
  }
}

// From 1 to 2 to 4 within a few ticks, while the standbys of some hear nothing.
struct Onward : Flight {
  Onward() : Flight({-4, 1, -1.5}, {24, 0, 6}) {
    simulation().RunTo(Tick(4));
    control().HoldLog(RegionId(2), true);  // it confirms nothing, and its standby has nothing of the ball
  }
  // Until 4 has it, and neither it nor 2 has confirmed.
  void RunUntilNobodyHasConfirmed() {
    control().HoldLog(RegionId(4), true);
    RunUntilOwnedBy(2);
    RunUntilOwnedBy(4);
    simulation().RunFor(Milliseconds(100));
    ASSERT_TRUE(Keeps(1));
    ASSERT_TRUE(Keeps(2));
  }
};

TEST(HandoverDeathTest, WhatWasGrantedOnwardToAThirdStaysThere) {
  Onward flight;
  flight.RunUntilOwnedBy(2);
  flight.RunUntilOwnedBy(4);
  flight.RunUntil([&] { return !flight.Keeps(2); });  // the third has confirmed
  ASSERT_TRUE(flight.Keeps(1));                       // the second has not
  flight.simulation().Kill(RegionId(2));
  flight.ExpectOne(4);
  EXPECT_EQ(flight.control().totals().adopted + flight.control().totals().from_grant, 0U);
}

TEST(HandoverDeathTest, WhatWasGrantedOnwardIsPromotedByTheSecondIfTheThirdDies) {
  Onward flight;
  flight.RunUntilNobodyHasConfirmed();
  flight.control().HoldLog(RegionId(2), false);
  flight.simulation().Kill(RegionId(4));
  flight.RunUntilOwnedBy(2);
  flight.ExpectOne(1);  // that region has the area now
  EXPECT_EQ(flight.control().totals().from_grant, 1U);
}

TEST(HandoverDeathTest, WhatWasGrantedOnwardIsPromotedByTheFirstIfBothOthersDieTogether) {
  Onward flight;
  flight.RunUntilNobodyHasConfirmed();
  flight.simulation().Kill(RegionId(2));
  flight.simulation().Kill(RegionId(4));
  flight.ExpectOne(1);
  EXPECT_EQ(flight.control().totals().from_grant, 1U);
  EXPECT_EQ(flight.control().totals().without_copy, 0U);
}

// Granter and new owner die together, at each tick around the handover, and of none, of one or of both the last ticks
// never reached the standby.
TEST(HandoverDeathTest, TwoNeighboursThatDieTogetherAroundAHandoverLoseNothing) {
  std::uint64_t adopted = 0, from_grant = 0;
  for (std::uint64_t tick = 18; tick <= 32; ++tick) {
    for (const unsigned held : {0U, 1U, 2U, 3U}) {   // bit 0: of the granter, bit 1: of the new owner
      Flight flight({-10, 1, -2}, {0, 0, 6}, tick);  // from 1 to 3, whose standbys are 2 and 4
      flight.simulation().RunTo(Tick(tick - 2));
      flight.control().HoldLog(RegionId(1), (held & 1) != 0);
      flight.control().HoldLog(RegionId(3), (held & 2) != 0);
      flight.simulation().RunTo(Tick(tick));
      flight.simulation().Kill(RegionId(1));
      flight.simulation().Kill(RegionId(3));
      flight.simulation().RunFor(Milliseconds(400));
      const std::string when = "at " + std::to_string(tick) + ", held " + std::to_string(held);
      EXPECT_THAT(flight.simulation().problems(), IsEmpty()) << when;
      ASSERT_EQ(flight.simulation().States().size(), 1U) << when;
      EXPECT_EQ(flight.control().totals().without_copy, 0U) << when;
      EXPECT_EQ(flight.control().totals().adopted + flight.control().totals().from_grant, 1U) << when;
      adopted += flight.control().totals().adopted;
      from_grant += flight.control().totals().from_grant;
    }
  }
  EXPECT_GT(adopted, 0U);
  EXPECT_GT(from_grant, 0U);  // out of the granter's log: the new owner's never reached its standby
}

// A spawn that a standby has, one that it has not, a removal likewise: at each tick after they were asked for,
// whichever region dies, and its standby's news held back or not.
TEST(HandoverDeathTest, ASpawnOrARemovalInTheLastTicksIsDoneOnce) {
  for (std::uint64_t after = 0; after < 5; ++after) {
    for (const bool held : {false, true}) {
      SceneBuilder builder = Swarm(kHalfSide, 10);
      PlayerRules& rules = builder.scene().player.emplace();
      rules.body.shape = Ball(0.4);
      rules.spawn_points = {{1, 1, -10}, {1, 1, -12}};
      rules.max_force_n = 10;
      rules.max_speed_m_s = 5;
      Instance instance(builder, 4);
      Simulation& simulation = *instance.simulation;
      simulation.RunTo(Tick(20));
      simulation.SpawnPlayer(PlayerNumber(1), RegionId(2));
      simulation.RunTo(Tick(40));
      instance.control->HoldLog(RegionId(2), held);
      simulation.RemovePlayer(PlayerNumber(1));
      simulation.SpawnPlayer(PlayerNumber(2), RegionId(2));
      simulation.RunTo(Tick(40 + after));
      simulation.Kill(RegionId(2));
      simulation.RunFor(Milliseconds(200));
      // As the control plane does: who was removed stays so for whoever has the area, who may not have been made is
      // asked for again, of one region.
      for (auto& [id, worker] : simulation.workers()) worker->region().RemovePlayer(PlayerNumber(1));
      simulation.worker(3).region().SpawnPlayer(PlayerNumber(2));
      simulation.RunFor(Milliseconds(300));
      const std::string when = "after " + std::to_string(after) + (held ? ", held" : "");
      EXPECT_THAT(simulation.problems(), IsEmpty()) << when;
      EXPECT_EQ(simulation.OwnerOf(PlayerBodyId(PlayerNumber(1))), RegionId()) << when;
      EXPECT_NE(simulation.OwnerOf(PlayerBodyId(PlayerNumber(2))), RegionId()) << when;
      EXPECT_EQ(simulation.States().size(), 11U) << when;
    }
  }
}

}  // namespace
}  // namespace tessera::simulation
