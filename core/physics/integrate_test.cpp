// Free flight is the parabola, forces act once, islands that fail stay; and bodies sleep after the stated time.
#include "core/physics/integrate.h"

#include <gmock/gmock.h>

#include <cmath>
#include <limits>

#include "core/physics/sleep.h"
#include "core/physics/testing/loose_bodies.h"
#include "core/physics/tuning.h"

namespace tessera::physics {
namespace {

using ::testing::ElementsAre;

// Bodies that fly, each an island of its own.
class IntegrateTest : public ::testing::Test {
 protected:
  void Step() {
    const std::span<RigidBody* const> awake = loose_.bodies.awake();
    BuildIslands(awake.size(), {}, {}, &islands_);
    plans_.assign(islands_.count(), {});
    motions_.resize(awake.size());
    FlyFree(awake, islands_, plans_, kDt, motions_);
    integrator_.Run(awake, islands_, motions_);
    EXPECT_TRUE(Integrator::Validate(awake));
  }

  LooseBodies loose_;
  Islands islands_;
  std::vector<IslandPlan> plans_;
  std::vector<BodyMotion> motions_;
  Integrator integrator_;
};

TEST_F(IntegrateTest, FreeFlightIsTheParabola) {
  BodyDef def = Dynamic(1, Ball(), {0, 100, 0});
  def.initial.linear_velocity = {3, 4, -5};
  const RigidBody& ball = loose_.Add(def);
  for (int i = 1; i <= 60; ++i) {
    Step();
    const double t = i * kDt;
    EXPECT_LT(Length(ball.state().position - Vec3d{3 * t, 100 + 4 * t - kGravity * t * t / 2, -5 * t}), 3e-6);
  }
}

TEST_F(IntegrateTest, DampedFlightIsItsClosedForm) {
  BodyDef def = Dynamic(1, Ball(), {});
  def.linear_damping = 0.4;
  def.initial.linear_velocity = {5, 0, 0};
  const RigidBody& ball = loose_.Add(def);
  for (int i = 0; i < 60; ++i) Step();
  const double k = -std::log(0.6);
  EXPECT_NEAR(ball.state().linear_velocity.x, 5 * 0.6, 1e-5);
  EXPECT_NEAR(ball.state().position.x, 5 * 0.4 / k, 1e-5);
}

TEST_F(IntegrateTest, AForceActsForOneStep) {
  BodyDef def = Dynamic(1, Ball(), {}, 2);
  def.gravity_scale = 0;
  RigidBody& ball = loose_.Add(def);
  ball.force_n = {120, 0, 0};
  Step();
  EXPECT_NEAR(ball.state().linear_velocity.x, 60 * kDt, 1e-6);
  Step();
  EXPECT_NEAR(ball.state().linear_velocity.x, 60 * kDt, 1e-6);
}

TEST_F(IntegrateTest, BodiesOfSolvedIslandsDoNotFly) {
  loose_.Add(Dynamic(1, Ball(), {}));
  BuildIslands(1, {}, {}, &islands_);
  plans_ = {{.solved = true}};
  motions_.assign(
      1,
      BodyMotion{.position = {1, 2, 3}, .orientation = {}, .velocity = {}, .angular_momentum = {}, .turned_rad = {}});
  FlyFree(loose_.bodies.awake(), islands_, plans_, kDt, motions_);
  EXPECT_EQ(motions_[0].position, Vec3d(1, 2, 3));
}

TEST_F(IntegrateTest, AnIslandThatFailsStaysAndGivesUpItsFastestBody) {
  for (std::uint64_t id = 1; id <= 4; ++id) {
    BodyDef def = Dynamic(id, Ball(), {static_cast<double>(id), 0, 0});
    def.initial.linear_velocity = {0, 0, id == 3 ? 2.0f : 1.0f};
    loose_.Add(def);
  }
  const std::vector<ActiveContact> contacts = {ContactBetween(0, 1), ContactBetween(1, 2)};
  BuildIslands(4, contacts, {}, &islands_);
  motions_.resize(4);
  for (std::uint32_t i = 0; i < 4; ++i) motions_[i] = FreeFlightOf(*loose_.bodies.awake()[i], kDt);
  motions_[0].velocity.x = std::numeric_limits<float>::infinity();
  integrator_.Run(loose_.bodies.awake(), islands_, motions_);
  EXPECT_THAT(integrator_.failing(), ElementsAre(&loose_.bodies.At(BodyId(3))));
  EXPECT_EQ(loose_.bodies.At(BodyId(2)).state().position, Vec3d(2, 0, 0));
  EXPECT_NE(loose_.bodies.At(BodyId(4)).state().position, Vec3d(4, 0, 0));
}

// --- Sleep

class SleepPassTest : public ::testing::Test {
 protected:
  void Step(std::span<const ActiveContact> contacts = {}) {
    Islands islands;
    BuildIslands(loose_.bodies.awake().size(), contacts, {}, &islands);
    sleep_.Run(kDt, islands, loose_.bodies);
    EXPECT_TRUE(loose_.bodies.Validate());
  }

  LooseBodies loose_;
  SleepPass sleep_{true};
};

TEST_F(SleepPassTest, NeedsTheStatedTimeOfStillness) {
  RigidBody& ball = loose_.Add(Dynamic(1, Ball(), {}));
  int steps = 0;
  for (; ball.awake(); ++steps) Step();
  EXPECT_NEAR(steps * kDt, kSleepAfter_s, 1.01 * kDt);
  EXPECT_TRUE(loose_.bodies.awake().empty());
}

TEST_F(SleepPassTest, StartsAnewAfterAMovement) {
  RigidBody& ball = loose_.Add(Dynamic(1, Ball(), {}));
  for (int i = 0; i < 20; ++i) Step();
  ball.SetMotion({1.01f * kSleepLinear_m_s, 0, 0}, {});
  Step();
  EXPECT_EQ(ball.state().still_s, 0);
  ball.SetMotion({0.99f * kSleepLinear_m_s, 0, 0}, {});
  Step();
  EXPECT_NEAR(ball.state().still_s, kDt, 1e-6);
  EXPECT_TRUE(ball.awake());
}

TEST_F(SleepPassTest, AnIslandSleepsAsAWhole) {
  RigidBody& still = loose_.Add(Dynamic(1, Ball(), {}));
  BodyDef moving_def = Dynamic(2, Ball(), {1, 0, 0});
  moving_def.initial.linear_velocity = {1, 0, 0};
  RigidBody& moving = loose_.Add(moving_def);
  RigidBody& alone = loose_.Add(Dynamic(3, Ball(), {9, 0, 0}));
  const std::vector<ActiveContact> contacts = {ContactBetween(still.awake_index, moving.awake_index)};
  for (int i = 0; i < 60; ++i) Step(contacts);
  EXPECT_TRUE(still.awake() && moving.awake());
  EXPECT_FALSE(alone.awake());
  moving.SetMotion({}, {});
  for (int i = 0; i < 32 && still.awake(); ++i) Step(contacts);
  EXPECT_FALSE(still.awake() || moving.awake());
}

TEST_F(SleepPassTest, NeverForABodyThatMayNotAndInAWorldWithoutSleep) {
  BodyDef def = Dynamic(1, Ball(), {});
  def.may_sleep = false;
  RigidBody &awake = loose_.Add(def), &other = loose_.Add(Dynamic(2, Ball(), {3, 0, 0}));
  sleep_ = SleepPass(false);
  for (int i = 0; i < 60; ++i) Step();
  EXPECT_TRUE(other.awake());
  sleep_ = SleepPass(true);
  for (int i = 0; i < 60; ++i) Step();
  EXPECT_TRUE(awake.awake());
  EXPECT_FALSE(other.awake());
}

}  // namespace
}  // namespace tessera::physics
