#include "core/region/failover.h"

#include <gtest/gtest.h>

#include "core/region/log.h"
#include "core/region/testing/small_world.h"

namespace tessera::region {
namespace {

constexpr RegionId kSelf{1}, kDead{2}, kOther{3};

PartitionMap MapOf(std::uint64_t version) {
  return *PartitionMap::Create(MapVersion(version), {-10, -10, 10, 10}, {{{-10, -10, 10, 10}, kSelf, Epoch(1)}},
                               {{kSelf, RegionId()}});
}

TEST(FailoverTest, BeginsAnewWithANewerMapAndOnlyWithThat) {
  Failover failover;
  bool begun = false;
  EXPECT_FALSE(failover.Begin(MapOf(3), MapVersion(3), &begun).ok());
  ASSERT_TRUE(failover.Begin(MapOf(4), MapVersion(3), &begun).ok());
  EXPECT_TRUE(begun && failover.under_way());
  ASSERT_TRUE(failover.Begin(MapOf(4), MapVersion(3), &begun).ok());
  EXPECT_FALSE(begun);
  ASSERT_TRUE(failover.Begin(MapOf(5), MapVersion(3), &begun).ok());
  EXPECT_TRUE(begun);
  EXPECT_FALSE(failover.Begin(MapOf(4), MapVersion(3), &begun).ok());
  EXPECT_EQ(failover.End().version(), MapVersion(5));
  EXPECT_FALSE(failover.under_way());
}

TEST(FailoverTest, AMapThatIsNotNewerThanTheOneInForceIsNoticed) {
  Failover failover;
  failover.Validate(MapVersion(3));
  bool begun = false;
  ASSERT_TRUE(failover.Begin(MapOf(4), MapVersion(3), &begun).ok());
  failover.Validate(MapVersion(3));
  EXPECT_DEBUG_DEATH(failover.Validate(MapVersion(4)), "");
}

TEST(FailoverTest, OnlyTheResolutionOfThisFailoverEndsItAndOnlyInTime) {
  Failover failover;
  Resolution resolution;
  resolution.version = MapVersion(4);
  resolution.resume_tick = Tick(12);
  EXPECT_EQ(failover.Check(resolution, Tick(5)).message(), "no failover is under way");
  bool begun = false;
  ASSERT_TRUE(failover.Begin(MapOf(4), MapVersion(3), &begun).ok());
  EXPECT_TRUE(failover.Check(resolution, Tick(10)).ok());
  EXPECT_EQ(failover.Check(resolution, Tick(11)).message(), "resume_tick: it has passed here");
  resolution.version = MapVersion(3);
  EXPECT_EQ(failover.Check(resolution, Tick(5)).message(), "a resolution of version 3, the failover is 4");
}

// Region 2 is dead; this region has its copy, in which it owned body 1 and had granted body 2 to region 3.
class PromotionTest : public ::testing::Test {
 protected:
  PromotionTest() {
    RegionState state;
    state.region = kDead;
    state.tick = Tick(9);
    state.bodies = {{BodyId(1), Epoch(3), world.InitialOf(1)}};
    state.touching = {{BodyId(1), BodyId(3), false}, {BodyId(2), BodyId(3), false}};
    state.grants[{BodyId(2), Epoch(2)}] = {kOther, Tick(8), world.InitialOf(2), {}, {}, {}};
    EXPECT_TRUE(copy.Receive(EncodeState(state)).ok());
  }
  absl::StatusOr<std::map<BodyId, KeptGrant>> Find(const Takeover& takeover) const {
    Resolution resolution;
    resolution.takeovers = {takeover};
    return FindPromoted(resolution, kSelf, kept, primaries, world.catalog, reports);
  }

  SmallWorld world{Balls({{-1, 0, 0}, {-3, 0, 0}, {-5, 0, 0}})};
  PairReports reports{world.catalog};
  StandbyCopy copy{kDead, world.catalog};
  std::vector<const StandbyCopy*> primaries = {&copy};
  KeptGrants kept;
};

TEST_F(PromotionTest, ABodyOfTheCopyComesWithItsOwnPairs) {
  const auto promoted = Find({BodyId(1), Epoch(4), kSelf, kDead, false});
  ASSERT_TRUE(promoted.ok());
  const KeptGrant& body = promoted->at(BodyId(1));
  EXPECT_EQ(body.tick, Tick(9));
  ASSERT_EQ(body.touching.size(), 1U);
  EXPECT_EQ(body.touching[0].body_a, BodyId(1));
}

TEST_F(PromotionTest, AGrantIsFoundInTheCopyOrAmongTheOwn) {
  EXPECT_EQ(Find({BodyId(2), Epoch(3), kSelf, kDead, true})->at(BodyId(2)).tick, Tick(8));
  kept[{BodyId(3), Epoch(2)}] = {kDead, Tick(6), world.InitialOf(3), {}, {}, {}};
  kept[{BodyId(3), Epoch(4)}] = {kDead, Tick(7), world.InitialOf(3), {}, {}, {}};
  EXPECT_EQ(Find({BodyId(3), Epoch(5), kSelf, RegionId(), true})->at(BodyId(3)).tick, Tick(7));  // the newest
}

TEST_F(PromotionTest, WhatIsNotHereIsRefusedByName) {
  EXPECT_EQ(Find({BodyId(3), Epoch(4), kSelf, kDead, false}).status().message(),
            "body 3 is to be promoted and is not here");
  EXPECT_FALSE(Find({BodyId(1), Epoch(4), kSelf, kOther, false}).ok());
  EXPECT_FALSE(Find({BodyId(77), Epoch(4), kSelf, kDead, false}).ok());
  EXPECT_TRUE(Find({BodyId(3), Epoch(4), kOther, kDead, false})->empty());  // another region's task
}

TEST_F(PromotionTest, TheNewestCopyOfAPendingGrantIsStillNeeded) {
  kept[{BodyId(2), Epoch(2)}] = {kDead, Tick(5), world.InitialOf(2), {}, {}, {}};
  Resolution resolution;
  resolution.pending = {{BodyId(2), Epoch(2), kSelf, kOther}, {BodyId(3), Epoch(2), kOther, kSelf}};
  const KeptGrants needed = FindStillNeeded(resolution, kSelf, kept, primaries);
  ASSERT_EQ(needed.size(), 1U);
  EXPECT_EQ(needed.at({BodyId(2), Epoch(2)}).tick, Tick(8));
  EXPECT_EQ(needed.at({BodyId(2), Epoch(2)}).to, kOther);
}

TEST_F(PromotionTest, AnInventoryNamesAllThatIsHeld) {
  RegionState own;
  own.region = kSelf;
  own.tick = Tick(10);
  own.bodies = {{BodyId(3), Epoch(1), world.InitialOf(3)}};
  const Inventory inventory = TakeInventory(own, MapVersion(4), primaries);
  EXPECT_TRUE(CheckInventory(inventory).ok());
  EXPECT_EQ(inventory.owned.size(), 1U);
  ASSERT_EQ(inventory.primaries.size(), 1U);
  EXPECT_EQ(inventory.primaries[0].grants.size(), 1U);
}

}  // namespace
}  // namespace tessera::region
