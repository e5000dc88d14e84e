#include "region_worker/core/region_run.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "region_worker/testing/core_rig.h"
#include "region_worker/testing/regions.h"

namespace tessera::worker {
namespace {

using ::testing::ElementsAre;
using ::testing::SizeIs;

const Identity kIdentity{"instance", kSelf, Incarnation(1)};

// A run of region 1, alone in its world unless a test has it built with more.
class RegionRunTest : public ::testing::Test {
 protected:
  explicit RegionRunTest(std::uint32_t regions = 1) : run(kIdentity, ConfigOf(1, regions, WorldWithPlayers()), false) {
    order.map = run.region().map();
    run.Begin(links, actions);
  }
  void Follow() { EXPECT_TRUE(run.Follow(order, now, links, actions).ok()); }
  void GiveLease(RegionId from, std::uint64_t number) {
    LinkMessage message;
    message.kind = LinkMessageKind::kLeaseGiven;
    message.number = number;
    run.Receive(from, message, now, links, actions);
  }
  // One tick's time; whether it was stepped.
  bool Advance() {
    now += run.ticks().tick_length();
    if (!run.Advance(now, links, actions)) return false;
    run.Step(now, {}, links, actions);
    run.StepEnded(now, {});
    return true;
  }

  LinkTable links{kSelf};
  Actions actions;
  TimePoint now{std::chrono::hours(1)};
  Order order;
  RegionRun run;
};

TEST_F(RegionRunTest, StepsOnceItRunsAndPublishesEachStep) {
  EXPECT_FALSE(Advance());
  run.Run(now, actions);
  EXPECT_THAT(AllOf<PublishStart>(actions), SizeIs(1));
  EXPECT_TRUE(run.Moves(now));
  EXPECT_TRUE(Advance());
  EXPECT_TRUE(Advance());
  EXPECT_THAT(AllOf<PublishStep>(actions), SizeIs(2));
  EXPECT_EQ(run.statistics().counts().ticks, 2U);
}

TEST_F(RegionRunTest, PausesWithoutItsLeaseAndGoesOnWithIt) {
  links.Up(kSecond, Incarnation(1), now, actions);
  order.standby = kSecond;
  Follow();
  run.Run(now, actions);
  EXPECT_FALSE(Advance());
  EXPECT_TRUE(run.paused());
  EXPECT_FALSE(run.Moves(now));
  EXPECT_EQ(run.wake_at(now), std::nullopt);
  const auto number = run.AskForLease(now, links, actions);
  ASSERT_TRUE(number.has_value());
  GiveLease(kSecond, *number);
  EXPECT_TRUE(Advance());
  EXPECT_FALSE(run.paused());
}

TEST_F(RegionRunTest, OthersThanTheStandbyGiveNoLease) {
  order.standby = kSecond;
  Follow();
  run.Run(now, actions);
  const auto number = run.AskForLease(now, links, actions);
  GiveLease(RegionId(3), *number);
  EXPECT_FALSE(Advance());
}

TEST_F(RegionRunTest, AMapThatHasNoPlaceForItEndsItsSteps) {
  order.planned = {MapOfOne(run.region().map(), 2, kSecond), run.region().tick() + 3, true};
  Follow();
  EXPECT_EQ(run.planned(), MapVersion(2));
  run.Run(now, actions);
  int steps = 0;
  while (Advance()) ++steps;
  EXPECT_EQ(steps, 2);
  EXPECT_TRUE(run.MapCameIntoForce(actions));
  EXPECT_FALSE(run.Moves(now));
}

TEST_F(RegionRunTest, AFrameThatIsDroppedIsCounted) {
  const region::Bytes bytes = {1, 2, 3};
  LinkMessage message;
  message.bytes = bytes;
  run.Receive(kSecond, message, now, links, actions);
  std::uint64_t dropped = 0;
  for (const std::uint64_t count : run.drops()) dropped += count;
  EXPECT_EQ(dropped, 1U);
}

TEST_F(RegionRunTest, PlayersAndPropertiesGoTheWayOfTheOrder) {
  order.players = {{.number = PlayerNumber(1), .spawn_region = kSelf}};
  order.properties = {{1, BodyId(1), "wealth", true}};
  Follow();
  run.Run(now, actions);
  ASSERT_TRUE(Advance());
  EXPECT_EQ(run.roster().spawned(), 1U);
  EXPECT_THAT(run.PropertyAnswers(), SizeIs(1));
}

class RegionRunOfTwoTest : public RegionRunTest {
 protected:
  RegionRunOfTwoTest() : RegionRunTest(2) {}
};

TEST_F(RegionRunOfTwoTest, NeedsLinksWithNeighboursStandbyAndPrimaries) {
  order.standby = RegionId(5);
  order.primaries = {RegionId(4)};
  EXPECT_THAT(run.Partners(order), ElementsAre(kSecond, RegionId(4), RegionId(5)));
}

TEST_F(RegionRunOfTwoTest, AFailoverHaltsItAndItsResolutionLetsItGoOn) {
  run.Run(now, actions);
  order.map = MapOfOne(run.region().map(), 2, kSelf);
  order.failover = {MapVersion(2), {{kSecond, Incarnation(1)}}};
  Follow();
  EXPECT_TRUE(run.region().halted());
  EXPECT_FALSE(Advance());
  order.resolution.emplace();
  order.resolution->version = MapVersion(2);
  order.resolution->resume_tick = run.region().tick() + 5;
  Follow();
  EXPECT_FALSE(run.region().halted());
  EXPECT_EQ(run.failover_figures().failovers, 1U);
  Follow();
  EXPECT_EQ(run.failover_figures().failovers, 1U) << "the same order again";
  EXPECT_TRUE(Advance());
  EXPECT_EQ(run.region().tick(), order.resolution->resume_tick);
}

TEST_F(RegionRunOfTwoTest, WhoJoinsWaitsForASilentNeighbourUntilItsMapIsInForceByItsOrders) {
  const auto steps_in_two_seconds = [this] {
    int steps = 0;
    for (int tick = 0; tick < 120; ++tick) steps += Advance() ? 1 : 0;
    return steps;
  };
  order.joins_running = true;
  Follow();
  run.Run(now, actions);
  EXPECT_EQ(steps_in_two_seconds(), 0);
  EXPECT_EQ(run.ticks().links_down(), 0U);
  order.joins_running = false;
  Follow();
  EXPECT_GT(steps_in_two_seconds(), 90);
  EXPECT_EQ(run.ticks().links_down(), 1U);
}

TEST_F(RegionRunOfTwoTest, WhoIsFencedFollowsNoFurther) {
  order.map = MapOfOne(run.region().map(), 2, kSecond);
  order.failover = {MapVersion(2), {{kSelf, Incarnation(1)}}};
  order.standby = kSecond;
  Follow();
  EXPECT_TRUE(run.failovers().fenced());
  EXPECT_EQ(run.standby_log().standby(), RegionId());
}

}  // namespace
}  // namespace tessera::worker
