// Joints in the solver, with rows written by hand.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "core/physics/solve/solver.h"

namespace tessera::physics {
namespace {

constexpr float kG = 9.81f;
constexpr double kStep_s = 1.0 / 60;

// One body on a joint to the world.
struct Jointed {
  Jointed() {
    constraints.push_back({.a = kStatic, .b = 0, .rows = &rows, .impulses = impulses.data()});
    bodies.resize(1);
  }
  void Solve(int substeps) { solver.Solve({bodies, {}, constraints, substeps, static_cast<float>(kStep_s)}); }
  SolverBody& body() { return bodies[0]; }

  Solver solver;
  JointRows rows;
  std::array<float, kJointSlots> impulses{};
  std::vector<SolverBody> bodies;
  std::vector<JointConstraint> constraints;
};

Row RowAlong(RowKind kind, Vec3f linear, std::uint8_t slot) {
  Row row;
  row.kind = kind;
  row.linear = linear;
  row.slot = slot;
  return row;
}

// Swings a rod of length 1 about its end; returns the times at which it passes the lowest point going right.
std::vector<double> Swing(double amplitude, double seconds, int substeps, double* widest, double* energy_error) {
  Jointed joint;
  const double inertia = 1.0 / 12;
  joint.body().inertia_kg_m2 = Vec3f{1, 1, 1} * static_cast<float>(inertia);
  double angle = amplitude;
  Vec3d position{.5 * std::sin(angle), -.5 * std::cos(angle), 0};
  const auto energy = [&] {
    const SolverBody& body = joint.body();
    return static_cast<double>(LengthSquared(body.velocity)) / 2 +
           inertia * static_cast<double>(LengthSquared(body.angular_velocity)) / 2 +
           static_cast<double>(kG) * position.y;
  };
  const double start = energy();
  std::vector<double> passes;
  for (int step = 0; step < static_cast<int>(seconds / kStep_s); ++step) {
    const Vec3d arm{-.5 * std::sin(angle), .5 * std::cos(angle), 0};
    const Vec3d gap = position + arm;
    *widest = std::max(*widest, Length(gap));
    joint.rows.arm_b = Vec3f(arm);
    joint.rows.gap = Vec3f(gap);
    joint.rows.count = 3;
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3f axis{k == 0 ? 1.0f : 0, k == 1 ? 1.0f : 0, k == 2 ? 1.0f : 0};
      joint.rows.rows[k] = RowAlong(RowKind::kLocked, axis, static_cast<std::uint8_t>(k));
      joint.rows.rows[k].angular_b = Cross(Vec3f(arm), axis);
      joint.rows.rows[k].error = Dot(Vec3f(gap), axis);
    }
    joint.body().acceleration = {0, -kG, 0};
    joint.Solve(substeps);
    const double before = angle;
    angle += static_cast<double>(joint.body().turned_rad.z);
    position += Vec3d(joint.body().moved_m);
    if (before < 0 && angle >= 0) passes.push_back((step + before / (before - angle)) * kStep_s);
    *energy_error = std::max(*energy_error, std::abs(energy() - start));
  }
  return passes;
}

// Period of a physical pendulum: 2 pi sqrt(I / (m g d)) (1 + a^2 / 16 + 11 a^4 / 3072), I = 1/3, d = 1/2.
TEST(JointBlocksTest, SwingsAPendulumInItsPeriod) {
  const double amplitude = .5;
  double gap = 0, energy = 0;
  const std::vector<double> passes = Swing(amplitude, 20, 4, &gap, &energy);
  const double truth = 2 * std::numbers::pi * std::sqrt(2.0 / 3 / static_cast<double>(kG)) *
                       (1 + amplitude * amplitude / 16 + 11 * std::pow(amplitude, 4) / 3072);
  ASSERT_GT(passes.size(), 5U);
  EXPECT_NEAR((passes.back() - passes.front()) / static_cast<double>(passes.size() - 1), truth, 2e-3 * truth);
  EXPECT_LT(gap, 1e-3);
  EXPECT_LT(energy, .02 * static_cast<double>(kG) * .5 * (1 - std::cos(amplitude)));
}

// Three rows that are far from orthogonal are solved as one: the joint's point stands still to rounding after one step.
TEST(JointBlocksTest, SolvesItsLockedRowsExactly) {
  Jointed joint;
  joint.body().inertia_kg_m2 = {.01f, 3, .2f};
  joint.body().velocity = {3, -4, 5};
  joint.body().angular_velocity = {9, 2, -7};
  const Vec3f arm{.7f, -.3f, .4f};
  joint.rows.count = 3;
  const std::array<Vec3f, 3> axes{Vec3f{1, 0, 0}, Vec3f{.9f, .1f, 0}, Vec3f{.9f, 0, .1f}};
  for (std::size_t k = 0; k < 3; ++k) {
    joint.rows.rows[k] = RowAlong(RowKind::kLocked, axes[k], static_cast<std::uint8_t>(k));
    joint.rows.rows[k].angular_b = Cross(arm, axes[k]);
  }
  joint.rows.arm_b = arm;
  joint.solver.Solve({joint.bodies, {}, joint.constraints, 1, 1e-4f});
  const Vec3f velocity = joint.body().velocity + Cross(joint.body().angular_velocity, arm);
  EXPECT_LT(Length(velocity), 2e-2f) << "from " << Length(Vec3f{3, -4, 5});
  // The impulses that it reports are those along its own rows.
  Vec3f impulse;
  for (std::size_t k = 0; k < 3; ++k) impulse += axes[k] * joint.impulses[k];
  EXPECT_LT(Length(impulse - (joint.body().velocity - Vec3f{3, -4, 5})), 2e-2f);
}

TEST(JointBlocksTest, SpringsSwingAtTheirFrequency) {
  Jointed joint;
  joint.body().inertia_kg_m2 = {1, 1, 1};
  joint.body().mass_kg = 2;
  const double frequency = 2, omega = 2 * std::numbers::pi * frequency;
  double x = .3;
  int crossings = 0;
  double first = 0, last = 0, widest = 0;
  for (int step = 0; step < 600; ++step) {
    joint.rows.count = 1;
    joint.rows.rows[0] = RowAlong(RowKind::kSpring, {1, 0, 0}, 0);
    joint.rows.rows[0].error = static_cast<float>(x);
    joint.rows.rows[0].stiffness = static_cast<float>(2 * omega * omega);
    joint.Solve(4);
    const double before = x;
    x += static_cast<double>(joint.body().moved_m.x);
    if (before < 0 && x >= 0) {
      last = (step + before / (before - x)) * kStep_s;
      if (crossings++ == 0) first = last;
    }
    if (step >= 540) widest = std::max(widest, std::abs(x));
  }
  EXPECT_NEAR((crossings - 1) / (last - first), frequency, .005 * frequency);
  EXPECT_GT(widest, .2) << "of .3 after 10 s";
}

// The spring is far stiffer than its substeps could follow.
TEST(JointBlocksTest, HoldsHoweverStiffASpring) {
  Jointed joint;
  joint.body().inertia_kg_m2 = {1, 1, 1};
  double x = .3;
  for (int step = 0; step < 120; ++step) {
    joint.rows.count = 1;
    joint.rows.rows[0] = RowAlong(RowKind::kSpring, {1, 0, 0}, 0);
    joint.rows.rows[0].error = static_cast<float>(x);
    joint.rows.rows[0].stiffness = 1e9f;
    joint.Solve(2);
    x += static_cast<double>(joint.body().moved_m.x);
  }
  EXPECT_NEAR(x, 0, 1e-3);
}

TEST(JointBlocksTest, MotorsPushNoHarderThanTheyMay) {
  Jointed joint;
  joint.body().inertia_kg_m2 = {1, 1, 1};
  joint.body().mass_kg = 3;
  for (int step = 0; step < 60; ++step) {
    joint.rows.count = 1;
    joint.rows.rows[0] = RowAlong(RowKind::kMotor, {1, 0, 0}, 0);
    joint.rows.rows[0].target_velocity = 5;
    joint.rows.rows[0].max_force = 6;
    joint.Solve(4);
    EXPECT_NEAR(joint.body().velocity.x, 2.0 * (step + 1) * kStep_s, 1e-4) << "a = F / m";
  }
  for (int step = 0; step < 240; ++step) joint.Solve(4);
  EXPECT_NEAR(joint.body().velocity.x, 5, 1e-4);
}

TEST(JointBlocksTest, LimitsStopOneWayOnly) {
  Jointed joint;
  joint.body().inertia_kg_m2 = {1, 1, 1};
  joint.body().velocity = {-2, 0, 0};
  double left = .5;
  double deepest = 0;
  for (int step = 0; step < 60; ++step) {
    joint.rows.count = 1;
    joint.rows.rows[0] = RowAlong(RowKind::kLimit, {1, 0, 0}, 0);
    joint.rows.rows[0].error = static_cast<float>(left);
    joint.Solve(4);
    left += static_cast<double>(joint.body().moved_m.x);
    deepest = std::min(deepest, left);
  }
  EXPECT_GT(deepest, -1e-4);
  EXPECT_NEAR(left, 0, 1e-3);
  joint.body().velocity = {2, 0, 0};
  joint.Solve(4);
  EXPECT_NEAR(joint.body().velocity.x, 2, 1e-5);
}

}  // namespace
}  // namespace tessera::physics
