#include "core/region/ownership.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/region/testing/small_world.h"

namespace tessera::region {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

constexpr PlayerNumber kPlayer(3);
const BodyId kPlayersBody = PlayerBodyId(kPlayer);
const TouchingPair kPair{BodyId(1), BodyId(2), false};

PlayerInput Input(std::uint32_t number) {
  PlayerInput input;
  input.number = number;
  input.player = kPlayer;
  input.body = kPlayersBody;
  input.force_n = {1, 0, 0};
  return input;
}

Scene WithPlayers() {
  Scene scene = Balls({{-1, 0, 0}, {-3, 0, 0}, {1, 0, 0}});
  AllowPlayers(scene);
  PropertyDef health;
  health.name = "health";
  health.initial = std::int64_t{100};
  scene.properties.push_back(health);
  return scene;
}

class OwnershipTest : public ::testing::Test {
 protected:
  GrantedBody Body(std::uint64_t id, Epoch epoch = Epoch(1)) const {
    return {BodyId(id), epoch, world.InitialOf(id), {}};
  }
  void SetHealth(std::uint64_t id, std::int64_t value) {
    ASSERT_TRUE(properties.Set(BodyId(id), world.scene->properties, "health", value, 1).ok());
  }
  static DepartingBody DepartingTo(RegionId to, std::uint64_t id, Epoch epoch) {
    DepartingBody body;
    body.record.id = BodyId(id);
    body.record.epoch = epoch;
    body.to = to;
    return body;
  }

  SmallWorld world{WithPlayers()};
  RegionPlayers players;
  PairReports reports{world.catalog};
  RecordTable properties;
  OutputCommit output;
  SharedProperties shared;
  BlastTable blasts{*world.scene};
  Ownership ownership{world.catalog, world.bodies, players, reports, properties, output, shared, blasts};
};

TEST_F(OwnershipTest, AGrantCarriesAllThatGoesWithABody) {
  ownership.Take(Body(1, Epoch(4)), {});
  SetHealth(1, 7);
  reports.Adopt(std::vector{kPair});
  const PreparedGrant prepared = ownership.Prepare({RegionId(2), {0}}, Tick(9));
  ASSERT_EQ(prepared.grant.bodies.size(), 1U);
  EXPECT_EQ(prepared.grant.bodies[0].epoch, Epoch(5));
  EXPECT_EQ(prepared.grant.bodies[0].record.change, 1U);
  EXPECT_THAT(prepared.grant.touching, ElementsAre(kPair));
  ASSERT_EQ(prepared.copies.size(), 1U);
  const KeptGrant& copy = prepared.copies[0].second;
  EXPECT_EQ(copy.tick, Tick(9));
  EXPECT_EQ(copy.record, prepared.grant.bodies[0].record);
  EXPECT_THAT(copy.touching, ElementsAre(kPair));
  EXPECT_TRUE(world.bodies.Owns(BodyId(1)));  // until it departs
}

TEST_F(OwnershipTest, AHandedOverBodyLivesOnAsAGhostAndTakesAllWithIt) {
  ownership.Take(Body(1), {});
  SetHealth(1, 7);
  reports.Adopt(std::vector{kPair});
  const Departure departure = ownership.HandOver(DepartingTo(RegionId(2), 1, Epoch(2))).departure;
  EXPECT_EQ(departure.epoch, Epoch(1));
  EXPECT_EQ(departure.reason, DepartureReason::kHandedOver);
  EXPECT_EQ(departure.to, RegionId(2));
  EXPECT_NE(world.bodies.FindGhost(BodyId(1)), nullptr);
  EXPECT_THAT(reports.All(), IsEmpty());
  EXPECT_THAT(properties.all(), IsEmpty());
}

TEST_F(OwnershipTest, InputsThatCameAfterTheGrantAreSentAfterIt) {
  ownership.Spawn(kPlayer);
  ASSERT_TRUE(players.Queue(Input(1)).ok());
  const PreparedGrant prepared = ownership.Prepare({RegionId(2), {0}}, Tick(9));
  EXPECT_EQ(prepared.grant.control.queue.size(), 1U);
  ASSERT_TRUE(players.Queue(Input(2)).ok());
  const auto handed_over = ownership.HandOver(prepared.departing[0]);
  ASSERT_EQ(handed_over.late_inputs.size(), 1U);
  EXPECT_EQ(handed_over.late_inputs[0].number, 2U);
  EXPECT_EQ(players.Find(kPlayer), nullptr);
}

TEST_F(OwnershipTest, ARemovedBodyLeavesTheWorldAndItsPairsEndThere) {
  ownership.Take(Body(1), {});
  SetHealth(1, 7);
  reports.Adopt(std::vector{kPair});
  EXPECT_EQ(ownership.Remove(BodyId(1)).reason, DepartureReason::kRemoved);
  EXPECT_FALSE(world.bodies.world().Has(BodyId(1)));
  EXPECT_THAT(properties.all(), IsEmpty());
  EXPECT_THAT(reports.All(), ElementsAre(kPair));  // the next report ends it
  ownership.Validate();
}

TEST_F(OwnershipTest, ABodyThatAnotherOwnsIsLetGoWithItsPairs) {
  ownership.Take(Body(1), {});
  reports.Adopt(std::vector{kPair});
  EXPECT_EQ(ownership.LetGo(BodyId(1), RegionId(2)).to, RegionId(2));
  EXPECT_FALSE(world.bodies.world().Has(BodyId(1)));
  EXPECT_THAT(reports.All(), IsEmpty());
}

TEST_F(OwnershipTest, AStateHoldsAllThatIsOwned) {
  ownership.Take(Body(1), {});
  ownership.Take(Body(2), {});
  ownership.Spawn(kPlayer);
  SetHealth(2, 7);
  reports.Adopt(std::vector{kPair});
  RegionState state;
  ownership.Save(state);
  EXPECT_EQ(state.bodies.size(), 3U);
  EXPECT_TRUE(state.controls.contains(kPlayer));
  EXPECT_TRUE(state.records.contains(BodyId(2)));
  EXPECT_THAT(state.touching, ElementsAre(kPair));
  EXPECT_TRUE(CheckRegionState(state, world.catalog).ok());
  ownership.Validate();
}

}  // namespace
}  // namespace tessera::region
