#include "core/region/resolve.h"

#include <gmock/gmock.h>

#include <algorithm>

#include "core/world/partition_change.h"

namespace tessera::region {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

constexpr RegionId kA(1), kB(2), kC(3), kD(4);
constexpr BodyId kX(7);

// Four regions that meet in a corner; standbys are 1 -> 2 -> 3 -> 4 -> 1.
class ResolveTest : public ::testing::Test {
 protected:
  void Die(std::vector<RegionId> who) {
    dead = std::move(who);
    map = *FailoverMap(*MakeGridMap({0, 0, 8, 8}, 4), dead, MapVersion(2));
    for (const MapRegion& region : map.regions())
      inventories.push_back({map.version(), region.id, Tick(100), {}, {}, {}, {}});
  }
  Inventory& Of(RegionId id) { return *std::ranges::find(inventories, id, &Inventory::region); }
  void Primary(RegionId holder, RegionId region, std::vector<BodyClaim> bodies, std::vector<GrantClaim> grants = {}) {
    Of(holder).primaries.push_back({region, Incarnation(1), Tick(99), std::move(bodies), std::move(grants), {}});
  }
  Resolution Result(std::vector<BodyId> expected = {kX}) {
    const absl::StatusOr<Resolution> resolution = Resolve(map, dead, inventories, expected);
    EXPECT_TRUE(resolution.ok()) << resolution.status();
    EXPECT_TRUE(CheckResolution(*resolution).ok());
    std::vector<Inventory> reversed(inventories.rbegin(), inventories.rend());
    EXPECT_EQ(*Resolve(map, dead, reversed, expected), *resolution) << "the order of the inventories does not matter";
    return *resolution;
  }

  PartitionMap map;
  std::vector<RegionId> dead;
  std::vector<Inventory> inventories;
};

TEST_F(ResolveTest, TheStandbyPromotesWhatOnlyItsStandbyHas) {
  Die({kA});
  Primary(kB, kA, {{kX, Epoch(3)}});
  EXPECT_THAT(Result().takeovers, ElementsAre(Takeover{kX, Epoch(4), kB, kA, false}));
  EXPECT_EQ(Result().resume_tick, Tick(102));
  EXPECT_THAT(Result().lost, IsEmpty());
}

// C took the body from B and removed it; B has not heard the acknowledgement, or its standby has not.
TEST_F(ResolveTest, WhatWasRemovedDoesNotComeBackFromAnOldCopy) {
  Die({kA});
  Of(kB).grants = {{kX, Epoch(4), kC}};
  Of(kC).tombstones = {{kX, Epoch(4)}};
  Primary(kB, kA, {{kX, Epoch(3)}}, {});
  EXPECT_THAT(Result().takeovers, IsEmpty());
  EXPECT_THAT(Result().pending, IsEmpty());
  EXPECT_THAT(Result().lost, IsEmpty()) << "removed is not lost";
  Of(kB).grants = {{kX, Epoch(5), kC}};
  EXPECT_THAT(Result().takeovers, ElementsAre(Takeover{kX, Epoch(6), kB, RegionId(), true})) << "a later life of it";
}

TEST_F(ResolveTest, ADeadRegionsTombstonesCountByItsStandby) {
  Die({kC});
  Of(kB).grants = {{kX, Epoch(4), kC}};
  Primary(kD, kC, {});
  EXPECT_THAT(Result().takeovers, ElementsAre(Takeover{kX, Epoch(5), kB, RegionId(), true}));
  Of(kD).primaries.back().tombstones = {{kX, Epoch(4)}};
  EXPECT_THAT(Result().takeovers, IsEmpty());
}

// B was A's standby until C took that over; B's copy has a body that A has removed since.
TEST_F(ResolveTest, OfTwoCopiesTheNewerOneCounts) {
  Die({kA});
  Primary(kB, kA, {{kX, Epoch(3)}, {BodyId(8), Epoch(1)}});
  Primary(kC, kA, {{BodyId(8), Epoch(1)}});
  Of(kB).primaries.back().tick = Tick(90);
  EXPECT_THAT(Result({BodyId(8)}).takeovers, ElementsAre(Takeover{BodyId(8), Epoch(2), kC, kA, false}));
  Of(kC).primaries.clear();
  EXPECT_THAT(Result({BodyId(8)}).takeovers, SizeIs(2)) << "an old copy is better than none";
}

TEST_F(ResolveTest, GrantedAndTakenBeforeTheStandbyHeardOfIt) {
  Die({kA});
  Primary(kB, kA, {{kX, Epoch(3)}});
  Of(kC).owned = {{kX, Epoch(4)}};
  EXPECT_THAT(Result().takeovers, IsEmpty());
}

TEST_F(ResolveTest, GrantedAndNeverTaken) {
  Die({kA});
  Primary(kB, kA, {{kX, Epoch(3)}}, {{kX, Epoch(4), kC}});
  EXPECT_THAT(Result().takeovers, ElementsAre(Takeover{kX, Epoch(5), kB, kA, true}))
      << "an epoch above the one that was granted";
}

TEST_F(ResolveTest, TheGranterPromotesWhatTheDeadOnesStandbyLacks) {
  Die({kA});
  Primary(kB, kA, {});
  Of(kC).grants = {{kX, Epoch(4), kA}};
  EXPECT_THAT(Result().takeovers, ElementsAre(Takeover{kX, Epoch(5), kC, RegionId(), true}));
}

TEST_F(ResolveTest, TheGranterDoesNotPromoteWhatTheStandbyHasAndKeepsItsCopyForTheNextDeath) {
  Die({kA});
  Primary(kB, kA, {{kX, Epoch(4)}});
  Of(kC).grants = {{kX, Epoch(4), kA}};
  EXPECT_THAT(Result().takeovers, ElementsAre(Takeover{kX, Epoch(5), kB, kA, false}));
  EXPECT_THAT(Result().pending, ElementsAre(PendingGrant{kX, Epoch(5), kC, kB}));
}

TEST_F(ResolveTest, GrantedOnwardToAThird) {
  Die({kB});
  Primary(kC, kB, {});                   // has neither the taking nor the granting on
  Of(kA).grants = {{kX, Epoch(2), kB}};  // unacknowledged
  Of(kD).owned = {{kX, Epoch(3)}};
  EXPECT_THAT(Result().takeovers, IsEmpty());
  EXPECT_THAT(Result().pending, IsEmpty()) << "region 1's copy is of an ownership that has ended";
}

TEST_F(ResolveTest, AGrantOnTheWayBetweenTheLivingIsPromotedByItsGranter) {
  Die({kA});
  Primary(kB, kA, {});
  Of(kC).owned = {{kX, Epoch(2)}};
  Of(kC).grants = {{kX, Epoch(3), kD}};
  EXPECT_THAT(Result().takeovers, ElementsAre(Takeover{kX, Epoch(4), kC, RegionId(), true}));
}

TEST_F(ResolveTest, AGrantBetweenTheLivingThatWasTakenStaysUnacknowledged) {
  Die({kA});
  Primary(kB, kA, {});
  Of(kC).owned = {{kX, Epoch(2)}};
  Of(kC).grants = {{kX, Epoch(3), kD}};
  Of(kD).owned = {{kX, Epoch(3)}};
  EXPECT_THAT(Result().takeovers, IsEmpty());
  EXPECT_THAT(Result().pending, ElementsAre(PendingGrant{kX, Epoch(3), kC, kD}));
}

TEST_F(ResolveTest, TwoNeighboursThatDieTogetherAreCarriedOnByTheirStandbys) {
  Die({kA, kC});
  Primary(kB, kA, {{BodyId(1), Epoch(1)}}, {{kX, Epoch(2), kC}});
  Primary(kD, kC, {{BodyId(2), Epoch(1)}, {kX, Epoch(2)}});
  EXPECT_THAT(Result({BodyId(1), BodyId(2), kX}).takeovers,
              ElementsAre(Takeover{BodyId(1), Epoch(2), kB, kA, false}, Takeover{BodyId(2), Epoch(2), kD, kC, false},
                          Takeover{kX, Epoch(3), kD, kC, false}));
  EXPECT_THAT(Result().without_copy, IsEmpty());
}

TEST_F(ResolveTest, RegionAndStandbyLostTogetherIsToldAsALoss) {
  Die({kA, kB});
  Primary(kC, kB, {{BodyId(2), Epoch(1)}});
  const Resolution resolution = Result({BodyId(2), kX});
  EXPECT_THAT(resolution.without_copy, ElementsAre(kA));
  EXPECT_THAT(resolution.lost, ElementsAre(kX));
}

TEST_F(ResolveTest, NamesThePlayersThatHaveABody) {
  Die({kA});
  Primary(kB, kA, {{PlayerBodyId(PlayerNumber(2)), Epoch(1)}});
  Of(kC).owned = {{PlayerBodyId(PlayerNumber(1)), Epoch(5)}};
  EXPECT_THAT(Result({}).players, ElementsAre(PlayerNumber(1), PlayerNumber(2)));
}

TEST_F(ResolveTest, WaitsForEveryLiveRegionAndRefusesOthers) {
  Die({kA});
  inventories.pop_back();
  EXPECT_THAT(Resolve(map, dead, inventories).status().message(), HasSubstr("no inventory of region 4"));
  inventories.push_back({MapVersion(1), kD, Tick(1), {}, {}, {}});
  EXPECT_THAT(Resolve(map, dead, inventories).status().message(), HasSubstr("another failover"));
  inventories.back() = inventories.front();
  EXPECT_THAT(Resolve(map, dead, inventories).status().message(), HasSubstr("two inventories of region 2"));
  inventories.back() = {map.version(), kD, Tick(1), {{kX, Epoch(1)}, {kX, Epoch(2)}}, {}, {}};
  EXPECT_THAT(Resolve(map, dead, inventories).status().message(), HasSubstr("a body twice"));
}

}  // namespace
}  // namespace tessera::region
