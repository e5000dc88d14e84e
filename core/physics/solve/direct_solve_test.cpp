// Contacts that bear far more than they weigh, solved without a world: impulses that statics gives.
#include "core/physics/solve/direct_solve.h"

#include <gmock/gmock.h>

#include <cmath>
#include <limits>

#include "core/world/math.h"

namespace tessera::physics {
namespace {

using testing::DoubleNear;
using testing::Each;

constexpr double kPull_m_s = 0.04;  // added by gravity in a substep

struct Body {
  double mass_kg = 1;
  Vec3d half{0.5, 0.5, 0.5};
};

// Boxes in a column, each body's centre given, and contacts with four corners.
class Column {
 public:
  std::int32_t Add(Body body, Vec3d center, Vec3d velocity = {0, -kPull_m_s, 0}) {
    bodies_.push_back(body);
    centers_.push_back(center);
    const double root = std::sqrt(body.mass_kg);
    states_.push_back({{velocity.x * root, velocity.y * root, velocity.z * root, 0, 0, 0}, 1 / root});
    return static_cast<std::int32_t>(bodies_.size() - 1);
  }
  // `upper` rests on `lower`, or on the world (-1), with the corners of a rectangle about `middle`.
  DirectContact& Rest(std::int32_t lower, std::int32_t upper, Vec3d middle, double half_x, double half_z,
                      double friction) {
    DirectContact& contact = contacts_.emplace_back();
    contact.a = lower;
    contact.b = upper;
    contact.friction = friction;
    contact.rows = 0x3f;
    std::size_t row = 0;
    for (const double x : {-half_x, half_x}) {
      for (const double z : {-half_z, half_z}) SetRow(contact, row++, middle + Vec3d{x, 0, z}, {0, 1, 0});
    }
    SetRow(contact, kDirectTangent, middle, {1, 0, 0});
    SetRow(contact, kDirectTangent + 1, middle, {0, 0, 1});
    return contact;
  }
  // A tower of cubes of 1 kg with a load on it, under a pull that leans.
  void Build(int cubes, double load_kg, double aside_m = 0, double lean = 0) {
    const Vec3d pull{lean * kPull_m_s, -kPull_m_s, 0};
    for (int i = 0; i < cubes; ++i) {
      const std::int32_t cube = Add({}, {0, i + 0.5, 0}, pull);
      Rest(cube - 1, cube, {0, static_cast<double>(i), 0}, 0.5, 0.5, 0.5);
    }
    const std::int32_t load = Add({.mass_kg = load_kg}, {aside_m, cubes + 0.5, 0}, pull);
    Rest(load - 1, load, {aside_m / 2, static_cast<double>(cubes), 0}, 0.5 - std::abs(aside_m) / 2, 0.5, 0.5);
  }
  DirectSolve& Begin() {
    solve_.Begin(states_, contacts_);
    return solve_;
  }

  Vec3d VelocityOf(std::size_t body) const {
    const DirectBody& state = solve_.bodies()[body];
    return Vec3d{state.velocity[0], state.velocity[1], state.velocity[2]} * state.inverse_root_mass;
  }
  Vec3d SpinOf(std::size_t body) const {
    const DirectBody& state = solve_.bodies()[body];
    const Vec3d root = RootOf(bodies_[body]);
    return {state.velocity[3] / root.x, state.velocity[4] / root.y, state.velocity[5] / root.z};
  }
  static double NormalOf(const DirectContact& contact) {
    double sum = 0;
    for (std::size_t row = 0; row < kDirectNormals; ++row) sum += contact.impulse[row];
    return sum;
  }

 private:
  static Vec3d RootOf(const Body& body) {
    const Vec3d h = body.half;
    const double third = body.mass_kg / 3;
    return {std::sqrt(third * (h.y * h.y + h.z * h.z)), std::sqrt(third * (h.x * h.x + h.z * h.z)),
            std::sqrt(third * (h.x * h.x + h.y * h.y))};
  }
  void Fill(std::int32_t body, Vec3d at, Vec3d along, double sign, Vector6& row) const {
    if (body < 0) return;
    const auto i = static_cast<std::size_t>(body);
    const Vec3d turn = Cross(at - centers_[i], along), root = RootOf(bodies_[i]);
    const double scale = sign / std::sqrt(bodies_[i].mass_kg);
    row = {along.x * scale,        along.y * scale,        along.z * scale,
           sign * turn.x / root.x, sign * turn.y / root.y, sign * turn.z / root.z};
  }
  void SetRow(DirectContact& contact, std::size_t row, Vec3d at, Vec3d along) const {
    Fill(contact.a, at, along, -1, contact.on_a[row]);
    Fill(contact.b, at, along, 1, contact.on_b[row]);
  }

  std::vector<Body> bodies_;
  std::vector<Vec3d> centers_;
  std::vector<DirectBody> states_;
  std::vector<DirectContact> contacts_;
  DirectSolve solve_;
};

TEST(DirectSolveTest, EachContactOfATowerBearsAllThatIsAboveIt) {
  for (const double load_kg : {10.0, 3000.0, 100000.0}) {
    Column column;
    column.Build(20, load_kg);
    DirectSolve& solve = column.Begin();
    ASSERT_TRUE(solve.Solve()) << load_kg;
    for (std::size_t i = 0; i <= 20; ++i) {
      const double above_kg = load_kg + 20 - static_cast<double>(i);
      EXPECT_NEAR(Column::NormalOf(solve.contacts()[i]), above_kg * kPull_m_s, 1e-5 * load_kg * kPull_m_s);
      EXPECT_LT(Length(column.VelocityOf(i)), 1e-6);
      EXPECT_LT(Length(column.SpinOf(i)), 1e-6);
    }
  }
}

// Friction holds, and the pressure moves towards the edge that the pull leans to.
TEST(DirectSolveTest, ALeaningPullIsHeldByFriction) {
  Column column;
  column.Build(10, 3000, 0, 0.0175);
  DirectSolve& solve = column.Begin();
  ASSERT_TRUE(solve.Solve());
  for (std::size_t i = 0; i <= 10; ++i) {
    const double above_kg = 3010 - static_cast<double>(i);
    EXPECT_NEAR(solve.contacts()[i].impulse[kDirectTangent], -0.0175 * above_kg * kPull_m_s, 1e-3);
    EXPECT_LT(Length(column.VelocityOf(i)), 1e-6);
  }
  const DirectContact& foot = solve.contacts().front();
  EXPECT_GT(foot.impulse[2] + foot.impulse[3], foot.impulse[0] + foot.impulse[1]);
}

// A pull beyond the coefficient: the load slides at what friction leaves, and the friction is at its limit.
TEST(DirectSolveTest, BeyondTheLimitOfFrictionTheLoadSlides) {
  Column column;
  column.Add({}, {0, 0.5, 0});
  column.Rest(-1, 0, {0, 0, 0}, 0.5, 0.5, 2.0);
  column.Add({.mass_kg = 3000, .half = {0.5, 0.05, 0.5}}, {0, 1.05, 0}, {0.4 * kPull_m_s, -kPull_m_s, 0});
  column.Rest(0, 1, {0, 1, 0}, 0.5, 0.5, 0.3);
  DirectSolve& solve = column.Begin();
  ASSERT_TRUE(solve.Solve());
  EXPECT_NEAR(column.VelocityOf(1).x, 0.1 * kPull_m_s, 1e-5);
  EXPECT_LT(Length(column.VelocityOf(0)), 1e-6);
  EXPECT_NEAR(-solve.contacts()[1].impulse[kDirectTangent], 0.3 * Column::NormalOf(solve.contacts()[1]), 1e-3);
}

// The load's middle is beyond the edge of what bears it: it turns about that edge as a rigid body does.
TEST(DirectSolveTest, ALoadBeyondTheEdgeTurnsAboutIt) {
  Column column;
  column.Build(5, 3000, 0.6);
  DirectSolve& solve = column.Begin();
  ASSERT_TRUE(solve.Solve());
  // About the edge, .1 m inwards of the middle and .5 m below: I = m (1 / 6 + .01 + .25).
  const double rate = kPull_m_s * 0.1 / (1.0 / 6 + 0.01 + 0.25);
  EXPECT_NEAR(column.SpinOf(5).z, -rate, 1e-3 * rate);
  EXPECT_LT(Length(column.VelocityOf(4)), 1e-6);
}

TEST(DirectSolveTest, WhatPartsIsNotHeldBack) {
  Column column;
  column.Add({}, {0, 0.5, 0});
  column.Rest(-1, 0, {0, 0, 0}, 0.5, 0.5, 0.5);
  column.Add({.mass_kg = 3000}, {0, 1.5, 0}, {0, 0.3, 0});
  column.Rest(0, 1, {0, 1, 0}, 0.5, 0.5, 0.5);
  DirectSolve& solve = column.Begin();
  ASSERT_TRUE(solve.Solve());
  EXPECT_EQ(column.VelocityOf(1).y, 0.3);
  EXPECT_THAT(solve.contacts()[1].impulse, Each(0.0));
}

// Bodies in a ring of contacts without the world keep their momentum.
TEST(DirectSolveTest, ImpulsesAreOppositeOnBothBodies) {
  Column column;
  column.Add({.mass_kg = 3000}, {0, 0.5, 0}, {0.01, 1, 0});
  column.Add({}, {0, 1.5, 0}, {});
  column.Rest(0, 1, {0, 1, 0}, 0.5, 0.5, 0.5);
  column.Add({.mass_kg = 500}, {0, 2.5, 0}, {0, -2, 0.02});
  column.Rest(1, 2, {0, 2, 0}, 0.5, 0.5, 0.5);
  DirectSolve& solve = column.Begin();
  ASSERT_TRUE(solve.Solve());
  const Vec3d momentum = column.VelocityOf(0) * 3000 + column.VelocityOf(1) + column.VelocityOf(2) * 500;
  EXPECT_NEAR(momentum.x, 30, 1e-9);
  EXPECT_NEAR(momentum.y, 2000, 1e-9);
  EXPECT_NEAR(momentum.z, 10, 1e-9);
  EXPECT_LE(column.VelocityOf(0).y, column.VelocityOf(2).y + 1e-6) << "they do not go through each other";
}

TEST(DirectSolveTest, StartedFromItsOwnSolutionItFindsNothingToDo) {
  Column column;
  column.Build(20, 3000);
  DirectSolve& solve = column.Begin();
  ASSERT_TRUE(solve.Solve());
  const int cold = solve.factorisations();
  ASSERT_TRUE(solve.Solve());
  EXPECT_LE(solve.factorisations() - cold, 1);
  EXPECT_LE(cold, 2 * kDirectRounds * kDirectNewton);
}

TEST(DirectSolveTest, WhatIsNotFiniteIsLeftAsItWas) {
  Column column;
  column.Build(2, 3000);
  DirectSolve& solve = column.Begin();
  solve.bodies()[0].velocity[1] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(solve.Solve());
  for (const DirectContact& contact : solve.contacts()) EXPECT_THAT(contact.impulse, Each(0.0));
}

// --- The factorisation

TEST(BlockCholeskyTest, SolvesARingAndFillsInLittle) {
  constexpr std::uint32_t kBodies = 8;
  std::vector<std::pair<std::uint32_t, std::uint32_t>> edges;
  for (std::uint32_t i = 0; i < kBodies; ++i) edges.emplace_back(i, (i + 1) % kBodies);
  BlockCholesky matrix;
  matrix.Analyze(kBodies, edges);
  EXPECT_LE(matrix.blocks(), 2U * kBodies - 3) << "one block of fill for each body but the last three";
  // Each edge is a spring between components: k of one body against k + 1 of the other.
  std::vector<Vector6> wanted(kBodies), right(kBodies);
  for (std::uint32_t i = 0; i < kBodies; ++i) {
    for (std::size_t k = 0; k < 6; ++k) wanted[i][k] = std::sin(1.0 + 7 * i + 3.0 * static_cast<double>(k));
  }
  right = wanted;  // the unit matrix
  matrix.Clear();
  for (const auto& [a, b] : edges) {
    Matrix6 own{}, other{}, next{};
    for (std::size_t k = 0; k < 6; ++k) {
      const std::size_t to = (k + 1) % 6;
      own[k][k] = 1000;
      next[to][to] = 1000;
      other[k][to] = -1000;
      right[a][k] += 1000 * (wanted[a][k] - wanted[b][to]);
      right[b][to] += 1000 * (wanted[b][to] - wanted[a][k]);
    }
    matrix.Add(a, a, own);
    matrix.Add(b, b, next);
    matrix.Add(a, b, other);
  }
  ASSERT_TRUE(matrix.Factor());
  matrix.Solve(right);
  for (std::uint32_t i = 0; i < kBodies; ++i) {
    for (std::size_t k = 0; k < 6; ++k) EXPECT_THAT(right[i][k], DoubleNear(wanted[i][k], 1e-9));
  }
}

TEST(BlockCholeskyTest, ATreeFillsInNothing) {
  std::vector<std::pair<std::uint32_t, std::uint32_t>> edges;
  for (std::uint32_t i = 1; i < 32; ++i) edges.emplace_back(i, (i - 1) / 2);
  BlockCholesky matrix;
  matrix.Analyze(32, edges);
  EXPECT_EQ(matrix.blocks(), edges.size());
}

TEST(BlockCholeskyTest, RefusesWhatIsNotPositiveDefinite) {
  BlockCholesky matrix;
  matrix.Analyze(1, {});
  matrix.Clear();
  Matrix6 block{};
  block[3][3] = -2;
  matrix.Add(0, 0, block);
  EXPECT_FALSE(matrix.Factor());
}

}  // namespace
}  // namespace tessera::physics
