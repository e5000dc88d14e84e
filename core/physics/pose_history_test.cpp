// Queries into the past meet bodies where they were.
#include <gmock/gmock.h>

#include <numbers>

#include "core/physics/world.h"

namespace tessera::physics {
namespace {

using ::testing::SizeIs;

constexpr BodyId kBall{7}, kWall{8};
constexpr double kTick_s = 1.0 / 60;

// A ball of radius 1 that flies along x at 10 m/s from 0, and a wall that stands behind it.
class PoseHistoryTest : public ::testing::Test {
 protected:
  PoseHistoryTest() : world_({.origin = {}, .gravity_m_s2 = {}}) {
    BodyDef ball;
    ball.id = kBall;
    ball.motion = Motion::kDynamic;
    ball.mass_kg = 1;
    ball.shape = std::make_shared<const Shape>(Shape{SphereShape{1}});
    ball.initial.linear_velocity = {10, 0, 0};
    world_.Add(ball, ball.initial);
    BodyDef wall;
    wall.id = kWall;
    wall.motion = Motion::kStatic;
    wall.shape = std::make_shared<const Shape>(Shape{BoxShape{{100, 100, 1}}});
    wall.initial.position = {0, 0, -20};
    world_.Add(wall, wall.initial);
  }
  void Run(int ticks) {
    for (int i = 0; i < ticks; ++i) {
      world_.Step(kTick_s);
      tick_ = tick_ + 1;
      const std::vector<BodyId> own = world_.Has(kBall) ? std::vector{kBall} : std::vector<BodyId>();
      if (owned_) {
        world_.NotePoses(tick_, kTick_s, {.own = own, .ghosts = {}, .fixed = {}}, 30);
      } else {
        world_.NotePoses(tick_, kTick_s, {.own = {}, .ghosts = own, .fixed = {}}, 30);
      }
    }
  }
  // Along -z, at x.
  QueryResult RayAt(double x, double at, QueryScope scope = QueryScope::kSeen) const {
    BodyQuery query{.from = {x, 0, 10}, .to = {x, 0, -30}};
    query.at_tick = at;
    query.scope = scope;
    query.most_hits = 4;
    return world_.FindBodies(query);
  }

  World world_;
  Tick tick_;
  bool owned_ = true;
};

TEST_F(PoseHistoryTest, ARayMeetsABodyWhereItWasBetweenTwoTicks) {
  Run(25);
  const double at = 7.25, middle = 10 * at * kTick_s;
  const QueryResult result = RayAt(middle + 0.6, at);
  ASSERT_THAT(result.hits, SizeIs(2));
  EXPECT_TRUE(result.known);
  EXPECT_EQ(result.hits[0].body, kBall);
  // The sphere's surface at .6 from its middle.
  EXPECT_NEAR(result.hits[0].point.z, 0.8, 1e-6);
  EXPECT_EQ(result.hits[1].body, kWall);
  EXPECT_THAT(RayAt(middle + 1.1, at).hits, SizeIs(1));
  EXPECT_THAT(RayAt(10 * 25 * kTick_s, at).hits, SizeIs(1));  // where it is now
}

TEST_F(PoseHistoryTest, ABodyThatHasLeftIsMetWhereItWas) {
  Run(10);
  world_.Remove(kBall);
  Run(10);
  EXPECT_THAT(RayAt(10 * 8 * kTick_s, 8).hits, SizeIs(2));
  EXPECT_THAT(RayAt(10 * 8 * kTick_s, 12).hits, SizeIs(1));
}

TEST_F(PoseHistoryTest, OneThatWasPutElsewhereIsNotOnTheWay) {
  Run(10);
  BodyState state = world_.StateOf(kBall);
  const double before = state.position.x;
  state.position.x = 50;
  world_.Teleport(kBall, state);
  Run(1);
  EXPECT_THAT(RayAt(before, 10.9).hits, SizeIs(2));
  EXPECT_THAT(RayAt((before + 50) / 2, 10.5).hits, SizeIs(1));
  EXPECT_THAT(RayAt(50 + 10 * kTick_s, 11).hits, SizeIs(2));
}

TEST_F(PoseHistoryTest, OnlyAsMuchIsKnownAsWasNoted) {
  Run(50);
  EXPECT_TRUE(RayAt(0, 21).known);
  EXPECT_FALSE(RayAt(0, 20.9).known);
  EXPECT_TRUE(RayAt(0, 50).known);
  EXPECT_FALSE(RayAt(0, 50.1).known);
  world_.ForgetPoses();
  EXPECT_FALSE(RayAt(0, 45).known);
  tick_ = tick_ + 5;  // as after a failover
  Run(2);
  EXPECT_FALSE(RayAt(0, 50).known);
  EXPECT_TRUE(RayAt(0, 57).known);
}

TEST_F(PoseHistoryTest, TheScopeSaysWhoAnswersForABody) {
  Run(10);
  const double x = 10 * 5 * kTick_s;
  EXPECT_THAT(RayAt(x, 5, QueryScope::kSeen).hits, SizeIs(2));
  EXPECT_THAT(RayAt(x, 5, QueryScope::kOwnedAndFixed).hits, SizeIs(2));
  EXPECT_THAT(RayAt(x, 5, QueryScope::kOwned).hits, SizeIs(1));
  owned_ = false;  // it went to a neighbour, and is seen as a ghost
  Run(10);
  const double later = 10 * 15 * kTick_s;
  EXPECT_THAT(RayAt(later, 15, QueryScope::kSeen).hits, SizeIs(2));
  EXPECT_THAT(RayAt(later, 15, QueryScope::kOwnedAndFixed).hits, SizeIs(1));
  EXPECT_THAT(RayAt(later, 15, QueryScope::kOwned).hits, SizeIs(0));
  EXPECT_THAT(RayAt(x, 5, QueryScope::kOwned).hits, SizeIs(1));
}

TEST_F(PoseHistoryTest, AQueryThatCannotPayIsGivenUp) {
  Run(10);
  BodyQuery query{.from = {0, 0, 10}, .to = {0, 0, -30}};
  query.at_tick = 5;
  query.most_work = 101;
  EXPECT_FALSE(world_.FindBodies(query).complete);
}

}  // namespace
}  // namespace tessera::physics
