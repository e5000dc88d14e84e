// Each joint against its closed form.

#include <gmock/gmock.h>

#include <cmath>
#include <numbers>

#include "core/physics/testing/bodies.h"
#include "core/physics/testing/turns.h"
#include "scenes/measured/across.h"
#include "scenes/measured/linkages.h"

namespace tessera::physics {
namespace {

constexpr double kPi = std::numbers::pi;

BodyDef Awake(BodyDef def) {
  def.may_sleep = false;
  return def;
}

template <class Kind>
JointDef ToWorld(std::uint64_t body, Pose in_body, Pose in_world, Kind kind) {
  return {.id = JointId(1),
          .body_a = BodyId(body),
          .body_b = BodyId(),
          .frame_a = in_body,
          .frame_b = in_world,
          .bodies_collide = false,
          .kind = kind};
}

template <class Kind>
JointDef Between(std::uint64_t a, std::uint64_t b, Pose in_a, Pose in_b, Kind kind) {
  JointDef def = ToWorld(a, in_a, in_b, kind);
  def.body_b = BodyId(b);
  return def;
}

// The turn about z of an orientation that turns about z alone.
double AngleAboutZ(const World& world, BodyId id) {
  const Quatd q = world.StateOf(id).orientation;
  return 2 * std::atan2(q.z, q.w);
}
Vec3f Spin(const World& world, std::uint64_t id) { return world.StateOf(BodyId(id)).angular_velocity; }
Vec3d Position(const World& world, std::uint64_t id) { return world.StateOf(BodyId(id)).position; }

// Time between the first and the last of the upward passages through 0, divided by their number less one.
template <class Read>
double Period(World& world, double seconds, Read read) {
  double before = read(), first = -1, last = -1;
  int count = 0;
  for (int i = 1; i <= static_cast<int>(seconds / kDt); ++i) {
    world.Step(kDt);
    const double now = read();
    if (before < 0 && now >= 0) {
      last = (i - now / (now - before)) * kDt;
      if (count++ == 0) first = last;
    }
    before = now;
  }
  return count > 1 ? (last - first) / (count - 1) : -1;
}

TEST(HingeTest, PendulumHasItsPeriod) {
  World world({});
  const double arm = 1, half = 0.1, amplitude = 0.1;
  BodyDef bob = Awake(Dynamic(2, Cube(half), {std::sin(amplitude), -std::cos(amplitude), 0}, 3));
  bob.initial.orientation = About({0, 0, 1}, amplitude);
  AddAll(world, {bob});
  world.AddJoint(ToWorld(2, {{0, arm, 0}, {}}, {}, HingeJoint{}));
  const double inertia = arm * arm + 2.0 / 3 * half * half;  // for 1 kg, about the axis
  const double expected = 2 * kPi * std::sqrt(inertia / (kGravity * arm)) * (1 + amplitude * amplitude / 16);
  EXPECT_NEAR(Period(world, 20, [&] { return AngleAboutZ(world, BodyId(2)); }), expected, 0.01 * expected);
  EXPECT_NEAR(Length(Position(world, 2)), arm, 0.01);
}

TEST(HingeTest, StopsAtItsLimits) {
  for (const double push : {3.0, -3.0}) {
    World world({.gravity_m_s2 = {}});
    AddAll(world, {Awake(Dynamic(2, Cube(), {}))});
    world.AddJoint(ToWorld(2, {}, {}, HingeJoint{.limit_rad = {-0.5, 1.0}, .motor = {}}));
    for (int i = 0; i < 300; ++i) {
      world.ApplyForce(BodyId(2), {}, {0, 0, static_cast<float>(push)});
      world.Step(kDt);
    }
    EXPECT_NEAR(AngleAboutZ(world, BodyId(2)), push > 0 ? 1.0 : -0.5, 0.03);
  }
}

TEST(HingeTest, MotorTurnsAtItsSpeedWithAtMostItsTorque) {
  World world({.gravity_m_s2 = {}});
  AddAll(world, {Awake(Dynamic(2, Cube(), {}, 6))});  // 1 kg m^2
  world.AddJoint(ToWorld(2, {}, {}, HingeJoint{.limit_rad = {}, .motor = {.target_velocity = 2, .max_force = 1}}));
  Simulate(world, 1);
  EXPECT_NEAR(Spin(world, 2).z, 1, 0.02);  // 1 N m for 1 s
  Simulate(world, 2);
  EXPECT_NEAR(Spin(world, 2).z, 2, 0.01);
}

TEST(HingeTest, CountsTheTurnOfBAgainstA) {
  World world({.gravity_m_s2 = {}});
  AddAll(world, {Awake(Dynamic(2, Cube(), {})), Awake(Dynamic(3, Cube(), {0, 0, 2}))});
  world.AddJoint(Between(2, 3, {{0, 0, 1}, {}}, {{0, 0, -1}, {}},
                         HingeJoint{.limit_rad = {}, .motor = {.target_velocity = 2, .max_force = 100}}));
  Simulate(world, 1);
  EXPECT_NEAR(Spin(world, 3).z - Spin(world, 2).z, 2, 0.01);
  EXPECT_NEAR(Spin(world, 3).z + Spin(world, 2).z, 0, 0.01);
}

TEST(SliderTest, KeepsToItsAxisAndItsLimits) {
  World world({});
  const Quatd along = About({0, 0, 1}, 0.5);
  BodyDef body = Awake(Dynamic(2, Cube(), {}, 2));
  body.initial.orientation = along;
  AddAll(world, {body});
  world.AddJoint(ToWorld(2, {}, {{}, along}, SliderJoint{.limit_m = {-2, 3}, .motor = {}}));
  Simulate(world, 5);  // slides down
  const Vec3d p = Position(world, 2);
  EXPECT_NEAR(Dot(p, Rotate(along, Vec3d{1, 0, 0})), -2, 0.05);
  EXPECT_NEAR(Dot(p, Rotate(along, Vec3d{0, 1, 0})), 0, 0.02);
}

TEST(SliderTest, MotorMovesAtItsSpeed) {
  World world({.gravity_m_s2 = {}});
  AddAll(world, {Awake(Dynamic(2, Cube(), {}))});
  world.AddJoint(ToWorld(2, {}, {}, SliderJoint{.limit_m = {}, .motor = {.target_velocity = 1.5, .max_force = 100}}));
  Simulate(world, 2);
  EXPECT_NEAR(world.StateOf(BodyId(2)).linear_velocity.x, 1.5, 0.01);
  EXPECT_NEAR(Position(world, 2).x, 3, 0.05);
}

TEST(PointTest, HoldsTogetherAndTurnsFreely) {
  World world({});
  BodyDef body = Awake(Dynamic(2, Cube(), {1, 0, 0}));
  AddAll(world, {body});
  world.AddJoint(ToWorld(2, {{-1, 0, 0}, {}}, {}, PointJoint{}));
  double widest = 0, lowest = 0;
  for (int i = 0; i < 240; ++i) {
    world.Step(kDt);
    const BodyState state = world.StateOf(body.id);
    widest = std::max(widest, Length(state.position + Rotate(state.orientation, Vec3d{-1, 0, 0})));
    lowest = std::min(lowest, state.position.y);
  }
  EXPECT_LT(widest, 0.03);
  EXPECT_LT(lowest, -0.9);
}

// At its centre a joint has nothing to do but to let the body tumble: about its middle axis, which flips it.
// A contact need not learn to bear a weight that a joint bears.
TEST(PointTest, AHangingBodyThatJustTouchesTheGroundStaysThereWhenItsContactsArePrimed) {
  World world({});
  const BodyDef ground = Static(1, Ground(), {}), box = Dynamic(2, Cube(), {0, 0.5, 0});
  world.Add(ground, ground.initial);
  world.Add(box, box.initial);
  world.AddJoint(ToWorld(2, {}, {{0, 0.5, 0}, {}}, PointJoint{}));
  world.PrimeContacts(1.0 / 60, 6);
  world.Step(1.0 / 60);
  EXPECT_LT(Length(world.StateOf(BodyId(2)).linear_velocity), 1e-4);
  for (const Contact& contact : world.contacts()) EXPECT_LT(Length(contact.impulse_on_b), 0.01);  // it weighs .16 N s
}

TEST(PointTest, LetsABodyHeldAtItsCentreTumble) {
  World world({.gravity_m_s2 = {}});
  BodyDef handle = Awake(Dynamic(1, Cube(), {0, 5, 0}));
  handle.inertia_kg_m2 = Vec3d{1, 2, 3};
  handle.initial.angular_velocity = {0.05f, 5, 0.05f};
  AddAll(world, {handle});
  world.AddJoint(ToWorld(1, {}, {{0, 5, 0}, {}}, PointJoint{}));
  const auto energy = [&world] {
    const BodyState state = world.StateOf(BodyId(1));
    return Dot(Vec3d(state.angular_momentum), Vec3d(state.angular_velocity)) / 2;
  };
  const double start = energy();
  const Vec3f momentum = world.StateOf(BodyId(1)).angular_momentum;
  int flips = 0;
  for (int i = 0; i < 1200; ++i) {
    const bool up = Rotate(world.StateOf(BodyId(1)).orientation, Vec3d{0, 1, 0}).y > 0;
    world.Step(kDt);
    flips += up != (Rotate(world.StateOf(BodyId(1)).orientation, Vec3d{0, 1, 0}).y > 0);
    EXPECT_NEAR(energy() / start, 1, 0.01);
  }
  EXPECT_GE(flips, 3);
  EXPECT_LT(Length(world.StateOf(BodyId(1)).angular_momentum - momentum), 1e-4f * Length(momentum));
}

// Limbs that whirl turn by a radian in a step, and their joints must hold them as they are then.
TEST(JointTest, AFigureThatLandsStaysTogether) {
  const Scene scene = scenes::Ragdolls(4);
  World world({.gravity_m_s2 = scene.gravity_m_s2});
  for (const BodyDef& body : scene.bodies) world.Add(body, body.initial);
  for (const JointDef& joint : scene.joints) world.AddJoint(joint);
  for (int i = 0; i < 180; ++i) {
    world.Step(kDt);
    for (const JointDef& joint : scene.joints) {
      const BodyState b = world.StateOf(joint.body_b);
      ASSERT_LT(scenes::GapOf(joint, world.StateOf(joint.body_a), &b), 0.015) << "step " << i;
    }
  }
}

// A bridge is held at both ends, so corrections of a sweep along it must not add up at the far end.
TEST(JointTest, ABridgeThatIsBombardedStaysWhole) {
  const Scene scene = scenes::Bridge();
  World world({.gravity_m_s2 = scene.gravity_m_s2});
  for (const BodyDef& body : scene.bodies) world.Add(body, body.initial);
  for (const JointDef& joint : scene.joints) world.AddJoint(joint);
  double widest = 0;
  for (int i = 0; i < 480; ++i) {
    world.Step(kDt);
    for (const JointDef& joint : scene.joints) {
      const BodyState a = world.StateOf(joint.body_a);
      const BodyState b = joint.body_b != BodyId() ? world.StateOf(joint.body_b) : BodyState();
      widest = std::max(widest, scenes::GapOf(joint, a, joint.body_b != BodyId() ? &b : nullptr));
    }
  }
  EXPECT_LT(widest, 0.1);
}

TEST(FixedTest, HoldsABeamAgainstGravity) {
  World world({});
  AddAll(world, {Awake(Dynamic(2, Box(1, 0.1, 0.1), {1, 0, 0}))});
  world.AddJoint(ToWorld(2, {{-1, 0, 0}, {}}, {}, FixedJoint{}));
  Simulate(world, 3);
  EXPECT_NEAR(Position(world, 2).y, 0, 0.03);
  EXPECT_NEAR(AngleAboutZ(world, BodyId(2)), 0, 0.03);
}

TEST(ConeTwistTest, KeepsWithinItsConeAndItsTwist) {
  // The body hangs along -y by its x axis, and is pushed sideways about z or y of the frame, or twisted about x.
  const Quatd down = About({0, 0, 1}, -kPi / 2);  // frame x points down
  struct Case {
    Vec3d torque;  // in the frame
    double limit;
  };
  const double swing_y = 0.3, swing_z = 0.6, twist = 0.4;
  for (const Case& c : {Case{{0, 1, 0}, swing_y}, Case{{0, 0, 1}, swing_z}, Case{{1, 0, 0}, twist}}) {
    World world({.gravity_m_s2 = {}});
    AddAll(world, {Awake(Dynamic(2, Ball(), {}))});
    world.AddJoint(ToWorld(2, {{}, down}, {{}, down},
                           ConeTwistJoint{.swing_y_rad = swing_y, .swing_z_rad = swing_z, .twist_rad = twist}));
    const Vec3f torque(Rotate(down, c.torque) * 0.05);
    double widest = 0;
    for (int i = 0; i < 600; ++i) {
      world.ApplyForce(BodyId(2), {}, torque);
      world.Step(kDt);
      const Quatd q = world.StateOf(BodyId(2)).orientation;
      widest = 2 * std::atan2(Length(Vec3d{q.x, q.y, q.z}), std::abs(q.w));
    }
    EXPECT_NEAR(widest, c.limit, 0.06) << c.torque;
  }
}

TEST(SixDofTest, LinearSpringHasItsFrequencyAndItsRest) {
  World world({.gravity_m_s2 = {}});
  AddAll(world, {Awake(Dynamic(2, Cube(), {0, 1.5, 0}, 2))});
  SixDofJoint joint;
  joint.axes[1] = {.limit = {}, .motor = {}, .spring = {.stiffness = 2 * 36, .damping = 0, .rest = 1}};  // 6 rad/s
  world.AddJoint(ToWorld(2, {}, {}, joint));
  EXPECT_NEAR(Period(world, 10, [&] { return Position(world, 2).y - 1; }), 2 * kPi / 6, 0.02);
  EXPECT_NEAR(Position(world, 2).x, 0, 1e-3);
}

TEST(SixDofTest, DampingDecaysAsItShould) {
  World world({.gravity_m_s2 = {}});
  AddAll(world, {Awake(Dynamic(2, Cube(), {0, 1, 0}, 2))});
  SixDofJoint joint;
  joint.axes[1] = {.limit = {}, .motor = {}, .spring = {.stiffness = 2 * 36, .damping = 2 * 2 * 0.5, .rest = 0}};
  world.AddJoint(ToWorld(2, {}, {}, joint));
  double highest = 0;
  Simulate(world, 4);
  for (int i = 0; i < 70; ++i) {
    world.Step(kDt);
    highest = std::max(highest, Position(world, 2).y);
  }
  EXPECT_NEAR(highest, std::exp(-0.5 * 4.5), 0.3 * std::exp(-0.5 * 4.5));
}

TEST(SixDofTest, AngularSpringHasItsFrequencyAndItsRest) {
  for (int axis = 0; axis < 3; ++axis) {
    World world({.gravity_m_s2 = {}});
    BodyDef body = Awake(Dynamic(2, Ball(), {}, 10));  // 1 kg m^2
    AddAll(world, {body});
    SixDofJoint joint;
    joint.axes[3 + static_cast<std::size_t>(axis)] = {
        .limit = {}, .motor = {}, .spring = {.stiffness = 25, .damping = 0, .rest = 0.4}};
    world.AddJoint(ToWorld(2, {}, {}, joint));
    const auto angle = [&] {
      const Quatd q = world.StateOf(body.id).orientation;
      return 2 * std::atan2(axis == 0 ? q.x : axis == 1 ? q.y : q.z, q.w) - 0.4;
    };
    EXPECT_NEAR(Period(world, 10, angle), 2 * kPi / 5, 0.03) << axis;
  }
}

TEST(SixDofTest, MotorsAndLimitsGoTheSameWayOnEveryAxis) {
  for (std::size_t axis = 0; axis < 6; ++axis) {
    for (const double speed : {0.5, -0.5}) {
      World world({.gravity_m_s2 = {}});
      AddAll(world, {Awake(Dynamic(2, Ball(), {}))});
      SixDofJoint joint;
      joint.axes[axis] = {.limit = {-0.3, 0.7}, .motor = {.target_velocity = speed, .max_force = 10}, .spring = {}};
      world.AddJoint(ToWorld(2, {}, {}, joint));
      Simulate(world, 4);
      const BodyState state = world.StateOf(BodyId(2));
      const double turned[6] = {state.position.x,
                                state.position.y,
                                state.position.z,
                                2 * std::atan2(state.orientation.x, state.orientation.w),
                                2 * std::atan2(state.orientation.y, state.orientation.w),
                                2 * std::atan2(state.orientation.z, state.orientation.w)};
      for (std::size_t i = 0; i < 6; ++i) {
        EXPECT_NEAR(turned[i], i != axis ? 0 : speed > 0 ? 0.7 : -0.3, 0.03) << "axis " << axis << " read " << i;
      }
    }
  }
}

TEST(SixDofTest, SpringTooStiffForTheStepStaysFinite) {
  World world({});
  AddAll(world, {Awake(Dynamic(2, Cube(), {0, 1, 0}, 1))});
  SixDofJoint joint;
  joint.axes[1] = {.limit = {}, .motor = {}, .spring = {.stiffness = 1e9, .damping = 10, .rest = 0}};
  world.AddJoint(ToWorld(2, {}, {}, joint));
  Simulate(world, 10);
  EXPECT_LT(std::abs(Position(world, 2).y), 0.1);
}

TEST(UniversalTest, TurnsAboutTwoAxesAndNotTheThird) {
  const float torque = 0.05f;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    World world({.gravity_m_s2 = {}});
    AddAll(world, {Awake(Dynamic(2, Ball(), {}))});
    world.AddJoint(ToWorld(2, {}, {}, UniversalJoint{.limit_a_rad = {-0.3, 0.3}, .limit_b_rad = {-0.6, 0.6}}));
    const Vec3f push{axis == 0 ? torque : 0, axis == 1 ? torque : 0, axis == 2 ? torque : 0};
    for (int i = 0; i < 600; ++i) {
      world.ApplyForce(BodyId(2), {}, push);
      world.Step(kDt);
    }
    const Quatd q = world.StateOf(BodyId(2)).orientation;
    const double angle = 2 * std::atan2(Length(Vec3d{q.x, q.y, q.z}), q.w);
    EXPECT_NEAR(angle, axis == 0 ? 0 : axis == 1 ? 0.6 : 0.3, 0.03) << axis;
  }
}

TEST(Hinge2Test, WheelSpringsSteersAndDrives) {
  World world({.gravity_m_s2 = {}});
  BodyDef wheel = Awake(Dynamic(2, Ball(), {0, 0, 0.2}, 2));
  AddAll(world, {wheel});
  world.AddJoint(ToWorld(2, {}, {},
                         Hinge2Joint{.steering_rad = {-0.4, 0.4},
                                     .suspension = {.stiffness = 2 * 100, .damping = 0, .rest = 0},
                                     .drive = {.target_velocity = 3, .max_force = 100}}));
  EXPECT_NEAR(Period(world, 5, [&] { return Position(world, 2).z; }), 2 * kPi / 10, 0.02);
  EXPECT_NEAR(Spin(world, 2).x, 3, 0.05);
  for (int i = 0; i < 300; ++i) {
    world.ApplyForce(BodyId(2), {}, {0, 0, 0.2f});
    world.Step(kDt);
  }
  EXPECT_NEAR(Length(Spin(world, 2)), 3, 0.1);  // turns about the steered axle
  EXPECT_NEAR(std::atan2(Spin(world, 2).y, Spin(world, 2).x), 0.4, 0.05);
}

TEST(GearTest, TurnsInItsRatio) {
  World world({.gravity_m_s2 = {}});
  AddAll(world, {Awake(Dynamic(2, Ball(), {}, 10)), Awake(Dynamic(3, Ball(), {3, 0, 0}, 10))});
  JointDef axle_a = ToWorld(2, {}, {}, HingeJoint{}), axle_b = ToWorld(3, {}, {{3, 0, 0}, {}}, HingeJoint{});
  axle_b.id = JointId(2);
  JointDef gear = Between(2, 3, {}, {}, GearJoint{.ratio = 2.5});
  gear.id = JointId(3);
  for (const JointDef& joint : {axle_a, axle_b, gear}) world.AddJoint(joint);
  world.ApplyImpulse(BodyId(2), {}, {0, 0, 1});
  Simulate(world, 2);
  EXPECT_GT(Spin(world, 2).z, 0.05);
  EXPECT_NEAR(Spin(world, 3).z, -2.5 * Spin(world, 2).z, 1e-3);
}

TEST(JointTest, FramesAreInTheShapesCoordinates) {
  // A cone of height 4 hung by its apex, 2 m above its shape's origin and 3 m above its centre of mass.
  World world({});
  const ShapePtr cone = MakeShapePtr(ConeShape{1, 4});
  AddAll(world, {Awake(Dynamic(2, cone, {0, -3, 0}))});
  world.AddJoint(ToWorld(2, {{0, 2, 0}, {}}, {}, PointJoint{}));
  Simulate(world, 2);
  EXPECT_NEAR(Position(world, 2).y, -3, 0.02);
  EXPECT_NEAR(Length(Position(world, 2)), 3, 0.02);
}

TEST(JointTest, BodiesItTiesCollideOnlyIfTheySaySo) {
  for (const bool collide : {false, true}) {
    World world({.gravity_m_s2 = {}});
    AddAll(world, {Awake(Dynamic(2, Ball(), {})), Awake(Dynamic(3, Ball(), {0.6, 0, 0}))});
    JointDef joint = Between(2, 3, {}, {}, SliderJoint{});
    joint.bodies_collide = collide;
    world.AddJoint(joint);
    Simulate(world, 2);
    if (collide) {
      EXPECT_GT(Position(world, 3).x - Position(world, 2).x, 0.95);
    } else {
      EXPECT_NEAR(Position(world, 3).x - Position(world, 2).x, 0.6, 1e-3);
    }
  }
}

TEST(JointTest, ForbidsContactsThatExistAlready) {
  World world({.gravity_m_s2 = {}});
  AddAll(world, {Awake(Dynamic(2, Cube(), {})), Awake(Dynamic(3, Cube(), {0.999, 0, 0}))});
  Simulate(world, 0.1);
  ASSERT_EQ(world.contacts().size(), 1u);
  world.AddJoint(Between(2, 3, {}, {}, SliderJoint{}));
  world.Step(kDt);
  EXPECT_TRUE(world.contacts().empty());
}

TEST(JointTest, GoesWithItsBodyAndWakesTheOther) {
  World world({});
  BodyDef hung = Dynamic(3, Cube(0.2), {0, -1, 0});
  AddAll(world, {Dynamic(2, Cube(0.2), {}), hung});
  JointDef top = ToWorld(2, {}, {}, FixedJoint{}), chain = Between(2, 3, {}, {{0, 1, 0}, {}}, FixedJoint{});
  chain.id = JointId(2);
  world.AddJoint(top);
  world.AddJoint(chain);
  Simulate(world, 5);
  ASSERT_EQ(world.asleep_count(), 2u);
  world.Remove(BodyId(2));
  EXPECT_FALSE(world.HasJoint(JointId(1)));
  EXPECT_FALSE(world.HasJoint(JointId(2)));
  EXPECT_EQ(world.asleep_count(), 0u);
  Simulate(world, 1);
  EXPECT_LT(Position(world, 3).y, -5);
}

TEST(JointTest, AStateThatMovesASleepingBodyWakesAllThatIsJointedToItOnce) {
  World world({.gravity_m_s2 = {}});
  AddAll(world, {Dynamic(1, Ball(0.2), {0, 1, 0}), Dynamic(2, Ball(0.2), {0.6, 1, 0})});
  world.AddJoint(Between(1, 2, {{0.3, 0, 0}, {}}, {{-0.3, 0, 0}, {}}, PointJoint{}));
  Simulate(world, 2);
  ASSERT_EQ(world.asleep_count(), 2U);
  BodyState state = world.StateOf(BodyId(1));
  state.asleep = false;
  state.linear_velocity = {0, 1, 0};
  world.SetState(BodyId(1), state);
  Simulate(world, 0.5);
  EXPECT_EQ(world.asleep_count(), 0U);
  const Vec3d middle = (Position(world, 1) + Position(world, 2)) * 0.5;  // half of the velocity is the middle's
  EXPECT_NEAR(middle.y, 1.25, 1e-3);
}

}  // namespace
}  // namespace tessera::physics
