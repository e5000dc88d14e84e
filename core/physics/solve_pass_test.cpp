// Batches hold each island once with its substeps; what is solved keeps momentum and stands still.
#include "core/physics/solve_pass.h"

#include <gmock/gmock.h>

#include "core/physics/awake_joints.h"
#include "core/physics/integrate.h"
#include "core/physics/testing/loose_bodies.h"
#include "core/physics/trig.h"

namespace tessera::physics {
namespace {

using ::testing::ElementsAre;

class SolveTest : public ::testing::Test {
 protected:
  // Bodies a and b overlap by nothing and may push.
  void Touch(RigidBody& a, RigidBody& b, Vec3f normal) {
    Pair& pair = loose_.AddContact(a, b, normal);
    ActiveContact contact = ContactBetween(IndexOf(*pair.low), IndexOf(*pair.high), normal);
    contact.pair = &pair;
    contact.manifolds = pair.manifolds.data();
    contact.slop_m = pair.slop_m;
    contact.material = pair.material;
    contacts_.push_back(contact);
  }
  static std::uint32_t IndexOf(const RigidBody& body) { return body.awake() ? body.awake_index : kAsleep; }
  SolveInput Input() {
    joints_.Run(loose_.bodies);
    BuildIslands(loose_.bodies.awake().size(), contacts_, joints_.joints(), &islands_);
    plans_.resize(islands_.count());
    return {kDt, loose_.bodies.awake(), contacts_, joints_.joints(), joints_.rows(), islands_, plans_};
  }
  static IslandPlan Plan(int level, bool unanchored = false) {
    return {.solved = true, .unanchored = unanchored, .level = level, .substeps = 1 << level, .load = 0};
  }

  LooseBodies loose_;
  std::vector<ActiveContact> contacts_;
  AwakeJoints joints_;
  Islands islands_;
  std::vector<IslandPlan> plans_;  // by island
};

// Four islands: a pair with 4 substeps, one that flies, a jointed pair with 4, a ball on the ground with 16.
TEST_F(SolveTest, BatchesHoldEachSolvedIslandOnceWithItsSubsteps) {
  std::vector<RigidBody*> balls;
  for (std::uint64_t i = 0; i < 6; ++i)
    balls.push_back(&loose_.Add(Dynamic(i + 1, Ball(), {static_cast<double>(i), 0.5, 0})));
  RigidBody& ground = loose_.Add(Static(7, Ground()));
  Touch(*balls[0], *balls[1], {1, 0, 0});
  Touch(*balls[5], ground, {0, -1, 0});
  loose_.bodies.AddJoint(PointBetween(1, 4, 5, {0.5, 0, 0}, {-0.5, 0, 0}));
  plans_ = {Plan(2), {}, Plan(2), Plan(4)};
  const SolveInput in = Input();
  ASSERT_EQ(islands_.count(), 4U);
  SolveBatches batches;
  batches.Fill(in);
  EXPECT_TRUE(batches.Validate(in));
  const IslandBatch &four = batches.batches()[2], &sixteen = batches.batches()[4];
  EXPECT_EQ(four.substeps, 4);
  EXPECT_THAT(four.sources, ElementsAre(balls[0], balls[1], balls[3], balls[4]));
  EXPECT_EQ(four.contacts.size(), 1U);
  EXPECT_EQ(four.joints.size(), 1U);
  EXPECT_EQ(sixteen.substeps, 16);
  EXPECT_THAT(sixteen.sources, ElementsAre(balls[5]));
  ASSERT_EQ(sixteen.contacts.size(), 1U);
  EXPECT_EQ(sixteen.contacts[0].b, kStatic);
  std::size_t bodies = 0;
  for (const IslandBatch& batch : batches.batches()) bodies += batch.bodies.size();
  EXPECT_EQ(bodies, 5U);
}

TEST_F(SolveTest, ImpulsesOfOtherSubstepsAreScaled) {
  RigidBody &a = loose_.Add(Dynamic(1, Ball(), {})), &b = loose_.Add(Dynamic(2, Ball(), {1, 0, 0}));
  Touch(a, b, {1, 0, 0});
  contacts_[0].substeps = 2;
  plans_ = {Plan(3)};
  SolveBatches batches;
  batches.Fill(Input());
  EXPECT_EQ(batches.batches()[3].contacts[0].warm_scale, 0.25f);
  EXPECT_EQ(contacts_[0].substeps, 8);
  batches.Fill(Input());
  EXPECT_EQ(batches.batches()[3].contacts[0].warm_scale, 1);
}

TEST_F(SolveTest, ABallOnTheGroundStaysAndBearsItsWeight) {
  RigidBody& ground = loose_.Add(Static(1, Ground()));
  RigidBody& ball = loose_.Add(Dynamic(2, Ball(), {0, 0.5, 0}, 3));
  Pair& pair = loose_.AddContact(ground, ball, {0, 1, 0});
  pair.manifolds[0].points[0].r_a = {};
  pair.manifolds[0].points[0].r_b = {0, -0.5f, 0};
  contacts_ = {ContactBetween(kAsleep, 0)};
  contacts_[0].manifolds = pair.manifolds.data();
  contacts_[0].material = pair.material;
  plans_ = {Plan(2)};
  SolvePass pass(true);
  std::vector<BodyMotion> motions(1);
  for (int i = 0; i < 20; ++i) pass.Solve(Input());
  pass.ReadBack(Input(), motions);
  EXPECT_LT(Length(motions[0].velocity), 1e-3f);
  EXPECT_LT(Length(motions[0].position - ball.placement().position), 1e-4);
  EXPECT_NEAR(pair.manifolds[0].points[0].total_impulse, 3 * kGravity * kDt, 1e-3);
}

// A ship and a ball that pushes off it: in single precision the ship would not feel it.
TEST_F(SolveTest, UnanchoredIslandsKeepTheirMomentum) {
  BodyDef ship = Dynamic(1, Cube(5), {}, 2e6), ball = Dynamic(2, Ball(), {0, 5.5, 0}, 1);
  ship.gravity_scale = ball.gravity_scale = 0;
  ship.initial.linear_velocity = {0, 7, 0};
  ball.initial.linear_velocity = {0, 4, 0};
  RigidBody &heavy = loose_.Add(ship), &light = loose_.Add(ball);
  Touch(heavy, light, {0, 1, 0});
  contacts_[0].manifolds[0].points[0].r_a = {0, 5, 0};
  contacts_[0].manifolds[0].points[0].r_b = {0, -0.5f, 0};
  plans_ = {Plan(2, true)};
  SolvePass pass(true);
  std::vector<BodyMotion> motions(2);
  const SolveInput in = Input();
  pass.Solve(in);
  pass.ReadBack(in, motions);
  const double gained = 1.0 * (static_cast<double>(motions[1].velocity.y) - 4);
  EXPECT_GT(gained, 2.9);
  EXPECT_NEAR(motions[0].velocity.y, 7 - gained / 2e6, 3e-7);
}

// A handle that spins beside a ball, which touches it and does not come to push.
class SpinningTest : public SolveTest {
 protected:
  SpinningTest() {
    BodyDef handle = Dynamic(1, Box(1, 0.3, 0.1), {}, 2);
    handle.gravity_scale = 0;
    handle.initial.angular_velocity = {0.1f, 8, 0.1f};
    BodyDef other = Dynamic(2, Ball(), {0, 3, 0});
    other.gravity_scale = 0;
    handle_ = &loose_.Add(handle);
    Touch(*handle_, loose_.Add(other), {0, 1, 0});
    contacts_[0].manifolds[0].points[0].separation_m = 0.5f;
    plans_ = {Plan(2)};
  }
  BodyMotion Solve() {
    SolvePass pass(true);
    std::vector<BodyMotion> motions(2);
    const SolveInput in = Input();
    pass.Solve(in);
    pass.ReadBack(in, motions);
    return motions[0];
  }

  RigidBody* handle_ = nullptr;
};

TEST_F(SpinningTest, InAnIslandItTurnsAsOneThatFlies) {
  const BodyMotion motion = Solve();
  EXPECT_EQ(motion.angular_momentum, handle_->state().angular_momentum);
  EXPECT_EQ(motion.orientation, FreeFlightOf(*handle_, kDt).orientation);
}

TEST_F(SpinningTest, ATorqueGivesItsImpulse) {
  handle_->torque_nm = {3, -2, 1};
  const Vec3f given = Solve().angular_momentum - handle_->state().angular_momentum;
  EXPECT_LT(Length(Vec3d(given) - handle_->torque_nm * kDt), 1e-5);
}

}  // namespace
}  // namespace tessera::physics
