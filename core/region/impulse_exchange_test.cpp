#include "core/region/impulse_exchange.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/region/testing/small_world.h"

namespace tessera::region {
namespace {

const std::vector<RegionId> kUp = {RegionId(2)};

// Body 1 is region 1's, body 2 is a ghost of region 2's; they touch.
class ImpulseExchangeTest : public ::testing::Test {
 protected:
  ImpulseExchangeTest() {
    world.Own(1);
    world.AddGhost(2, 2);
  }
  static physics::PairImpulse Contact(Vec3f impulse_on_2) {
    physics::PairImpulse contact;
    contact.body_a = BodyId(1);
    contact.body_b = BodyId(2);
    contact.tag_a = 0;
    contact.tag_b = 1;
    contact.impulse_on_b = impulse_on_2;
    return contact;
  }
  void Find(Vec3f impulse_on_2) {
    exchange.Note(std::vector{Contact(impulse_on_2)}, world.bodies, kUp);
    exchange.Validate();
  }
  // As the owner of body 2 found it.
  void Report(Vec3f impulse_on_2) { frames[0].impulses.push_back({BodyId(2), BodyId(1), impulse_on_2, {}, {}}); }
  ImpulseExchange::Settlement Settle() {
    auto settlement = exchange.Settle({world.bodies, world.neighborhood, frames, departed, taken_in, up});
    frames[0] = {};
    return settlement;
  }
  // Impulse of the push on a body, N s.
  static Vec3d On(std::uint64_t id, const ImpulseExchange::Settlement& settlement) {
    for (const ImpulseExchange::Push& push : settlement.pushes) {
      if (push.id == BodyId(id)) return Vec3d(push.force_n) * SmallWorld::kTick_s;
    }
    return {};
  }

  SmallWorld world{Balls({{-0.5, 0, 0}, {0.5, 0, 0}})};
  ImpulseExchange exchange{world.catalog, SmallWorld::kTick_s};
  std::vector<BorderFrame> frames{1};
  std::vector<DepartingBody> departed;
  std::vector<BodyId> taken_in;
  std::vector<RegionId> up = kUp;
};

TEST_F(ImpulseExchangeTest, NothingIsDueIfBothSidesFoundTheSame) {
  Find({1, 0, 0});
  Report({1, 0, 0});
  EXPECT_EQ(On(1, Settle()), Vec3d());
  EXPECT_TRUE(exchange.owed().empty());
}

// Body 1 has got -3 and body 2 got 1: each makes up 1, a tenth of it at once.
TEST_F(ImpulseExchangeTest, ACorrectionComesByAndByWhileTheBodiesTouchAndThenAllAtOnce) {
  Find({3, 0, 0});
  Report({1, 0, 0});
  const auto first = Settle();
  EXPECT_NEAR(On(1, first).x, 0.1, 1e-6);
  EXPECT_NEAR(On(2, first).x, 0.1, 1e-6);  // the ghost starts the step as it does with its owner
  ASSERT_EQ(exchange.owed().size(), 2U);
  exchange.Clear();
  EXPECT_NEAR(On(1, Settle()).x, 0.9, 1e-6);
  EXPECT_TRUE(exchange.owed().empty());
  exchange.Validate();
}

TEST_F(ImpulseExchangeTest, AContactThatOneSideAloneFoundIsShared) {
  Find({2, 0, 0});
  EXPECT_NEAR(On(1, Settle()).x, 0.1, 1e-6);
}

TEST_F(ImpulseExchangeTest, AnOutageEndsTheExchange) {
  Find({2, 0, 0});
  up.clear();
  EXPECT_TRUE(Settle().pushes.empty());
  exchange.Note(std::vector{Contact({2, 0, 0})}, world.bodies, {});
  EXPECT_TRUE(exchange.RecordsFor(RegionId(2), [](std::size_t) { return true; }).empty());
}

TEST_F(ImpulseExchangeTest, ARecordGoesToTheOtherOwnerAndToWhoeverHasTheBody) {
  Find({2, 0, 0});
  EXPECT_EQ(exchange.RecordsFor(RegionId(2), [](std::size_t) { return false; }).size(), 1U);
  EXPECT_TRUE(exchange.RecordsFor(RegionId(3), [](std::size_t) { return false; }).empty());
  const std::vector<ImpulseRecord> records = exchange.RecordsFor(RegionId(3), [](std::size_t) { return true; });
  ASSERT_EQ(records.size(), 1U);
  EXPECT_EQ(records[0].own, BodyId(1));
  EXPECT_EQ(records[0].impulse_on_own, Vec3f(-2, 0, 0));
}

DepartingBody Departing(const SmallWorld& world, std::uint64_t id, std::uint32_t to) {
  DepartingBody body;
  body.record.id = BodyId(id);
  body.record.epoch = Epoch(2);
  body.record.state = world.InitialOf(id);
  body.to = RegionId(to);
  return body;
}

// Body 1 goes to region 3, which does not own the other body and so lacks its solution.
TEST_F(ImpulseExchangeTest, TheOldOwnerSettlesForABodyThatGoesToAThird) {
  Find({3, 0, 0});
  Report({1, 0, 0});
  departed.push_back(Departing(world, 1, 3));
  world.bodies.BecomeGhost(departed[0].record, RegionId(3));
  world.bodies.NotePlaces();
  const auto settlement = Settle();
  ASSERT_EQ(settlement.late.size(), 1U);
  EXPECT_EQ(settlement.late[0].to, RegionId(3));
  EXPECT_NEAR(settlement.late[0].late.impulse_ns.x, 1, 1e-6);
}

TEST_F(ImpulseExchangeTest, TheNewOwnerSettlesIfItOwnsTheOtherBody) {
  Find({3, 0, 0});
  Report({1, 0, 0});
  departed.push_back(Departing(world, 1, 2));
  world.bodies.BecomeGhost(departed[0].record, RegionId(2));
  world.bodies.NotePlaces();
  EXPECT_TRUE(Settle().late.empty());
}

TEST_F(ImpulseExchangeTest, ALateCorrectionActsOrFollowsTheBody) {
  frames[0].late_corrections.push_back({BodyId(1), {2, 0, 0}, {}});
  EXPECT_NEAR(On(1, Settle()).x, 2, 1e-6);
  frames[0].late_corrections.push_back({BodyId(1), {2, 0, 0}, {}});
  departed.push_back(Departing(world, 1, 3));
  const auto settlement = Settle();
  ASSERT_EQ(settlement.late.size(), 1U);
  EXPECT_EQ(settlement.late[0].to, RegionId(3));
}

TEST_F(ImpulseExchangeTest, WhatIsOwedIsPassedOnWithTheBody) {
  Find({3, 0, 0});
  Report({1, 0, 0});
  Settle();
  const auto late = exchange.PassOn(Departing(world, 1, 2));
  ASSERT_TRUE(late.has_value());
  EXPECT_EQ(late->to, RegionId(2));
  EXPECT_NEAR(late->late.impulse_ns.x, 0.9, 1e-6);
  EXPECT_FALSE(exchange.PassOn(Departing(world, 1, 2)).has_value());
  exchange.Forget(BodyId(2));
  EXPECT_TRUE(exchange.owed().empty());
}

TEST_F(ImpulseExchangeTest, ASleeperIsNotSolvedSoNothingIsBalanced) {
  Report({1, 0, 0});
  world.ghosts[0].record.state.asleep = true;
  world.bodies.PlaceGhosts(world.ghosts);
  EXPECT_TRUE(Settle().pushes.empty());
}

}  // namespace
}  // namespace tessera::region
