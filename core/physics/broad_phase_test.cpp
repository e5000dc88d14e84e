// Bounds hold all that a body can touch in a step, and pairs begin where they overlap.
#include "core/physics/broad_phase.h"

#include <gmock/gmock.h>

#include <cmath>
#include <random>

#include "core/physics/testing/loose_bodies.h"

namespace tessera::physics {
namespace {

constexpr Vec3d kOrigin{1000, 0, -1000};

// Bodies that are in the trees as long as this lives.
class BroadPhaseTest : public ::testing::Test {
 protected:
  ~BroadPhaseTest() override {
    for (const auto& [id, body] : loose_.bodies.all()) broad_phase_.Remove(*body);
  }
  RigidBody& Add(BodyDef def) {
    def.initial.position += kOrigin;
    RigidBody& body = loose_.Add(def);
    broad_phase_.Add(body);
    return body;
  }
  void Run() {
    broad_phase_.Predict(loose_.bodies.awake(), kDt);
    broad_phase_.BeginPairs(&loose_.pairs);
    EXPECT_TRUE(BroadPhase::Validate(loose_.bodies.awake()));
  }

  LooseBodies loose_;
  BroadPhase broad_phase_{kOrigin};
};

TEST_F(BroadPhaseTest, PredictsTheParabola) {
  BodyDef def = Dynamic(1, Ball(), {});
  def.initial.linear_velocity = {3, 4, 0};
  const PredictedMotion motion = PredictMotion(Add(def), kDt);
  EXPECT_NEAR(motion.move_m.x, 3 * kDt, 1e-7);
  EXPECT_NEAR(motion.move_m.y, 4 * kDt - kGravity * kDt * kDt / 2, 1e-7);
  EXPECT_NEAR(motion.velocity_m_s.y, 4 - kGravity * kDt, 1e-6);
}

TEST_F(BroadPhaseTest, ReachHoldsTheWholeMotion) {
  BodyDef def = Dynamic(1, Ball(0.5), {2, 0, 0});
  def.initial.linear_velocity = {60, 0, 0};
  RigidBody& ball = Add(def);
  Run();
  EXPECT_LT(ball.reach.min.x, 1.5f);
  EXPECT_GT(ball.reach.max.x, 3.5f);
  EXPECT_LT(ball.reach.max.x, 3.6f);
  EXPECT_LT(ball.reach.max.y, 0.6f);
}

TEST_F(BroadPhaseTest, APairBeginsWhereBoundsOverlapAndOneOfTheTwoMoves) {
  RigidBody& ground = Add(Static(1, Box(5, 0.5, 5)));
  RigidBody& wall = Add(Static(2, Box(0.5, 5, 5)));
  RigidBody& ball = Add(Dynamic(3, Ball(), {3, 1, 0}));
  RigidBody& far = Add(Dynamic(4, Ball(), {3, 40, 0}));
  Run();
  EXPECT_NE(loose_.pairs.Find(ground, ball), nullptr);
  EXPECT_EQ(loose_.pairs.Find(ground, wall), nullptr);
  EXPECT_EQ(loose_.pairs.Find(wall, ball), nullptr);
  EXPECT_EQ(loose_.pairs.Find(ball, far), nullptr);
}

TEST_F(BroadPhaseTest, ABodyThatWasPutElsewhereMeetsWhatIsThere) {
  RigidBody& ball = Add(Dynamic(1, Ball(), {}));
  RigidBody& other = Add(Dynamic(2, Ball(), {20, 0, 0}));
  Run();
  ASSERT_EQ(loose_.pairs.Find(ball, other), nullptr);
  BodyState state = ball.state();
  state.position.x += 19.5;
  ball.Set(state);
  broad_phase_.Move(ball);
  broad_phase_.BeginPairs(&loose_.pairs);
  EXPECT_NE(loose_.pairs.Find(ball, other), nullptr);
}

TEST_F(BroadPhaseTest, ABodyThatWasPutElsewhereTwiceMeetsWhatIsThere) {
  RigidBody& ball = Add(Dynamic(1, Ball(), {}));
  RigidBody& other = Add(Dynamic(2, Ball(), {20, 0, 0}));
  Run();
  for (const double x : {-30.0, 19.5}) {
    BodyState state = ball.state();
    state.position = kOrigin + Vec3d{x, 0, 0};
    ball.Set(state);
    broad_phase_.Move(ball);
  }
  broad_phase_.BeginPairs(&loose_.pairs);
  EXPECT_NE(loose_.pairs.Find(ball, other), nullptr);
}

TEST_F(BroadPhaseTest, ABodyThatLeavesBeforePairsBeginHasNone) {
  RigidBody& stays = Add(Dynamic(1, Ball(), {}));
  RigidBody& leaves = Add(Dynamic(2, Ball(), {0.5, 0, 0}));
  broad_phase_.Remove(leaves);
  broad_phase_.BeginPairs(&loose_.pairs);
  EXPECT_TRUE(stays.pairs.empty());
  broad_phase_.Add(leaves);
  broad_phase_.BeginPairs(&loose_.pairs);
  EXPECT_NE(loose_.pairs.Find(stays, leaves), nullptr);
}

// Bodies fly about and through each other; no two whose bounds in the trees overlap are without a pair.
TEST(BroadPhaseTeamTest, AllThatOverlapHaveAPairWithAnyNumberOfThreads) {
  for (const int threads : {1, 3}) {
    ThreadTeam team(threads);
    LooseBodies loose;
    BroadPhase broad_phase(kOrigin, team);
    std::mt19937 random(3);
    std::uniform_real_distribution<double> place(-8, 8);
    std::uniform_real_distribution<float> speed(-40, 40);
    for (std::uint64_t id = 1; id <= 200; ++id) {
      const Vec3d at{place(random), place(random), place(random)};
      BodyDef def = id % 10 == 0 ? Static(id, Box(1, 1, 1), at) : Dynamic(id, Ball(0.4), at);
      def.initial.position += kOrigin;
      if (id % 10 != 0) def.initial.linear_velocity = {speed(random), speed(random), speed(random)};
      broad_phase.Add(loose.Add(def));
    }
    for (int step = 0; step < 30; ++step) {
      broad_phase.Predict(loose.bodies.awake(), kDt);
      broad_phase.BeginPairs(&loose.pairs);
      ASSERT_TRUE(broad_phase.ValidateTrees());
      int overlapping = 0;
      for (const auto& [id, a] : loose.bodies.all()) {
        for (const auto& [other_id, b] : loose.bodies.all()) {
          if (!(id < other_id) || !(a->dynamic() || b->dynamic()) || !a->fat.Overlaps(b->fat)) continue;
          ++overlapping;
          ASSERT_NE(loose.pairs.Find(*a, *b), nullptr) << id << " and " << other_id << " in step " << step;
        }
      }
      EXPECT_GT(overlapping, 20);
      for (RigidBody* body : loose.bodies.awake()) {
        BodyState state = body->state();
        state.position += Vec3d(state.linear_velocity) * kDt;
        for (const auto part : {&Vec3d::x, &Vec3d::y, &Vec3d::z}) {
          const auto speed_of = part == &Vec3d::x ? &Vec3f::x : part == &Vec3d::y ? &Vec3f::y : &Vec3f::z;
          if (std::abs(state.position.*part - kOrigin.*part) > 8) state.linear_velocity.*speed_of *= -1;
        }
        body->Set(state);
      }
    }
    for (const auto& [id, body] : loose.bodies.all()) broad_phase.Remove(*body);
  }
}

TEST_F(BroadPhaseTest, FindsWhatASweptMotionMayTouch) {
  RigidBody& ball = Add(Dynamic(1, Ball(0.1), {}));
  RigidBody& wall = Add(Static(2, Box(0.1, 5, 5), {4, 0, 0}));
  Add(Static(3, Box(0.1, 5, 5), {9, 0, 0}));
  const Placement& from = ball.placement();
  std::vector<RigidBody*> found;
  broad_phase_.Overlapping(
      broad_phase_.SweptBounds({ball.geometry(), from.position, from.position + Vec3d{5, 0, 0}, from.orientation, {}}),
      &found);
  EXPECT_THAT(found, ::testing::UnorderedElementsAre(&ball, &wall));
}

}  // namespace
}  // namespace tessera::physics
