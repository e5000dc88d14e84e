// Kinematic bodies against closed forms; bodies that are put elsewhere, and that are made of something else.
#include <gmock/gmock.h>

#include <cmath>
#include <numbers>

#include "core/physics/body_path.h"
#include "core/physics/character.h"
#include "core/physics/testing/bodies.h"

namespace tessera::physics {
namespace {

BodyDef Platform(std::uint64_t id, ShapePtr shape, Vec3d position, bool path = false) {
  BodyDef def;
  def.id = BodyId(id);
  def.shape = std::move(shape);
  def.kinematic = true;
  def.motion = path ? Motion::kStatic : Motion::kDynamic;
  def.mass_kg = def.gravity_scale = 0;
  def.initial.position = position;
  return def;
}

// A platform whose top is at 0, and what its velocities are made.
class KinematicTest : public testing::Test {
 protected:
  void SetUp() override { world.Add(Platform(1, Box(20, 0.1, 20), {0, -0.1, 0}), {{0, -0.1, 0}, {}, {}, {}}); }
  void Move(Vec3f velocity, Vec3f spin = {}) {
    BodyState state = world.StateOf(kPlatform);
    state.linear_velocity = velocity;
    state.angular_velocity = spin;
    world.SetState(kPlatform, state);
  }
  void AddBody(const BodyDef& def) { world.Add(def, def.initial); }
  Vec3d VelocityOf(std::uint64_t id) { return Vec3d(world.StateOf(BodyId(id)).linear_velocity); }

  static constexpr BodyId kPlatform{1};
  World world{{}};
};

TEST_F(KinematicTest, MovesByItsVelocitiesAndByNothingElse) {
  AddBody(Dynamic(2, Cube(), {0, 3, 0}, 1e6));
  Move({1, 0.5f, 0}, {0, 0.25f, 0});
  Simulate(world, 4);
  const BodyState state = world.StateOf(kPlatform);
  EXPECT_NEAR(state.position.x, 4, 1e-9);
  EXPECT_NEAR(state.position.y, 1.9, 1e-9);
  EXPECT_NEAR(2 * std::atan2(state.orientation.y, state.orientation.w), 1, 1e-9);
  EXPECT_EQ(state.linear_velocity, Vec3f(1, 0.5f, 0));
  EXPECT_EQ(world.MassOf(kPlatform), 0);
}

// Friction speeds the box up at mu g until it is as fast: it has slid by v^2 / (2 mu g).
TEST_F(KinematicTest, CarriesABoxByFriction) {
  AddBody(Dynamic(2, Cube(), {0, 0.5, 0}));
  Simulate(world, 0.2);
  Move({1, 0, 0});
  Simulate(world, 3);
  EXPECT_NEAR(VelocityOf(2).x, 1, 1e-4);
  const double slid_m = world.StateOf(kPlatform).position.x - world.StateOf(BodyId(2)).position.x;
  EXPECT_NEAR(slid_m, 1 / (2 * 0.5 * kGravity), 1 * kDt / 2);
}

// A ball that rolls without slipping on a plate that speeds up gets 2/7 of the plate's speed.
TEST_F(KinematicTest, RollsABallByTwoSevenths) {
  AddBody(Dynamic(2, Ball(), {0, 0.5, 0}));
  Simulate(world, 0.2);
  for (int i = 1; i <= 60; ++i) {
    Move({static_cast<float>(i) / 60, 0, 0});
    world.Step(kDt);
  }
  Simulate(world, 0.5);
  EXPECT_NEAR(VelocityOf(2).x, 2.0 / 7, 0.002);
}

TEST_F(KinematicTest, LiftsABoxAtItsOwnSpeed) {
  AddBody(Dynamic(2, Cube(), {0, 0.5, 0}));
  Simulate(world, 0.2);
  Move({0, 0.5f, 0});
  Simulate(world, 2);
  EXPECT_NEAR(VelocityOf(2).y, 0.5, 1e-3);
  EXPECT_NEAR(world.StateOf(BodyId(2)).position.y - world.StateOf(kPlatform).position.y, 0.6, 0.005);
}

TEST_F(KinematicTest, TurnsABoxAboutItsAxis) {
  AddBody(Dynamic(2, Cube(0.25), {2, 0.25, 0}));
  Simulate(world, 0.2);
  Move({}, {0, 0.5f, 0});
  Simulate(world, std::numbers::pi);  // half a radian a second: a quarter turn
  const Vec3d at = world.StateOf(BodyId(2)).position;
  EXPECT_NEAR(std::hypot(at.x, at.z), 2, 0.05);
  EXPECT_NEAR(std::atan2(-at.z, at.x), std::numbers::pi / 2, 0.08);
}

TEST_F(KinematicTest, WhatIsOnItSleepsOnlyWhileItStands) {
  AddBody(Dynamic(2, Cube(), {0, 0.5, 0}));
  Simulate(world, 3);
  EXPECT_TRUE(world.StateOf(BodyId(2)).asleep);
  Move({0.004f, 0, 0});  // slower than what counts as still
  for (int i = 0; i < 180; ++i) {
    world.Step(kDt);
    ASSERT_FALSE(world.StateOf(BodyId(2)).asleep) << "step " << i;
  }
  EXPECT_NEAR(world.StateOf(BodyId(2)).position.x, 0.012, 0.002);
  Move({});
  Simulate(world, 3);
  EXPECT_TRUE(world.StateOf(BodyId(2)).asleep);
  EXPECT_TRUE(world.StateOf(kPlatform).asleep);
}

TEST_F(KinematicTest, WakesWhatItComesUpon) {
  AddBody(Dynamic(2, Cube(), {0, 0.5, 0}));
  AddBody(Platform(3, Cube(), {3, 0.5, 0}));
  Simulate(world, 3);
  ASSERT_TRUE(world.StateOf(BodyId(2)).asleep);
  BodyState door = world.StateOf(BodyId(3));
  door.linear_velocity = {-1, 0, 0};
  world.SetState(BodyId(3), door);
  Simulate(world, 3);
  EXPECT_NEAR(world.StateOf(BodyId(3)).position.x, 0, 1e-6);
  EXPECT_NEAR(world.StateOf(BodyId(2)).position.x, -1, 0.01);
  EXPECT_NEAR(VelocityOf(2).x, -1, 0.02);
}

TEST_F(KinematicTest, AFastOnePassesThroughNothing) {
  AddBody(Dynamic(2, Ball(0.1), {0, 0.1, 0}));
  AddBody(Platform(3, Box(0.05, 1, 1), {10, 1.05, 0}));
  Simulate(world, 0.1);
  BodyState door = world.StateOf(BodyId(3));
  door.linear_velocity = {-60, 0, 0};  // a metre a step
  world.SetState(BodyId(3), door);
  for (int i = 0; i < 20; ++i) {
    world.Step(kDt);
    ASSERT_LT(world.StateOf(BodyId(2)).position.x, world.StateOf(BodyId(3)).position.x) << "step " << i;
  }
  EXPECT_LT(VelocityOf(2).x, -40);
}

// It connects nothing: both boxes are solved as if they were alone.
TEST_F(KinematicTest, MakesNoIslandOfWhatIsOnIt) {
  World alone({});
  const BodyDef plate = Platform(1, Box(20, 0.1, 20), {0, -0.1, 0});
  const BodyDef box = Dynamic(2, Cube(), {0, 0.5, 0}), other = Dynamic(3, Cube(), {5, 0.7, 3}, 40);
  alone.Add(plate, plate.initial);
  alone.Add(box, box.initial);
  AddBody(box);
  AddBody(other);
  for (int i = 0; i < 120; ++i) {
    Move({0.5f, 0.1f, 0}, {0, 0.1f, 0});
    alone.SetState(kPlatform, world.StateOf(kPlatform));
    world.Step(kDt);
    alone.Step(kDt);
    ASSERT_EQ(world.StateOf(BodyId(2)), alone.StateOf(BodyId(2))) << "step " << i;
  }
}

TEST_F(KinematicTest, HoldsWhatAJointHangsOnIt) {
  AddBody(Platform(3, Cube(0.2), {0, 5, 0}));
  AddBody(Dynamic(2, Cube(0.2), {0, 4, 0}));
  JointDef joint;
  joint.id = JointId(1);
  joint.body_a = BodyId(3);
  joint.body_b = BodyId(2);
  joint.frame_b.position = {0, 1, 0};
  joint.kind = FixedJoint{};
  world.AddJoint(joint);
  Simulate(world, 1);
  BodyState crane = world.StateOf(BodyId(3));
  crane.linear_velocity = {1, 0, 0};
  world.SetState(BodyId(3), crane);
  Simulate(world, 4);
  const Vec3d arm = world.StateOf(BodyId(2)).position - world.StateOf(BodyId(3)).position;
  EXPECT_NEAR(arm.x, 0, 0.02);
  EXPECT_NEAR(arm.y, -1, 0.02);
  EXPECT_NEAR(VelocityOf(2).x, 1, 0.02);
}

TEST_F(KinematicTest, AsATriggerItReportsWhatItComesUpon) {
  AddBody(Dynamic(2, Cube(), {0, 0.5, 0}));
  BodyDef sensor = Platform(3, Cube(), {5, 0.5, 0});
  sensor.trigger = true;
  AddBody(sensor);
  Simulate(world, 3);
  ASSERT_TRUE(world.StateOf(BodyId(2)).asleep);
  BodyState state = world.StateOf(BodyId(3));
  state.linear_velocity = {-2, 0, 0};
  world.SetState(BodyId(3), state);
  std::vector<PairEvent> events;
  for (int i = 0; i < 300; ++i) {
    world.Step(kDt);
    for (const PairEvent& event : world.events()) {
      if (event.trigger) events.push_back(event);
    }
  }
  ASSERT_EQ(events.size(), 2u);
  EXPECT_TRUE(events[0].begin);
  EXPECT_FALSE(events[1].begin);
  EXPECT_NEAR(world.StateOf(BodyId(2)).position.x, 0, 1e-3);
}

TEST_F(KinematicTest, RaysMeetItWhereItIs) {
  Move({0, 1, 0});
  Simulate(world, 3);
  BodyQuery query;
  query.from = {0, 10, 0};
  query.to = {0, -10, 0};
  const QueryResult found = world.FindBodies(query);
  ASSERT_EQ(found.hits.size(), 1u);
  EXPECT_EQ(found.hits[0].body, kPlatform);
  EXPECT_NEAR(found.hits[0].point.y, 3, 1e-6);
}

TEST_F(KinematicTest, HasTheSameBitsOnEverySolver) {
  World portable({.portable = true});
  const BodyDef plate = Platform(1, Box(20, 0.1, 20), {0, -0.1, 0});
  portable.Add(plate, plate.initial);
  for (std::uint64_t i = 0; i < 12; ++i) {
    BodyDef def = Dynamic(2 + i, i % 2 == 0 ? Cube(0.3) : Ball(0.3),
                          {0.1 * static_cast<double>(i), 0.7 + 0.7 * static_cast<double>(i), 0});
    def.material = {.friction = 0.6, .rolling_friction = 0.01, .spinning_friction = 0.01, .restitution = 0.2};
    AddBody(def);
    portable.Add(def, def.initial);
  }
  for (int i = 0; i < 240; ++i) {
    const auto wave = static_cast<float>(i % 60) / 60;
    Move({wave, 0.3f - wave / 2, 0}, {0.1f * wave, wave, 0});
    portable.SetState(kPlatform, world.StateOf(kPlatform));
    world.Step(kDt);
    portable.Step(kDt);
  }
  for (std::uint64_t i = 0; i < 12; ++i) EXPECT_EQ(world.StateOf(BodyId(2 + i)), portable.StateOf(BodyId(2 + i)));
}

// --- Characters

class RiderTest : public testing::Test {
 protected:
  RiderTest() {
    player.body = Dynamic(kFirstPlayerBody + 1, MakeShapePtr(CapsuleShape{0.35, 0.55}), {2, 0.9, 0}, 80);
    player.body.inertia_kg_m2 = Vec3d{1e6, 5, 1e6};
    player.body.material = {.friction = 0};
    player.character.emplace();
    player.character->push_mass_kg = 80;
    const BodyDef plate = Platform(1, Box(8, 0.1, 8), {0, -0.1, 0});
    world.Add(plate, plate.initial);
    world.Add(player.body, player.body.initial);
    Ride(60, {});
  }
  void Ride(int steps, Vec3f velocity, Vec3f spin = {}) {
    for (int i = 0; i < steps; ++i) {
      BodyState state = world.StateOf(BodyId(1));
      state.linear_velocity = velocity;
      state.angular_velocity = spin;
      world.SetState(BodyId(1), state);
      const CharacterDrive drive = DriveCharacter(world, player.body.id, player, {0, -kGravity, 0}, {}, kDt);
      world.ApplyForce(player.body.id, drive.force_n, drive.torque_nm);
      world.Step(kDt);
    }
  }
  Vec3d FromPlate() const { return world.StateOf(player.body.id).position - world.StateOf(BodyId(1)).position; }

  PlayerRules player;
  World world{{}};
};

TEST_F(RiderTest, RidesAlongOnAPlatform) {
  const Vec3d before = FromPlate();
  Ride(10, {1, 0, 0.5f});
  const Vec3d started = FromPlate();
  Ride(300, {1, 0, 0.5f});
  EXPECT_LT(Length(started - before), 0.1);
  EXPECT_LT(Length(FromPlate() - started), 0.01);
}

TEST_F(RiderTest, RidesUpAndDownOnALift) {
  const Vec3d before = FromPlate();
  for (const float speed : {1.0f, -1.0f}) {
    Ride(180, {0, speed, 0});
    EXPECT_NEAR(FromPlate().y, before.y, 0.02);
    EXPECT_NEAR(static_cast<double>(world.StateOf(player.body.id).linear_velocity.y), speed, 0.05);
  }
}

TEST_F(RiderTest, RidesRoundOnATurntable) {
  Ride(30, {}, {0, 0.5f, 0});
  const Vec3d before = FromPlate();
  Ride(360, {}, {0, 0.5f, 0});  // 3 rad
  const Vec3d after = FromPlate();
  EXPECT_NEAR(std::hypot(after.x, after.z), std::hypot(before.x, before.z), 0.1);
  const double turned =
      std::remainder(std::atan2(-after.z, after.x) - std::atan2(-before.z, before.x), 2 * std::numbers::pi);
  EXPECT_NEAR(turned, 3, 0.05);
}

// --- Bodies that are put elsewhere

TEST(TeleportTest, EndsContactsAndWakesWhatItTouched) {
  World world({});
  AddAll(world, {Static(1, Ground()), Dynamic(2, Cube(), {0, 0.5, 0}), Dynamic(3, Cube(), {0, 1.5, 0})});
  Simulate(world, 3);
  ASSERT_TRUE(world.StateOf(BodyId(2)).asleep);
  BodyState state = world.StateOf(BodyId(2));
  state.position = {100, 7, 0};
  state.asleep = false;
  world.Teleport(BodyId(2), state);
  EXPECT_FALSE(world.StateOf(BodyId(3)).asleep);
  world.Step(kDt);
  int ended = 0;
  for (const PairEvent& event : world.events()) ended += event.begin ? 0 : 1;
  EXPECT_EQ(ended, 2);
  Simulate(world, 3);
  EXPECT_NEAR(world.StateOf(BodyId(2)).position.y, 0.5, 0.01);
  EXPECT_NEAR(world.StateOf(BodyId(2)).position.x, 100, 0.01);
  EXPECT_NEAR(world.StateOf(BodyId(3)).position.y, 0.5, 0.01);
}

// A world that had the body from the beginning where it was put does the same with it.
TEST(TeleportTest, LeavesNothingBehind) {
  World world({}), other({});
  for (World* each : {&world, &other}) AddAll(*each, {Static(1, Ground()), Dynamic(2, Cube(), {0, 0.5, 0})});
  Simulate(world, 0.5);
  BodyState state = world.StateOf(BodyId(2));
  state.position = {0.05, 0.6, 0};
  world.Teleport(BodyId(2), state);
  other.Teleport(BodyId(2), state);
  for (int i = 0; i < 60; ++i) {
    world.Step(kDt);
    other.Step(kDt);
    ASSERT_EQ(world.StateOf(BodyId(2)), other.StateOf(BodyId(2))) << "step " << i;
  }
}

TEST(TeleportTest, AParkedBodyIsFoundWhereItWasPut) {
  World world({});
  AddAll(world, {Static(1, Ground()), Dynamic(2, Cube(), {0, 0.5, 0})});
  world.Park(BodyId(2));
  BodyState state = world.StateOf(BodyId(2));
  state.position = {9, 0.5, 0};
  state.linear_velocity = {1, 0, 0};
  world.Teleport(BodyId(2), state);
  Simulate(world, 0.5);
  EXPECT_EQ(world.StateOf(BodyId(2)).position, Vec3d(9, 0.5, 0));
  world.Unpark(BodyId(2));
  Simulate(world, 0.5);
  EXPECT_NEAR(world.StateOf(BodyId(2)).position.x, 9, 1e-3);
}

// --- Bodies that are changed

TEST(TunedBodyTest, FallsByItsOwnGravity) {
  World world({});
  AddAll(world, {Dynamic(2, Cube(), {0, 100, 0}), Dynamic(3, Cube(), {5, 100, 0})});
  world.SetGravityScale(BodyId(2), 0);
  world.SetGravityScale(BodyId(3), -0.5);
  Simulate(world, 1);
  EXPECT_EQ(world.StateOf(BodyId(2)).position, Vec3d(0, 100, 0));
  EXPECT_NEAR(world.StateOf(BodyId(3)).position.y, 100 + kGravity / 4, 1e-4);
}

TEST(TunedBodyTest, SlidesByItsNewFriction) {
  World world({});
  AddAll(world, {Static(1, Ground()), Dynamic(2, Cube(), {0, 0.5, 0})});
  Simulate(world, 0.2);
  world.SetMaterial(BodyId(2), {.friction = 0});
  BodyState state = world.StateOf(BodyId(2));
  state.linear_velocity = {3, 0, 0};
  world.SetState(BodyId(2), state);
  Simulate(world, 2);
  EXPECT_NEAR(world.StateOf(BodyId(2)).position.x, 6, 1e-3);
}

TEST(TunedBodyTest, ASpinIsWhatWasAskedFor) {
  World world({});
  const BodyDef def = Dynamic(2, Box(0.1, 0.4, 0.9), {0, 50, 0}, 3);
  world.Add(def, def.initial);
  const Vec3d asked{0, 0, 4};
  const Vec3f impulse = world.AngularImpulseFor(BodyId(2), asked);
  world.ApplyForce(BodyId(2), {}, impulse * static_cast<float>(1 / kDt));
  world.Step(kDt);
  EXPECT_LT(Length(Vec3d(world.StateOf(BodyId(2)).angular_velocity) - asked), 1e-4);
}

}  // namespace
}  // namespace tessera::physics
