#include "core/physics/solve/solver.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <deque>
#include <numbers>
#include <random>
#include <vector>

#include "core/physics/solve/tuning.h"

namespace tessera::physics {
namespace {

constexpr float kGravity_m_s2 = 9.81f;

// Bodies, and contacts and joints made by hand.
struct SolverScene {
  std::uint32_t Add(float mass, Vec3f inertia, Vec3f velocity = {}, Vec3f spin = {}) {
    SolverBody body;
    body.mass_kg = mass;
    body.inertia_kg_m2 = inertia;
    body.velocity = velocity;
    body.angular_velocity = spin;
    bodies.push_back(body);
    return static_cast<std::uint32_t>(bodies.size() - 1);
  }
  Manifold& Touch(std::uint32_t a, std::uint32_t b, Vec3f normal, PairMaterial material) {
    manifolds.emplace_back();
    manifolds.back().normal = normal;
    contacts.push_back({.a = a, .b = b, .manifold = &manifolds.back(), .material = material});
    return manifolds.back();
  }
  static void Point(Manifold& manifold, Vec3f r_a, Vec3f r_b, float separation) {
    ManifoldPoint& point = manifold.points[static_cast<std::size_t>(manifold.count++)];
    point = {};
    point.r_a = r_a;
    point.r_b = r_b;
    point.separation_m = separation;
  }
  void Solve(Solver& solver, int substeps = 4, float dt = 1.0f / 60) {
    solver.Solve({bodies, contacts, joints, substeps, dt});
  }

  std::vector<SolverBody> bodies;
  std::deque<Manifold> manifolds;
  std::vector<ContactConstraint> contacts;
  std::vector<JointConstraint> joints;
};

Vec3f BoxInertia(float mass, Vec3f half) {
  return Vec3f(half.y * half.y + half.z * half.z, half.x * half.x + half.z * half.z,
               half.x * half.x + half.y * half.y) *
         (mass / 3);
}

// Distance that a block slides in 2 s on a plane through y = 0, some steps after it was put there. Gravity is tilted,
// not the plane.
float SlideOnSlope(float friction, float tangent, int settle) {
  Solver solver;
  const float angle = std::atan(tangent);
  SolverScene scene;
  const std::uint32_t box = scene.Add(5, BoxInertia(5, {.5f, .1f, .5f}));
  Manifold& manifold = scene.Touch(kStatic, box, {0, 1, 0}, {.friction = friction});
  for (const float x : {-.5f, .5f}) {
    for (const float z : {-.5f, .5f}) SolverScene::Point(manifold, {x, 0, z}, {x, -.1f, z}, 0);
  }
  float slid = 0;
  for (int step = 0; step < settle + 120; ++step) {
    const bool tilted = step >= settle;
    // The slope runs along a diagonal, where a friction pyramid would be wrong by a factor of root 2.
    const float along = tilted ? std::sin(angle) * std::sqrt(.5f) : 0;
    scene.bodies[0].acceleration = Vec3f{along, tilted ? -std::cos(angle) : -1, along} * kGravity_m_s2;
    scene.Solve(solver);
    for (ManifoldPoint& point : manifold.points) point.separation_m += scene.bodies[0].moved_m.y;
    if (tilted) slid += std::hypot(scene.bodies[0].moved_m.x, scene.bodies[0].moved_m.z);
  }
  return slid;
}

TEST(SolverTest, HoldsABlockBelowTheFrictionLimitAndLetsItSlideAbove) {
  EXPECT_LT(SlideOnSlope(.5f, .5f * .99f, 60), 1e-4f);
  EXPECT_LT(SlideOnSlope(.5f, .5f * .99f, 0), 5e-3f) << "while it sinks in";
  // Above the limit a = g (sin - mu cos), and s = a t^2 / 2 over 2 s.
  const float angle = std::atan(.5f * 1.01f);
  const float slid = kGravity_m_s2 * (std::sin(angle) - .5f * std::cos(angle)) * 2;
  EXPECT_NEAR(SlideOnSlope(.5f, .5f * 1.01f, 60), slid, .05f * slid) << "the net force is a hundredth of friction";
}

// A heap of bodies, each touching some others at random points, with all kinds of contacts.
SolverScene Heap(unsigned seed, int bodies, bool restitution) {
  std::mt19937 random(seed);
  const auto uniform = [&](float lo, float hi) {
    return lo + (hi - lo) * static_cast<float>(random() % 100001) / 100000;
  };
  const auto vector = [&](float size) {
    return Vec3f{uniform(-size, size), uniform(-size, size), uniform(-size, size)};
  };
  SolverScene scene;
  for (int i = 0; i < bodies; ++i) {
    const float mass = std::pow(10.0f, uniform(-1, 2));
    const std::uint32_t body =
        scene.Add(mass, Vec3f{uniform(.2f, .5f), uniform(.2f, .5f), uniform(.2f, .5f)} * mass, vector(3), vector(3));
    const Vec3d axis(Normalized(vector(1)));
    const double half = uniform(0, 1.5f);
    scene.bodies[body].rotation =
        RotationOf({axis.x * std::sin(half), axis.y * std::sin(half), axis.z * std::sin(half), std::cos(half)});
  }
  for (std::uint32_t a = 0; a < scene.bodies.size(); ++a) {
    for (std::uint32_t b = a + 1; b < std::min<std::size_t>(a + 6, scene.bodies.size()); ++b) {
      PairMaterial material;
      const int kind = static_cast<int>(random() % 3);
      material.friction = kind > 0 ? uniform(.1f, 1) : 0;
      if (kind == 2) material.rolling_m = material.spinning_m = uniform(.01f, .1f);
      if (restitution && random() % 2 == 0) material.restitution = uniform(.1f, 1);
      Manifold& manifold = scene.Touch(a, b, Normalized(vector(1)), material);
      const Vec3f apart = vector(1);
      const int count = 1 + static_cast<int>(random() % 4);
      for (int i = 0; i < count; ++i) {
        const Vec3f r = vector(.7f);
        SolverScene::Point(manifold, r, r - apart, uniform(-.02f, .02f));
        manifold.points[static_cast<std::size_t>(i)].normal_impulse = uniform(0, 1);
      }
    }
  }
  return scene;
}

TEST(SolverTest, KeepsLinearMomentum) {
  Solver solver;
  for (unsigned seed = 1; seed <= 5; ++seed) {
    SolverScene scene = Heap(seed, 40, true);
    const auto momentum = [&] {
      Vec3d sum;
      for (const SolverBody& body : scene.bodies) sum += Vec3d(body.velocity) * static_cast<double>(body.mass_kg);
      return sum;
    };
    const Vec3d before = momentum();
    scene.Solve(solver);
    EXPECT_LT(Length(momentum() - before), 1e-3) << "of about " << Length(before);
  }
}

// Two bodies with one contact slide along each other while they touch. Their angular momentum about a point stays,
// because their lever arms meet in one place.
TEST(SolverTest, KeepsAngularMomentum) {
  Solver solver;
  SolverScene scene;
  const Vec3f x_a{0, 0, 0}, x_b{.3f, 1.1f, -.2f}, p{.2f, .5f, .1f};
  scene.Add(2, {1, 2, 3}, {1, 3, 0}, {2, -1, 3});
  scene.Add(7, {3, 1, 2}, {0, -2, 1}, {-1, 4, 0});
  Manifold& manifold = scene.Touch(0, 1, Normalized(Vec3f{.1f, 1, .2f}),
                                   {.friction = .5f, .rolling_m = .02f, .spinning_m = .02f, .restitution = .4f});
  SolverScene::Point(manifold, p - x_a, p - x_b, -.01f);
  SolverScene::Point(manifold, p - x_a + Vec3f{.3f, 0, 0}, p - x_b + Vec3f{.3f, 0, 0}, 0);
  const auto momentum = [&] {
    Vec3f sum;
    for (const auto& [body, x] : {std::pair(scene.bodies[0], x_a), std::pair(scene.bodies[1], x_b)}) {
      const Vec3f w = body.angular_velocity, i = body.inertia_kg_m2;
      sum += Cross(x + body.moved_m, body.velocity) * body.mass_kg + Vec3f{i.x * w.x, i.y * w.y, i.z * w.z};
    }
    return sum;
  };
  const Vec3f before = momentum();
  const Vec3f spin_before = scene.bodies[0].angular_velocity;
  scene.Solve(solver);
  EXPECT_GT(Length(scene.bodies[0].angular_velocity - spin_before), .1f);
  EXPECT_LT(Length(momentum() - before), 2e-5f * Length(before));
}

void ExpectSameBits(const SolverScene& p, const SolverScene& q, std::size_t bodies, std::size_t first_in_q = 0) {
  for (std::size_t i = 0; i < bodies; ++i) {
    const SolverBody &a = p.bodies[i], &b = q.bodies[first_in_q + i];
    EXPECT_EQ(a.velocity, b.velocity) << i;
    EXPECT_EQ(a.angular_velocity, b.angular_velocity) << i;
    EXPECT_EQ(a.moved_m, b.moved_m) << i;
    EXPECT_EQ(a.turned_rad, b.turned_rad) << i;
    EXPECT_EQ(a.angular_impulse_nms, b.angular_impulse_nms) << i;
  }
}

TEST(SolverTest, GivesTheSameBitsOnEveryPath) {
  if (!__builtin_cpu_supports("avx2")) GTEST_SKIP() << "one path only on this machine";
  Solver narrow(SimdPath::kSse2), wide(SimdPath::kAvx2);
  for (unsigned seed = 1; seed <= 10; ++seed) {
    SolverScene p = Heap(seed, 60, true), q = Heap(seed, 60, true);
    p.Solve(narrow);
    q.Solve(wide);
    ExpectSameBits(p, q, p.bodies.size());
    for (std::size_t i = 0; i < p.manifolds.size(); ++i) {
      EXPECT_EQ(p.manifolds[i].friction_impulse, q.manifolds[i].friction_impulse);
      EXPECT_EQ(p.manifolds[i].total_rolling, q.manifolds[i].total_rolling);
      EXPECT_EQ(p.manifolds[i].points[0].total_impulse, q.manifolds[i].points[0].total_impulse);
    }
  }
}

TEST(SolverTest, GivesAnIslandTheSameBitsAloneAndInCompany) {
  Solver solver;
  SolverScene alone = Heap(3, 20, true);
  SolverScene both = Heap(4, 30, true);
  const auto first = static_cast<std::uint32_t>(both.bodies.size());
  SolverScene copy = Heap(3, 20, true);
  both.bodies.insert(both.bodies.end(), copy.bodies.begin(), copy.bodies.end());
  for (ContactConstraint contact : copy.contacts) {
    contact.a += first;
    contact.b += first;
    both.contacts.push_back(contact);
  }
  alone.Solve(solver);
  both.Solve(solver);
  ExpectSameBits(alone, both, alone.bodies.size(), first);
}

// More contacts on one body than there are colors.
TEST(SolverTest, CarriesAPlateOnManyBalls) {
  Solver solver;
  SolverScene scene;
  const std::uint32_t plate = scene.Add(100, {100, 200, 100});
  for (int i = 0; i < 150; ++i) {
    const float x = static_cast<float>(i % 15) - 7, z = static_cast<float>(i / 15) - 4.5f;
    const std::uint32_t ball = scene.Add(1, {.1f, .1f, .1f});
    SolverScene::Point(scene.Touch(plate, ball, {0, -1, 0}, {.friction = .5f}), {x, -.5f, z}, {0, .5f, 0}, -kSlop_m);
    SolverScene::Point(scene.Touch(kStatic, ball, {0, 1, 0}, {.friction = .5f}), {x, 0, z}, {0, -.5f, 0}, -kSlop_m);
  }
  for (int step = 0; step < 60; ++step) {
    for (SolverBody& body : scene.bodies) body.acceleration = {0, -kGravity_m_s2, 0};
    scene.Solve(solver, 8);
  }
  EXPECT_LT(Length(scene.bodies[plate].velocity), .01f);
  float carried = 0;
  for (std::size_t i = 1; i < scene.manifolds.size(); i += 2) carried += scene.manifolds[i].points[0].total_impulse;
  EXPECT_NEAR(carried, 250 * kGravity_m_s2 / 60, .5f);
}

TEST(SolverTest, ExchangesTheVelocitiesOfAnElasticPair) {
  Solver solver;
  SolverScene scene;
  scene.Add(3, {1, 1, 1}, {4, 0, 0});
  scene.Add(3, {1, 1, 1}, {-1, 0, 0});
  SolverScene::Point(scene.Touch(0, 1, {1, 0, 0}, {.restitution = 1}), {.5f, 0, 0}, {-.5f, 0, 0}, .03f);
  scene.Solve(solver);
  EXPECT_NEAR(scene.bodies[0].velocity.x, -1, 1e-5f);
  EXPECT_NEAR(scene.bodies[1].velocity.x, 4, 1e-5f);
  // They meet at .03 / 5 s and part from there.
  EXPECT_NEAR(scene.bodies[0].moved_m.x, 4 * .006f - 1 * (1.0f / 60 - .006f), 1e-5f);
}

TEST(SolverTest, PassesABlowThroughARowOfBalls) {
  Solver solver;
  for (const bool backwards : {false, true}) {
    SolverScene scene;
    for (int i = 0; i < 6; ++i) scene.Add(1, {1, 1, 1});
    scene.bodies[backwards ? 5 : 0].velocity.x = backwards ? -3.0f : 3.0f;
    for (std::uint32_t i = 0; i < 5; ++i) {
      SolverScene::Point(scene.Touch(i, i + 1, {1, 0, 0}, {.restitution = 1}), {.1f, 0, 0}, {-.1f, 0, 0}, 0);
    }
    scene.Solve(solver);
    const SolverBody& last = scene.bodies[backwards ? 0 : 5];
    EXPECT_NEAR(std::abs(last.velocity.x), 3, 1e-4f);
  }
}

// A ball that falls on a plane has the same E = g y + v^2 / 2 one step before and one after.
TEST(SolverTest, KeepsTheEnergyOfAPerfectBounce) {
  Solver solver;
  for (int i = 0; i < 50; ++i) {
    SolverScene scene;
    const float height = .003f * static_cast<float>(i), speed = 9.7f;
    scene.Add(10, {.04f, .04f, .04f}, {0, -speed, 0});
    scene.bodies[0].acceleration = {0, -kGravity_m_s2, 0};
    SolverScene::Point(scene.Touch(kStatic, 0, {0, 1, 0}, {.restitution = 1}), {0, 0, 0}, {0, -.1f, 0}, height);
    scene.Solve(solver, 4);
    const SolverBody& ball = scene.bodies[0];
    const float before = kGravity_m_s2 * height + speed * speed / 2;
    const float after = kGravity_m_s2 * (height + ball.moved_m.y) + ball.velocity.y * ball.velocity.y / 2;
    EXPECT_NEAR(after / before, 1, 1e-5f) << height;
    EXPECT_GT(ball.velocity.y, 0);
  }
}

// A body that is too slow to bounce must not gather speed again in the gap that is left.
TEST(SolverTest, LetsABouncingBoxComeToRest) {
  Solver solver;
  SolverScene scene;
  scene.Add(10, BoxInertia(10, {.5f, .5f, .5f}));
  Manifold& manifold = scene.Touch(kStatic, 0, {0, 1, 0}, {.friction = .5f, .restitution = .6f});
  for (const float x : {-.5f, .5f}) {
    for (const float z : {-.5f, .5f}) SolverScene::Point(manifold, {x, 0, z}, {x, -.5f, z}, .5f);
  }
  float fastest = 0;
  for (int step = 0; step < 300; ++step) {
    scene.bodies[0].acceleration = {0, -kGravity_m_s2, 0};
    scene.Solve(solver);
    for (ManifoldPoint& point : manifold.points) point.separation_m += scene.bodies[0].moved_m.y;
    if (step >= 240) fastest = std::max(fastest, Length(scene.bodies[0].velocity));
  }
  EXPECT_LT(fastest, 1e-3f);
  EXPECT_NEAR(manifold.points[0].separation_m, -kSlop_m, 2e-4f);
}

TEST(SolverTest, PushesOverlapsApartGently) {
  Solver solver;
  SolverScene scene;
  scene.Add(1, {1, 1, 1});
  scene.Add(1, {1, 1, 1});
  SolverScene::Point(scene.Touch(0, 1, {1, 0, 0}, {}), {0, 0, 0}, {0, 0, 0}, -.9f);
  scene.Solve(solver);
  const float speed = (scene.bodies[1].moved_m.x - scene.bodies[0].moved_m.x) * 60;
  EXPECT_GT(speed, 1);
  EXPECT_LE(speed, 3.001f);
  EXPECT_LT(Length(scene.bodies[0].velocity), 1e-3f);
}

TEST(SolverTest, StaysFiniteWhereRowsAreDegenerate) {
  Solver solver;
  SolverScene scene;
  scene.Add(1e-3f, {1e-9f, 1e-9f, 1e-9f}, {100, 0, 0}, {1000, 0, 0});
  scene.Add(1e6f, {1e7f, 1e7f, 1e7f});
  Manifold& manifold =
      scene.Touch(0, 1, {0, 0, -1}, {.friction = 1, .rolling_m = 1, .spinning_m = 1, .restitution = 1});
  for (int i = 0; i < 4; ++i) SolverScene::Point(manifold, {}, {}, -1);  // four points in one
  JointRows rows;
  rows.count = 6;
  for (int i = 0; i < 6; ++i) {  // six times the same row
    rows.rows[static_cast<std::size_t>(i)].linear = {1, 0, 0};
    rows.rows[static_cast<std::size_t>(i)].slot = static_cast<std::uint8_t>(i);
  }
  std::array<float, kJointSlots> impulses{};
  scene.joints.push_back({1, 0, &rows, impulses.data()});
  for (int i = 0; i < 10; ++i) {
    scene.Solve(solver);
    for (const SolverBody& body : scene.bodies) {
      EXPECT_TRUE(IsFinite(body.velocity) && IsFinite(body.angular_velocity) && IsFinite(body.moved_m));
    }
  }
}

}  // namespace
}  // namespace tessera::physics
