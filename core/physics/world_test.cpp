// State goes in and out, and the same calls give the same bits.
#include "core/physics/world.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <random>

#include "core/physics/testing/bodies.h"

namespace tessera::physics {
namespace {

ShapePtr Lopsided() {
  return MakeShapePtr(CompoundShape{{{{{0, 0, 0}, {}}, Box(0.6, 0.1, 0.1)},
                                     {{{0.5, 0.4, 0}, {}}, Box(0.1, 0.3, 0.1)},
                                     {{{-0.4, 0, 0.3}, {}}, Ball(0.15)}}});
}

ShapePtr Wedge() {
  return MakeShapePtr(ConvexHullShape{{{0, 0, 0}, {1, 0, 0}, {0, 0.6f, 0}, {0, 0, 0.8f}, {0.4f, 0.5f, 0.1f}}});
}

// Boxes, balls, cylinders, cones, capsules, hulls and compounds thrown together; ids on both sides of 2^32.
std::vector<BodyDef> Heap(std::size_t count, unsigned seed) {
  const ShapePtr shapes[] = {Cube(0.4),
                             Ball(0.4),
                             MakeShapePtr(CylinderShape{0.3, 0.4}),
                             MakeShapePtr(ConeShape{0.4, 0.9}),
                             MakeShapePtr(CapsuleShape{0.25, 0.3}),
                             Lopsided(),
                             Wedge()};
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> unit(-1, 1);
  std::vector<BodyDef> bodies = {Static(5, Ground())};
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint64_t id = i % 3 == 0 ? kFirstPlayerBody + 1 + i : 4'000'000'000 + i;
    BodyDef body =
        Dynamic(id, shapes[i % 7], {2.0 * unit(random), 0.6 + 0.3 * static_cast<double>(i), 2.0 * unit(random)});
    body.initial.linear_velocity = {unit(random), unit(random), unit(random)};
    body.initial.angular_velocity = {unit(random), unit(random), unit(random)};
    body.material = {.friction = 0.5, .rolling_friction = 0.005, .spinning_friction = 0.01, .restitution = 0.2};
    bodies.push_back(body);
  }
  return bodies;
}

std::vector<BodyState> StatesOf(const World& world, std::vector<BodyDef> bodies) {
  std::sort(bodies.begin(), bodies.end(), [](const BodyDef& a, const BodyDef& b) { return a.id < b.id; });
  std::vector<BodyState> states;
  states.reserve(bodies.size());
  for (const BodyDef& body : bodies) states.push_back(world.StateOf(body.id));
  return states;
}

// --- Parking

TEST(ParkingTest, AParkedBodyHangsWhereItIsAndNothingTouchesIt) {
  World world({});
  world.Add(Static(1, Ground()), {});
  const BodyDef held = Dynamic(2, Cube(0.5), {0, 3, 0}), falling = Dynamic(3, Cube(0.5), {0, 6, 0});
  world.Add(held, held.initial);
  world.Add(falling, falling.initial);
  for (int i = 0; i < 10; ++i) world.Step(1.0 / 60);
  world.Park(held.id);
  const BodyState parked = world.StateOf(held.id);
  for (int i = 0; i < 120; ++i) {
    world.ApplyForce(held.id, {100, 0, 0}, {});
    world.Step(1.0 / 60);
  }
  EXPECT_TRUE(world.IsParked(held.id));
  EXPECT_EQ(world.StateOf(held.id).position, parked.position);
  EXPECT_EQ(Length(world.StateOf(held.id).linear_velocity), 0);
  EXPECT_LT(world.StateOf(falling.id).position.y, 1.01);  // went through
  EXPECT_TRUE(world.isolated().empty());
  EXPECT_THAT(world.Overlapping(Aabb{{-1, 2, -1}, {1, 4, 1}}), ::testing::ElementsAre(BodyId(1)));  // the ground
}

TEST(ParkingTest, ABodyThatIsParkedNoMoreFallsAndCollidesAsBefore) {
  World world({});
  world.Add(Static(1, Ground()), {});
  const BodyDef body = Dynamic(2, Cube(0.5), {0, 3, 0});
  world.Add(body, body.initial);
  world.Park(body.id);
  for (int i = 0; i < 60; ++i) world.Step(1.0 / 60);
  world.Unpark(body.id);
  EXPECT_FALSE(world.IsParked(body.id));
  for (int i = 0; i < 300; ++i) world.Step(1.0 / 60);
  EXPECT_NEAR(world.StateOf(body.id).position.y, 0.5, 0.01);
  world.Park(body.id);
  world.Remove(body.id);
  world.Step(1.0 / 60);
  EXPECT_FALSE(world.Has(body.id));
}

// --- Same bits

TEST(DeterminismTest, SameCallsGiveTheSameBits) {
  const std::vector<BodyDef> bodies = Heap(60, 1);
  World a({}), b({});
  AddAll(a, bodies);
  AddAll(b, bodies);
  for (int i = 0; i < 600; ++i) {
    a.Step(kDt);
    b.Step(kDt);
  }
  EXPECT_EQ(StatesOf(a, bodies), StatesOf(b, bodies));
}

TEST(DeterminismTest, OrderOfInsertionLeavesNoTrace) {
  std::vector<BodyDef> bodies = Heap(60, 2);
  World a({});
  AddAll(a, bodies);
  std::mt19937 random(3);
  std::shuffle(bodies.begin(), bodies.end(), random);
  World b({});
  AddAll(b, bodies);
  for (int i = 0; i < 900; ++i) {
    a.Step(kDt);
    b.Step(kDt);
    ASSERT_EQ(StatesOf(a, bodies), StatesOf(b, bodies)) << "step " << i;
    ASSERT_TRUE(std::equal(a.events().begin(), a.events().end(), b.events().begin(), b.events().end())) << "step " << i;
  }
  EXPECT_GT(a.asleep_count(), 0u);
}

// Joints are solved in the order of their ids.
TEST(DeterminismTest, OrderOfJointsLeavesNoTrace) {
  std::vector<BodyDef> bodies = {Static(1, Ground())};
  std::vector<JointDef> joints;
  for (std::uint32_t i = 0; i < 12; ++i) {
    bodies.push_back(Dynamic(10 + i, Cube(0.2), {0.6 * i, 2, 0.1 * i}));
    if (i == 0) continue;
    joints.push_back({.id = JointId(i),
                      .body_a = BodyId(9 + i),
                      .body_b = BodyId(10 + i),
                      .frame_a = {{0.3, 0, 0.05}, {}},
                      .frame_b = {{-0.3, 0, -0.05}, {}},
                      .bodies_collide = false,
                      .kind = PointJoint{}});
  }
  World a({}), b({});
  AddAll(a, bodies);
  for (const JointDef& joint : joints) a.AddJoint(joint);
  std::reverse(bodies.begin(), bodies.end());
  std::reverse(joints.begin(), joints.end());
  AddAll(b, bodies);
  for (const JointDef& joint : joints) b.AddJoint(joint);
  Simulate(a, 5);
  Simulate(b, 5);
  EXPECT_EQ(StatesOf(a, bodies), StatesOf(b, bodies));
}

// Other bodies in a world, and the company in which islands are solved, leave no trace.
TEST(DeterminismTest, PairIsTheSameInAnyCompany) {
  const BodyDef ground = Static(5, Ground());
  BodyDef lower = Dynamic(20, Cube(), {0, 0.5, 0}), upper = Dynamic(kFirstPlayerBody + 9, Cube(), {0.2, 1.7, 0.1});
  upper.initial.angular_velocity = {0.4f, 0.2f, 0.1f};
  World alone({}), crowded({});
  AddAll(alone, {ground, lower, upper});
  std::vector<BodyDef> crowd = Heap(40, 4);
  for (BodyDef& body : crowd) {
    if (body.motion == Motion::kStatic) continue;
    body.initial.position.x += 100;
  }
  AddAll(crowded, crowd);
  AddAll(crowded, {upper, lower});
  for (int i = 0; i < 600; ++i) {
    alone.Step(kDt);
    crowded.Step(kDt);
    ASSERT_EQ(alone.StateOf(lower.id), crowded.StateOf(lower.id)) << i;
    ASSERT_EQ(alone.StateOf(upper.id), crowded.StateOf(upper.id)) << i;
  }
}

// Both worlds get positions that both can hold exactly, in every step. A world's memory of a contact is its own, and
// differs by the resolution of a double at 1e6 m; so where a choice hangs by a hair, it may fall otherwise: in 20 heaps
// that were tried, in 1 of 100 000 cases.
TEST(OriginTest, FarFromHomeIsAsAtHome) {
  const Vec3d far{1e6, 0, -1e6};
  const std::vector<BodyDef> bodies = Heap(40, 5);
  World home({}), away({.origin = far});
  AddAll(home, bodies);
  for (BodyDef body : bodies) {
    body.initial.position += far;
    // A double at 1e6 m resolves 1e-10 m; home gets the same position.
    away.Add(body, body.initial);
  }
  for (const BodyDef& body : bodies) {
    BodyState state = home.StateOf(body.id);
    state.position = away.StateOf(body.id).position - far;
    home.SetState(body.id, state);
  }
  int equal = 0;  // to the bit
  int apart = 0;
  for (int i = 0; i < 600; ++i) {
    home.Step(kDt);
    away.Step(kDt);
    for (const BodyDef& body : bodies) {
      BodyState at_home = home.StateOf(body.id);
      const BodyState at_away = away.StateOf(body.id);
      ASSERT_NEAR(Length(at_home.position + far - at_away.position), 0, 0.02) << "step " << i << " body " << body.id;
      apart += Length(at_home.position + far - at_away.position) > 2e-3 ||
               Length(at_home.linear_velocity - at_away.linear_velocity) > 0.2F;
      equal += at_home.linear_velocity == at_away.linear_velocity;
      at_home = at_away;
      at_home.position = at_away.position - far;
      home.SetState(body.id, at_home);
    }
  }
  EXPECT_LE(apart, 600 * static_cast<int>(bodies.size()) / 5000);
  EXPECT_GT(equal, 600 * static_cast<int>(bodies.size()) * 8 / 10);
}

// --- State

TEST(StateTest, WhatOneWorldReadsOutAnotherHoldsToTheBit) {
  const std::vector<BodyDef> bodies = Heap(40, 6);
  World source({});
  AddAll(source, bodies);
  Simulate(source, 1);
  World copy({});
  for (const BodyDef& body : bodies) copy.Add(body, source.StateOf(body.id));
  EXPECT_EQ(StatesOf(copy, bodies), StatesOf(source, bodies));
  // In free flight from equal states they stay equal: nothing hidden was lost on the way.
  World flying({}), followed({});
  BodyDef body = Dynamic(2, Lopsided(), {0, 100, 0});
  body.initial.angular_velocity = {3, 2, 1};
  flying.Add(body, body.initial);
  Simulate(flying, 0.5);
  followed.Add(body, flying.StateOf(body.id));
  for (int i = 0; i < 60; ++i) {
    flying.Step(kDt);
    followed.Step(kDt);
    ASSERT_EQ(flying.StateOf(body.id), followed.StateOf(body.id)) << i;
  }
}

TEST(StateTest, SetStateGivesWhatWasSet) {
  World world({.origin = {500, 0, 500}});
  BodyDef body = Dynamic(2, Lopsided(), {501, 3, 502});
  world.Add(body, body.initial);
  BodyState state;
  state.position = {512.3, 4.5, 480.25};
  state.orientation = Normalized(Quatd{0.1, 0.2, 0.3, 0.9});
  state.linear_velocity = {1, 2, 3};
  state.angular_velocity = {4, 5, 6};
  world.SetState(body.id, state);
  BodyState set = world.StateOf(body.id);
  EXPECT_NE(set.angular_momentum, Vec3f());
  world.SetState(body.id, set);
  EXPECT_EQ(world.StateOf(body.id), set);
  set.angular_momentum = {};
  EXPECT_EQ(set, state);
  const Aabb bounds = world.BoundsOf(body.id);
  EXPECT_TRUE(bounds.Contains(state.position));
  const Vec3d up{0, 5, 0};
  EXPECT_FALSE(world.FindBodies({.from = state.position + up, .to = state.position - up}).hits.empty());
  EXPECT_THAT(world.Overlapping(Aabb{{500, 2, 501}, {503, 4, 503}}), testing::IsEmpty());
}

// A body may get a state in each tick that another world computes. If it is there anyway, its contacts go on as if
// nothing had happened.
TEST(StateTest, SettingTheSameStateEachTickChangesNothing) {
  const std::vector<BodyDef> bodies = Heap(40, 7);
  World plain({}), updated({});
  AddAll(plain, bodies);
  AddAll(updated, bodies);
  for (int i = 0; i < 900; ++i) {
    plain.Step(kDt);
    updated.Step(kDt);
    for (const BodyDef& body : bodies) updated.SetState(body.id, plain.StateOf(body.id));
    ASSERT_EQ(StatesOf(plain, bodies), StatesOf(updated, bodies)) << i;
    ASSERT_EQ(plain.asleep_count(), updated.asleep_count()) << i;
  }
  EXPECT_GT(plain.asleep_count(), 0u);
}

TEST(StateTest, MassAndInertiaAreTheShapesOrWhatWasSaid) {
  World world({});
  BodyDef box = Dynamic(2, Box(0.5, 1, 1.5), {}, 12), said = Dynamic(3, Box(0.5, 1, 1.5), {9, 0, 0}, 12);
  said.inertia_kg_m2 = Vec3d{1, 2, 3};
  AddAll(world, {Static(1, Ground()), box, said});
  EXPECT_EQ(world.MassOf(BodyId(1)), 0);
  EXPECT_EQ(world.InertiaOf(BodyId(1)), Vec3d());
  EXPECT_EQ(world.MassOf(box.id), 12);
  EXPECT_EQ(world.InertiaOf(box.id), (Vec3d{1 + 2.25, 0.25 + 2.25, 0.25 + 1} * 4.0));
  EXPECT_EQ(world.InertiaOf(said.id), (Vec3d{1, 2, 3}));
  world.ApplyImpulse(said.id, {12, 0, 0}, {0, 0, 6});
  EXPECT_NEAR(world.StateOf(said.id).linear_velocity.x, 1, 1e-6);
  EXPECT_NEAR(world.StateOf(said.id).angular_velocity.z, 2, 1e-6);
}

// A lopsided body turns about its centre of mass, and spun about none of its principal axes keeps its angular momentum.
TEST(StateTest, PositionIsTheCentreOfMass) {
  World world({.gravity_m_s2 = {}});
  BodyDef body = Dynamic(2, Lopsided(), {1, 2, 3});
  body.initial.angular_velocity = {0, 0, 3};
  world.Add(body, body.initial);
  Simulate(world, 2);
  EXPECT_LT(Length(world.StateOf(body.id).position - body.initial.position), 1e-5);
}

TEST(StateTest, ForcesActForOneStepAboutTheCentreOfMass) {
  World world({.gravity_m_s2 = {}});
  BodyDef body = Dynamic(2, Ball(), {}, 10);  // 1 kg m^2
  world.Add(body, body.initial);
  world.ApplyForce(body.id, {600, 0, 0}, {0, 60, 0});
  Simulate(world, 0.5);
  EXPECT_NEAR(world.StateOf(body.id).linear_velocity.x, 1, 1e-5);
  EXPECT_NEAR(world.StateOf(body.id).angular_velocity.y, 1, 1e-5);
}

TEST(StateTest, GravityScaleAndDampingAreTheBodysOwn) {
  World world({});
  BodyDef floats = Dynamic(2, Ball(), {}), rises = Dynamic(3, Ball(), {5, 0, 0}),
          damped = Dynamic(4, Ball(), {10, 0, 0});
  floats.gravity_scale = damped.gravity_scale = 0;
  rises.gravity_scale = -0.5;
  damped.linear_damping = 0.3;
  damped.angular_damping = 0.6;
  damped.initial.linear_velocity = {0, 0, 2};
  damped.initial.angular_velocity = {0, 2, 0};
  AddAll(world, {floats, rises, damped});
  Simulate(world, 1);
  EXPECT_EQ(world.StateOf(floats.id).position, Vec3d());
  EXPECT_NEAR(world.StateOf(rises.id).linear_velocity.y, kGravity / 2, 1e-3);
  EXPECT_NEAR(world.StateOf(damped.id).linear_velocity.z, 2 * 0.7, 1e-4);
  EXPECT_NEAR(world.StateOf(damped.id).angular_velocity.y, 2 * 0.4, 1e-4);
}

// A box that lies on another falls through it when both are of one exclusion group, and lies on it otherwise.
TEST(ExclusionGroupTest, TwoOfOneGroupDoNotTouchEachOther) {
  for (const bool both : {false, true}) {
    World world({});
    AddAll(world, {Static(1, Ground()), Dynamic(2, Cube(), {0, 0.5, 0}), Dynamic(3, Cube(), {0, 1.5, 0})});
    world.SetExclusionGroup(BodyId(2), ExclusionGroup{1});
    if (both) world.SetExclusionGroup(BodyId(3), ExclusionGroup{1});
    Simulate(world, 1);
    EXPECT_NEAR(world.StateOf(BodyId(2)).position.y, 0.5, 0.01);
    EXPECT_NEAR(world.StateOf(BodyId(3)).position.y, both ? 0.5 : 1.5, 0.01);
  }
}

// A body that is only near is no neighbour in a pile.
TEST(TouchingTest, IsNamedByTags) {
  World world({});
  AddAll(world, {Static(1, Ground()), Dynamic(2, Cube(), {0, 0.5, 0}), Dynamic(3, Cube(), {0, 1.5, 0}),
                 Dynamic(4, Cube(), {1.05, 0.5, 0})});
  for (std::uint32_t id = 2; id <= 4; ++id) world.SetTag(BodyId(id), id);
  Simulate(world, 0.5);
  std::vector<std::uint32_t> near, touching;
  world.AddNear(BodyId(2), &near);
  world.AddTouching(BodyId(2), &touching);
  EXPECT_THAT(near, ::testing::UnorderedElementsAre(kNoTag, 3, 4));
  EXPECT_THAT(touching, ::testing::UnorderedElementsAre(kNoTag, 3));
}

// Whoever keeps the states of bodies and takes over those of each step has the world's, as long as nobody else sets
// any.
TEST(SteppedTest, BodiesThatAStepChangedAreNamedByTags) {
  World world({});
  AddAll(world, {Static(1, Ground()), Dynamic(2, Cube(), {0, 0.5, 0}), Dynamic(3, Cube(), {0, 1.6, 0}),
                 Dynamic(4, Cube(), {5, 0.5, 0})});
  std::vector<BodyState> kept(5);
  for (std::uint32_t id = 1; id <= 4; ++id) {
    world.SetTag(BodyId(id), id);
    kept[id] = world.StateOf(BodyId(id));
  }
  std::vector<std::uint32_t> last;
  const auto step = [&] {
    world.Step(kDt);
    last.clear();
    world.ForEachStepped([&](std::uint32_t tag, const BodyState& state) {
      last.push_back(tag);
      kept[tag] = state;
    });
    for (std::uint32_t id = 1; id <= 4; ++id) EXPECT_EQ(kept[id], world.StateOf(BodyId(id)));
  };
  for (int i = 0; i < 400; ++i) step();
  ASSERT_EQ(world.asleep_count(), 3u);
  EXPECT_THAT(last, ::testing::IsEmpty());
  world.ApplyImpulse(BodyId(4), {0.5f, 0, 0}, {});
  step();
  EXPECT_THAT(last, ::testing::ElementsAre(4));
  for (int i = 0; i < 400; ++i) step();
  EXPECT_EQ(world.asleep_count(), 3u);
}

}  // namespace
}  // namespace tessera::physics
