// Swept bodies stop where the closed form says, with what hangs on them, and keep what they had.
#include "core/physics/continuous/continuous_collision.h"

#include <gmock/gmock.h>

#include <cmath>
#include <numbers>

#include "core/physics/continuous/keep_turning.h"
#include "core/physics/integrate.h"
#include "core/physics/testing/loose_bodies.h"
#include "core/physics/trig.h"
#include "core/physics/tuning.h"

namespace tessera::physics {
namespace {

using ::testing::ElementsAre;

// Bodies whose motions the test makes. Nobody has predicted them, so whatever moves far counts as deflected.
class ContinuousTest : public ::testing::Test {
 protected:
  ~ContinuousTest() override {
    for (const auto& [id, body] : loose_.bodies.all()) broad_phase_.Remove(*body);
  }
  RigidBody& Add(const BodyDef& def) {
    RigidBody& body = loose_.Add(def);
    broad_phase_.Add(body);
    return body;
  }
  void Move(const RigidBody& body, Vec3d by) {
    motions_.resize(loose_.bodies.awake().size());
    BodyMotion& motion = motions_[body.awake_index];
    motion.position += by;
    motion.velocity = Vec3f(by / kDt);
  }
  // All that nobody moves stays.
  void StandStill() {
    for (const RigidBody* body : loose_.bodies.awake()) {
      const Placement& at = body->placement();
      motions_.push_back({at.position, at.orientation, {}, {}, {}});
    }
  }
  void Run() {
    joints_.Run(loose_.bodies);
    groups_.Run(joints_.joints());
    pass_.Run({kDt, loose_.bodies.awake(), joints_, groups_}, broad_phase_, loose_.pairs, motions_);
    EXPECT_TRUE(pass_.Validate(loose_.bodies.awake()));
  }
  const BodyMotion& MotionOf(const RigidBody& body) const { return motions_[body.awake_index]; }

  LooseBodies loose_;
  BroadPhase broad_phase_{Vec3d()};
  AwakeJoints joints_;
  JointedGroups groups_;
  ContinuousCollision pass_;
  std::vector<BodyMotion> motions_;
};

TEST_F(ContinuousTest, ASweptSphereStopsAtItsShareOfTheWay) {
  Add(Static(1, Box(0.5, 5, 5), {4, 0, 0}));
  const RigidBody& ball = Add(Dynamic(2, Ball(0.5), {}));
  StandStill();
  Move(ball, {10, 0, 0});
  Run();
  ASSERT_EQ(pass_.stops().size(), 1U);
  const double meets_m = 3 - kImpactDistance_m;
  EXPECT_NEAR(pass_.stops()[0].share, meets_m / 10, 2e-6);
  EXPECT_NEAR(MotionOf(ball).position.x, meets_m, 2e-5);
  EXPECT_EQ(MotionOf(ball).velocity.x, static_cast<float>(10 / kDt)) << "the next step's contact takes the velocity";
}

TEST_F(ContinuousTest, BallsThatMeetAskewStopWhereTheQuadraticSays) {
  const RigidBody &a = Add(Dynamic(1, Ball(0.3), {-4, 0, 0})), &b = Add(Dynamic(2, Ball(0.2), {3, 0.3, 0}));
  StandStill();
  Move(a, {8, 0, 0});
  Move(b, {-8, 0, 0});
  Run();
  const double touch = 0.5 + kImpactDistance_m, share = (7 - std::sqrt(touch * touch - 0.09)) / 16;
  ASSERT_EQ(pass_.stops().size(), 2U);
  EXPECT_NEAR(pass_.stops()[0].share, share, 1e-4);
  EXPECT_NEAR(pass_.stops()[1].share, share, 1e-4);
  EXPECT_NEAR(Length(MotionOf(a).position - MotionOf(b).position), touch, 1e-4);
}

TEST_F(ContinuousTest, ABodyThatMovesAsPredictedIsLeftToItsContacts) {
  Add(Static(1, Box(0.5, 5, 5), {4, 0, 0}));
  RigidBody& ball = Add(Dynamic(2, Ball(0.5), {}));
  ball.predicted = {.move_m = {10, 0, 0}, .velocity_m_s = {600, 0, 0}, .spin_rad_s = {}};
  loose_.pairs.Begin(ball, loose_.bodies.At(BodyId(1)));
  StandStill();
  Move(ball, {10, 0, 0});
  Run();
  EXPECT_TRUE(pass_.stops().empty());
}

TEST_F(ContinuousTest, ATriggerIsCrossedAndStopsNothing) {
  BodyDef gate = Static(1, Box(0.1, 5, 5), {4, 0, 0});
  gate.trigger = true;
  RigidBody& trigger = Add(gate);
  RigidBody& ball = Add(Dynamic(2, Ball(0.5), {}));
  StandStill();
  Move(ball, {10, 0, 0});
  Run();
  EXPECT_TRUE(pass_.stops().empty());
  EXPECT_THAT(pass_.crossed(), ElementsAre(loose_.pairs.Find(trigger, ball)));
  EXPECT_EQ(MotionOf(ball).position.x, 10);
}

TEST_F(ContinuousTest, AMuchHeavierBodyGoesOnAndTakesTheOtherAlong) {
  const RigidBody &ship = Add(Dynamic(1, Ball(0.5), {}, 100)), &crate = Add(Dynamic(2, Ball(0.5), {2, 0, 0}, 1));
  StandStill();
  Move(ship, {2, 0, 0});
  Run();
  EXPECT_EQ(MotionOf(ship).position.x, 2);
  EXPECT_NEAR(MotionOf(crate).position.x, 3 + kImpactDistance_m, 2e-5);
}

TEST_F(ContinuousTest, AMuchHeavierBodyGoesOnThoughBothAreFast) {
  const RigidBody &ship = Add(Dynamic(1, Ball(0.5), {}, 100)), &crate = Add(Dynamic(2, Ball(0.5), {2, 0, 0}, 1));
  StandStill();
  Move(ship, {2, 0, 0});
  Move(crate, {-0.5, 0, 0});
  Run();
  EXPECT_EQ(MotionOf(ship).position.x, 2);
  EXPECT_NEAR(MotionOf(crate).position.x, 3 + kImpactDistance_m, 2e-5);
}

// Both are swept, the pair once.
TEST_F(ContinuousTest, TwoFastBodiesAreListedOnceAtATrigger) {
  BodyDef gate = Dynamic(1, Box(0.1, 5, 5), {4, 0, 0});
  gate.trigger = true;
  RigidBody &trigger = Add(gate), &ball = Add(Dynamic(2, Ball(0.5), {}));
  StandStill();
  Move(ball, {10, 0, 0});
  Move(trigger, {-1, 0, 0});
  Run();
  EXPECT_THAT(pass_.crossed(), ElementsAre(loose_.pairs.Find(trigger, ball)));
}

TEST_F(ContinuousTest, AWallEndsTheWayOfWhatIsCarried) {
  const RigidBody &ship = Add(Dynamic(1, Ball(0.5), {}, 100)), &crate = Add(Dynamic(2, Ball(0.5), {2, 0, 0}, 1));
  Add(Static(3, Box(0.5, 5, 5), {3.2, 0, 0}));
  StandStill();
  Move(ship, {2, 0, 0});
  Run();
  EXPECT_NEAR(MotionOf(crate).position.x, 2.2 - kImpactDistance_m, 2e-5);
}

TEST_F(ContinuousTest, WhatIsJointedStopsTogetherAndStaysTogether) {
  Add(Static(1, Box(0.5, 5, 5), {4, 0, 0}));
  const RigidBody &head = Add(Dynamic(2, Ball(0.2), {})), &tail = Add(Dynamic(3, Ball(0.2), {-1, 0, 0}));
  loose_.bodies.AddJoint(PointBetween(1, 2, 3, {-0.5, 0, 0}, {0.5, 0, 0}));
  StandStill();
  Move(head, {10, 0, 0});
  Move(tail, {10, 0, 0});
  Run();
  ASSERT_EQ(pass_.stops().size(), 2U);
  EXPECT_EQ(pass_.stops()[0].share, pass_.stops()[1].share);
  EXPECT_NEAR(MotionOf(head).position.x, 3.3 - kImpactDistance_m, 2e-5);
  EXPECT_NEAR(MotionOf(head).position.x - MotionOf(tail).position.x, 1, 1e-12);
}

// The tail swings about the head by a quarter turn. Moved back along its chord it would be too near to the head.
TEST_F(ContinuousTest, AJointIsClosedAgainAfterItsBodiesWereMovedBack) {
  Add(Static(1, Box(0.5, 5, 5), {4, 0, 0}));
  const RigidBody &head = Add(Dynamic(2, Ball(0.2), {})), &tail = Add(Dynamic(3, Ball(0.2), {-1, 0, 0}));
  loose_.bodies.AddJoint(PointBetween(1, 2, 3, {-0.5, 0, 0}, {0.5, 0, 0}));
  StandStill();
  Move(head, {6.6, 0, 0});
  constexpr double kQuarter = std::numbers::pi / 2;
  motions_[tail.awake_index] = {{6.1, -0.5, 0}, TurnBy({0, 0, kQuarter}), {}, {}, {0, 0, static_cast<float>(kQuarter)}};
  Run();
  ASSERT_EQ(pass_.stops().size(), 2U);
  const BodyMotion &a = MotionOf(head), &b = MotionOf(tail);
  const Vec3d end_a = a.position + Rotate(a.orientation, Vec3d{-0.5, 0, 0});
  const Vec3d end_b = b.position + Rotate(b.orientation, Vec3d{0.5, 0, 0});
  EXPECT_NEAR(pass_.stops()[0].share, 0.5, 1e-3);
  EXPECT_LT(Length(end_a - end_b), 1e-9);
}

// --- Turning

Vec3d AngularMomentum(const RigidBody& a, const BodyMotion& at_a, const RigidBody& b, const BodyMotion& at_b) {
  return Cross(at_a.position, Vec3d(at_a.velocity)) * a.mass_kg() + Vec3d(at_a.angular_momentum) +
         Cross(at_b.position, Vec3d(at_b.velocity)) * b.mass_kg() + Vec3d(at_b.angular_momentum);
}

// A body that goes on at another velocity than its motion had lacks angular momentum once it is moved back.
TEST_F(ContinuousTest, TwoThatStopEachOtherKeepMomentumAndAngularMomentum) {
  const RigidBody &a = Add(Dynamic(1, Ball(0.5), {}, 2)), &b = Add(Dynamic(2, Ball(0.5), {2, 0.4, 0}, 3));
  StandStill();
  Move(a, {1.2, 0, 0});
  motions_[a.awake_index].velocity = {72, 3, 0};
  const Vec3d before = AngularMomentum(a, MotionOf(a), b, MotionOf(b));
  Run();
  ASSERT_EQ(pass_.impulses().size(), 1U);
  EXPECT_LT(MotionOf(a).position.x, 1.2);
  const Vec3d momentum = Vec3d(MotionOf(a).velocity) * 2 + Vec3d(MotionOf(b).velocity) * 3;
  EXPECT_NEAR(momentum.x, 2 * 72, 1e-4);
  EXPECT_NEAR(momentum.y, 2 * 3, 1e-5);
  const Vec3d after = AngularMomentum(a, MotionOf(a), b, MotionOf(b));
  EXPECT_LT(Length(after - before), 1e-6 * Length(before)) << before << after;
}

TEST_F(ContinuousTest, NobodyTurnsWhereTheOtherHoldsStill) {
  RigidBody &ball = Add(Dynamic(1, Ball(0.5), {})), &wall = Add(Static(2, Box(0.5, 5, 5), {4, 0, 0}));
  StandStill();
  EXPECT_FALSE(KeepTurning(
      loose_.bodies.awake(),
      {.index = ball.awake_index, .share = 0.5, .by = &wall, .end_m = {0, 1, 0}, .velocity_m_s = {9, 0, 0}}, motions_));
}

}  // namespace
}  // namespace tessera::physics
