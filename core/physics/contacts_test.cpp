// Contacts bounce, rub and keep momentum, and the impulses that they report are those that they applied.

#include <gmock/gmock.h>

#include <cmath>
#include <map>
#include <span>
#include <utility>
#include <vector>

#include "core/physics/testing/bodies.h"
#include "core/physics/testing/turns.h"
#include "scenes/measured/balls.h"

namespace tessera::physics {
namespace {

// --- Restitution

// Speed after the first bounce over the speed before it.
double BounceRatio(double ball_restitution, double ground_restitution) {
  World world({});
  BodyDef ground = Static(1, Ground()), ball = Dynamic(2, Ball(), {0, 3, 0});
  ground.material.restitution = ground_restitution;
  ball.material.restitution = ball_restitution;
  ball.may_sleep = false;
  AddAll(world, {ground, ball});
  double before = 0;
  for (int i = 0; i < 120; ++i) {
    world.Step(kDt);
    const double v = world.StateOf(ball.id).linear_velocity.y;
    if (v > 0 || (v == 0 && before < 0)) return -v / before;
    before = v;
  }
  return -1;
}

TEST(RestitutionTest, BallLeavesWithItsShareOfTheSpeed) {
  // The contact takes what gravity adds in its own step, v / g dt of the speed: about 2 %.
  EXPECT_NEAR(BounceRatio(1, 1), 1, 0.03);
  EXPECT_NEAR(BounceRatio(0.5, 0.5), 0.5, 0.03);
  EXPECT_NEAR(BounceRatio(0, 0), 0, 0.03);
}

TEST(RestitutionTest, PairTakesTheLarger) {
  EXPECT_NEAR(BounceRatio(0.5, 0), 0.5, 0.03);
  EXPECT_NEAR(BounceRatio(0.2, 0.8), 0.8, 0.03);
}

// --- Friction

// Distance that a box slides in a second on a slope of the given inclination.
double Slide(double slope_rad, double box_friction, double ground_friction) {
  World world({});
  BodyDef ground = Static(1, MakeShapePtr(PlaneShape{{std::sin(slope_rad), std::cos(slope_rad), 0}, 0}));
  BodyDef box = Dynamic(2, Box(1, 0.25, 1), Vec3d{std::sin(slope_rad), std::cos(slope_rad), 0} * 0.25);
  box.initial.orientation = About({0, 0, 1}, -slope_rad);
  box.may_sleep = false;
  ground.material.friction = ground_friction;
  box.material.friction = box_friction;
  AddAll(world, {ground, box});
  Simulate(world, 1);
  return Length(world.StateOf(box.id).position - box.initial.position);
}

double Energy(const World& world, std::span<const BodyDef> bodies) {
  double sum_j = 0;
  for (const BodyDef& body : bodies) {
    if (body.motion != Motion::kDynamic) continue;
    const BodyState state = world.StateOf(body.id);
    sum_j += body.mass_kg * (kGravity * state.position.y + LengthSquared(Vec3d(state.linear_velocity)) / 2) +
             static_cast<double>(Dot(state.angular_velocity, state.angular_momentum)) / 2;
  }
  return sum_j;
}

// 216 balls in columns come down a metre, hand their blows up and down within a step, and come down again at random.
TEST(RestitutionTest, AHeapOfElasticBallsKeepsItsEnergy) {
  const Scene scene = scenes::BallPile(true);
  World world({.gravity_m_s2 = scene.gravity_m_s2, .sleep = false});
  AddAll(world, scene.bodies);
  const double start_j = Energy(world, scene.bodies);
  Simulate(world, 1);  // the columns have landed once
  EXPECT_NEAR(Energy(world, scene.bodies) / start_j, 1, 0.005);
  Simulate(world, 3);
  EXPECT_NEAR(Energy(world, scene.bodies) / start_j, 1, 0.05);
}

// In small steps, where a ball that is hit hard glances off many others within each, none of that makes energy.
TEST(RestitutionTest, BlowsInSmallStepsMakeNoEnergy) {
  const Scene scene = scenes::BallPile(true);
  World world({.gravity_m_s2 = scene.gravity_m_s2, .sleep = false});
  AddAll(world, scene.bodies);
  const double start_j = Energy(world, scene.bodies);
  for (int second = 1; second <= 4; ++second) {
    Simulate(world, 1, 1.0 / 240);
    ASSERT_NEAR(Energy(world, scene.bodies) / start_j, 1, 3e-4) << second;
  }
}

// Two balls that graze each other move by a good part of their size within the step. Nothing turns what has no
// friction; energy and momentum are kept, and the angular momentum about a point is that of their ways past it.
TEST(RestitutionTest, BallsWithoutFrictionThatGrazeDoNotTurn) {
  for (const double aside : {0.02, 0.08, 0.14}) {
    World world({.gravity_m_s2 = {}, .sleep = false});
    BodyDef one = Dynamic(1, Ball(0.1), {-0.25, 0, 0}), other = Dynamic(2, Ball(0.1), {0, aside, 0}, 2);
    one.initial.linear_velocity = {5, 0, 0.5f};
    one.material = other.material = {.friction = 0, .restitution = 1};
    const std::vector<BodyDef> bodies = {one, other};
    AddAll(world, bodies);
    const auto turning = [&] {
      Vec3d sum;
      for (const BodyDef& body : bodies) {
        const BodyState state = world.StateOf(body.id);
        sum += Cross(state.position, Vec3d(state.linear_velocity)) * body.mass_kg;
      }
      return sum;
    };
    const Vec3d before = turning();
    const double start_j = 25.25 / 2;
    Simulate(world, 0.2);
    double end_j = 0;
    for (const BodyDef& body : bodies) {
      const BodyState state = world.StateOf(body.id);
      EXPECT_LT(Length(state.angular_velocity), 1e-5f) << aside;
      end_j += body.mass_kg * LengthSquared(Vec3d(state.linear_velocity)) / 2;
    }
    EXPECT_GT(Length(Vec3d(world.StateOf(other.id).linear_velocity)), 0.1) << "they met";
    EXPECT_NEAR(end_j / start_j, 1, 1e-5) << aside;
    EXPECT_LT(Length(turning() - before), 1e-4) << aside;
  }
}

// Two balls that overlap push each other on towards a third, which so is met a moment before free motion says.
TEST(RestitutionTest, ABlowThatComesEarlyIsNotLost) {
  constexpr double kStep = 1.0 / 960, kSpeed = 4.4;
  World world({.gravity_m_s2 = {}, .substeps = 1});
  std::vector<BodyDef> balls;
  balls.reserve(3);
  for (const double height : {0.0, 0.1914, 0.1914 + 0.2 + 2 * kSpeed * kStep + 1e-4}) {
    BodyDef& ball = balls.emplace_back(Dynamic(balls.size() + 1, Ball(0.1), {0, height, 0}));
    ball.material = {.friction = 0, .restitution = 1};
    ball.initial.linear_velocity = {0, static_cast<float>(balls.size() < 3 ? kSpeed : -kSpeed), 0};
  }
  AddAll(world, balls);
  Simulate(world, 20 * kStep, kStep);
  double squares = 0;
  for (const BodyDef& ball : balls) squares += LengthSquared(Vec3d(world.StateOf(ball.id).linear_velocity));
  EXPECT_NEAR(squares / (3 * kSpeed * kSpeed), 1, 0.1);
}

TEST(FrictionTest, HoldsBelowTheLimitAndSlidesAboveIt) {
  const double friction = 0.5;
  EXPECT_LT(Slide(std::atan(0.9 * friction), friction, friction), 0.01);
  const double slope = std::atan(1.1 * friction);
  const double acceleration = kGravity * (std::sin(slope) - friction * std::cos(slope));
  EXPECT_NEAR(Slide(slope, friction, friction), acceleration / 2, 0.1 * acceleration / 2);
}

TEST(FrictionTest, PairTakesTheGeometricMean) {
  EXPECT_LT(Slide(std::atan(0.9 * 0.5), 0.25, 1), 0.01);  // sqrt(.25 * 1) = .5
  EXPECT_GT(Slide(std::atan(1.1 * 0.5), 0.25, 1), 0.1);
  EXPECT_GT(Slide(std::atan(0.1), 0, 1), 0.3);
}

TEST(FrictionTest, SlidingBallComesToRollAtFiveSeventhsOfItsSpeed) {
  World world({});
  BodyDef ball = Dynamic(2, Ball(), {0, 0.5, 0});
  ball.initial.linear_velocity = {7, 0, 0};
  AddAll(world, {Static(1, Ground()), ball});
  Simulate(world, 2);
  const BodyState state = world.StateOf(ball.id);
  EXPECT_NEAR(state.linear_velocity.x, 5, 0.02);
  EXPECT_NEAR(state.angular_velocity.z, -5 / 0.5, 0.05);
}

// It lies a little deep in what bears it, and rolls by its radius all the same.
TEST(FrictionTest, ARollingBallGoesByItsRadius) {
  for (const auto& [ground, top_m] : {std::pair(Ground(), 0.0), std::pair(Box(20, 1, 20), 1.0)}) {
    World world({});
    BodyDef ball = Dynamic(2, Ball(0.1), {0, top_m + 0.1, 0});
    ball.initial.linear_velocity = {1, 0, 0};
    ball.initial.angular_velocity = {0, 0, -10};
    AddAll(world, {Static(1, ground), ball});
    Simulate(world, 4);
    const BodyState state = world.StateOf(ball.id);
    EXPECT_NEAR(state.linear_velocity.x, 1, 1e-4);
    EXPECT_NEAR(state.angular_velocity.z * -0.1 / state.linear_velocity.x, 1, 1e-5);
  }
}

TEST(FrictionTest, RollingFrictionStopsABallAndSpinningFrictionATop) {
  for (const bool resisted : {false, true}) {
    World world({});
    BodyDef rolling = Dynamic(2, Ball(), {0, 0.5, 0}), spinning = Dynamic(3, Ball(), {10, 0.5, 0});
    rolling.initial.linear_velocity = {1, 0, 0};
    rolling.initial.angular_velocity = {0, 0, -2};
    spinning.initial.angular_velocity = {0, 4, 0};
    if (resisted) {
      rolling.material.rolling_friction = 0.05;
      spinning.material.spinning_friction = 0.05;
    }
    AddAll(world, {Static(1, Ground()), rolling, spinning});
    Simulate(world, 4);
    if (resisted) {
      EXPECT_LT(Length(world.StateOf(rolling.id).linear_velocity), 0.05);
      EXPECT_LT(Length(world.StateOf(spinning.id).angular_velocity), 0.05);
    } else {
      EXPECT_NEAR(world.StateOf(rolling.id).linear_velocity.x, 1, 0.01);
      EXPECT_NEAR(world.StateOf(spinning.id).angular_velocity.y, 4, 0.01);
    }
  }
}

// --- Reported impulses

struct Impulses {
  Vec3d linear, angular;
};

std::map<BodyId, Impulses> SumOfContacts(const World& world) {
  std::map<BodyId, Impulses> sums;
  for (const Contact& contact : world.contacts()) {
    sums[contact.body_a].linear -= Vec3d(contact.impulse_on_b);
    sums[contact.body_a].angular += Vec3d(contact.angular_impulse_on_a);
    sums[contact.body_b].linear += Vec3d(contact.impulse_on_b);
    sums[contact.body_b].angular += Vec3d(contact.angular_impulse_on_b);
  }
  return sums;
}

// A heap of round inertia (whose angular momentum does not turn with the body by itself) with every kind of friction.
TEST(ContactTest, ImpulsesAreWhatTheBodiesGained) {
  World world({});
  std::vector<BodyDef> bodies = {Static(1, Ground())};
  const ShapePtr shapes[] = {
      Cube(0.4),
      Ball(0.5),
      MakeShapePtr(CylinderShape{0.4, 0.5}),
      MakeShapePtr(CapsuleShape{0.4, 0.3}),
      MakeShapePtr(ConeShape{0.5, 1}),
      MakeShapePtr(CompoundShape{{{{{-0.3, 0, 0}, {}}, Cube(0.3)}, {{{0.3, 0.1, 0}, {}}, Ball(0.3)}}})};
  for (std::uint64_t i = 0; i < 24; ++i) {
    const std::uint64_t layer = i / 4, row = i / 2 % 2;
    const double x = static_cast<double>(i % 2), y = 0.6 + 1.1 * static_cast<double>(layer),
                 z = static_cast<double>(row);
    BodyDef body = Dynamic(10 + i, shapes[i % 6], {x, y, z}, 1 + static_cast<double>(i % 5));
    body.inertia_kg_m2 = Vec3d{0.2, 0.2, 0.2};
    body.material = {.friction = 0.6, .rolling_friction = 0.01, .spinning_friction = 0.02, .restitution = 0.3};
    body.initial.angular_velocity = {1, 2, static_cast<float>(i)};
    body.may_sleep = false;
    bodies.push_back(body);
  }
  AddAll(world, bodies);
  double pushed = 0;
  for (int step = 0; step < 200; ++step) {
    std::map<BodyId, Impulses> before;
    for (const BodyDef& body : bodies)
      before[body.id] = {Vec3d(world.StateOf(body.id).linear_velocity) * body.mass_kg, AngularMomentum(world, body.id)};
    world.Step(kDt);
    auto sums = SumOfContacts(world);
    for (const BodyDef& body : bodies) {
      if (body.motion == Motion::kStatic) continue;
      const Impulses& sum = sums[body.id];
      const Vec3d gained = Vec3d(world.StateOf(body.id).linear_velocity) * body.mass_kg - before[body.id].linear;
      const Vec3d turned = AngularMomentum(world, body.id) - before[body.id].angular;
      // Each of up to 64 substeps rounds velocities once.
      const double scale = 1 + Length(sum.linear) + Length(before[body.id].linear);
      EXPECT_LT(Length(gained - sum.linear - Vec3d{0, -kGravity * body.mass_kg * kDt, 0}), 1e-4 * scale)
          << "body " << body.id << " step " << step;
      EXPECT_LT(Length(turned - sum.angular), 1e-4 * scale) << "body " << body.id << " step " << step;
      pushed += Length(sum.linear);
    }
    if (HasFailure()) return;
  }
  EXPECT_GT(pushed, 100);
}

TEST(ContactTest, TellsWhereAndHowDeepInOrderOfIds) {
  World world({});
  BodyDef upper = Dynamic(2, Cube(), {5, 1.5, 0}), lower = Dynamic(7, Cube(), {5, 0.5, 0});
  upper.may_sleep = lower.may_sleep = false;
  AddAll(world, {Static(9, Ground()), lower, upper});
  Simulate(world, 1);
  ASSERT_EQ(world.contacts().size(), 2u);
  const Contact &boxes = world.contacts()[0], &floor = world.contacts()[1];
  EXPECT_EQ(boxes.body_a, BodyId(2));
  EXPECT_EQ(boxes.body_b, BodyId(7));
  EXPECT_EQ(floor.body_a, BodyId(7));
  EXPECT_EQ(floor.body_b, BodyId(9));
  EXPECT_NEAR(boxes.normal.y, -1, 1e-3);  // from 2 down to 7
  EXPECT_NEAR(boxes.point.x, 5, 0.02);
  EXPECT_NEAR(boxes.point.y, 1, 0.01);
  EXPECT_NEAR(boxes.depth_m, 0, 0.01);
  EXPECT_NEAR(boxes.impulse_on_b.y, -kGravity * kDt, 0.01);
  EXPECT_NEAR(floor.impulse_on_b.y, -2 * kGravity * kDt, 0.02);

  const std::optional<Contact> either = world.ContactBetween(BodyId(7), BodyId(2));
  ASSERT_TRUE(either.has_value());
  EXPECT_EQ(either->body_a, BodyId(2));
  EXPECT_EQ(either->point, boxes.point);
  EXPECT_EQ(either->impulse_on_b, boxes.impulse_on_b);
  EXPECT_FALSE(world.ContactBetween(BodyId(2), BodyId(9)).has_value()) << "they do not touch";
  EXPECT_FALSE(world.ContactBetween(BodyId(2), BodyId(77)).has_value()) << "nobody has it";
}

// --- Events

std::vector<PairEvent> EventsOf(World& world, double seconds) {
  std::vector<PairEvent> events;
  for (int i = 0; i < static_cast<int>(seconds / kDt); ++i) {
    world.Step(kDt);
    events.insert(events.end(), world.events().begin(), world.events().end());
  }
  return events;
}

TEST(EventTest, RestingContactBeginsOnce) {
  World world({});
  AddAll(world, {Static(1, Ground()), Dynamic(2, Cube(), {0, 0.8, 0})});
  EXPECT_THAT(EventsOf(world, 6), testing::ElementsAre(PairEvent{BodyId(1), BodyId(2), false, true}));
  EXPECT_EQ(world.asleep_count(), 1u);  // and did not end by falling asleep
}

TEST(EventTest, TriggerBeginsAndEndsOnceAndPushesNothing) {
  World world({.gravity_m_s2 = {}});
  BodyDef trigger = Static(1, Ball(1)), probe = Dynamic(2, Ball(0.25), {-4, 0.5, 0});
  trigger.trigger = true;
  probe.initial.linear_velocity = {2, 0, 0};
  AddAll(world, {trigger, probe});
  std::vector<double> where;
  std::vector<PairEvent> events;
  for (int i = 0; i < 240; ++i) {
    world.Step(kDt);
    for (const PairEvent& event : world.events()) {
      events.push_back(event);
      where.push_back(world.StateOf(probe.id).position.x);
    }
  }
  EXPECT_THAT(events, testing::ElementsAre(PairEvent{BodyId(1), BodyId(2), true, true},
                                           PairEvent{BodyId(1), BodyId(2), true, false}));
  const double reach = std::sqrt(1.25 * 1.25 - 0.5 * 0.5);  // exact, not by bounds
  const double tick = 2 * kDt;
  EXPECT_NEAR(where[0], -reach, 2 * tick);
  EXPECT_NEAR(where[1], reach, 2 * tick);
  EXPECT_NEAR(world.StateOf(probe.id).linear_velocity.x, 2, 1e-6);
  EXPECT_TRUE(world.contacts().empty());
}

TEST(EventTest, BoundsThatOverlapAreNoContact) {
  World world({.gravity_m_s2 = {}});
  BodyDef trigger = Static(1, Ball(1));
  trigger.trigger = true;
  AddAll(world, {trigger, Dynamic(2, Ball(1), {1.5, 1.5, 0})});
  EXPECT_THAT(EventsOf(world, 0.5), testing::IsEmpty());
}

TEST(EventTest, RemovalEndsWhatTouched) {
  World world({});
  AddAll(world, {Static(1, Ground()), Dynamic(2, Cube(), {0, 0.5, 0})});
  Simulate(world, 0.5);
  world.Remove(BodyId(2));
  EXPECT_THAT(EventsOf(world, 0.1), testing::ElementsAre(PairEvent{BodyId(1), BodyId(2), false, false}));
}

}  // namespace
}  // namespace tessera::physics
