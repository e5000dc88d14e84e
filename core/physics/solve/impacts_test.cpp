// Blows happen at their own moments within a step, however many there are: places and speeds are those of closed forms.
#include "core/physics/solve/impacts.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <utility>
#include <vector>

#include "core/physics/solve/solver.h"
#include "core/physics/solve/tuning.h"

namespace tessera::physics {
namespace {

constexpr double kFall_m_s2 = 9.81, kFrame_s = 1.0 / 60;

// Balls of radius .1, contacts of one point.
struct BouncingScene {
  std::uint32_t Ball(float mass, Vec3f velocity, bool falls = true) {
    SolverBody body;
    body.mass_kg = mass;
    body.inertia_kg_m2 = Vec3f{.004f, .004f, .004f} * mass;
    body.velocity = velocity;
    if (falls) body.acceleration = {0, -static_cast<float>(kFall_m_s2), 0};
    bodies.push_back(body);
    return static_cast<std::uint32_t>(bodies.size() - 1);
  }
  void Touch(std::uint32_t a, std::uint32_t b, float restitution, float separation, Vec3f r_b = {0, -.1f, 0}) {
    Manifold& manifold = manifolds.emplace_back();
    manifold.normal = {0, 1, 0};
    manifold.count = 1;
    manifold.points[0] = {};
    manifold.points[0].r_a = {0, a == kStatic ? 0 : .1f, 0};
    manifold.points[0].r_b = r_b;
    manifold.points[0].separation_m = separation;
    contacts.push_back({.a = a, .b = b, .manifold = &manifold, .material = {.restitution = restitution}});
  }
  void Solve(int substeps) {
    Solver solver;
    solver.Solve({bodies, contacts, {}, substeps, static_cast<float>(kFrame_s)});
  }

  std::vector<SolverBody> bodies;
  std::deque<Manifold> manifolds;
  std::vector<ContactConstraint> contacts;
};

// --- When a point hits

PointPath Falling(double height, double velocity, double acceleration, double h) {
  const double bend = acceleration * h * h / 2;
  return {static_cast<float>(height - bend), static_cast<float>(velocity + acceleration * h), static_cast<float>(bend)};
}

TEST(HitTimeTest, IsTheRootOfTheParabola) {
  constexpr float kH = 0.1f;
  // .2 = v t + g t^2 / 2, from where it is after .02 s as from the start.
  const double at = (-3 + std::sqrt(9 + 2 * kFall_m_s2 * 0.2)) / kFall_m_s2;
  const PointPath down = Falling(0.2, -3, -kFall_m_s2, kH);
  for (const float from : {0.0f, 0.02f}) {
    ASSERT_TRUE(HitTime(down, from, kH).has_value());
    EXPECT_NEAR(*HitTime(down, from, kH), at, 1e-6);
  }
  EXPECT_NEAR(down.PlaceAt(static_cast<float>(at), kH), 0, 1e-6);
  EXPECT_NEAR(down.VelocityAt(static_cast<float>(at), kH), -std::sqrt(9 + 2 * kFall_m_s2 * 0.2), 1e-5);
}

TEST(HitTimeTest, APointThatRisesComesDownAgain) {
  constexpr float kH = 0.1f;
  const PointPath up = Falling(0, 0.4, -kFall_m_s2, kH);
  ASSERT_TRUE(HitTime(up, 0, kH).has_value());
  EXPECT_NEAR(*HitTime(up, 0, kH), 0.8 / kFall_m_s2, 1e-6);
}

TEST(HitTimeTest, NoHitBeyondTheSubstepNorOfASlowPoint) {
  constexpr float kH = 0.1f;
  EXPECT_FALSE(HitTime(Falling(0.5, -3, 0, kH), 0, kH).has_value());
  EXPECT_FALSE(HitTime(Falling(0.001, -0.9 * kBounce_m_s, 0, kH), 0, kH).has_value());
  EXPECT_TRUE(HitTime(Falling(0.001, -1.1 * kBounce_m_s, 0, kH), 0, kH).has_value());
}

TEST(HitTimeTest, WhatOverlapsHitsAtOnceIfItGoesFurtherIn) {
  constexpr float kH = 0.1f;
  EXPECT_EQ(HitTime(Falling(-0.01, -1, 0, kH), 0.03f, kH), 0.03f);
  EXPECT_FALSE(HitTime(Falling(-0.01, 1, 0, kH), 0.03f, kH).has_value());
}

// --- Blows

// Balls of one mass exchange velocities. So, each taken without its own thickness and that of those below it, they seem
// to pass through each other: the heights at the end are those of points that fall and bounce alone, in their order.
TEST(ImpactTest, AColumnOfElasticBallsLandsAsIfTheyPassedThroughEachOther) {
  constexpr int kBalls = 8;
  constexpr double kSpeed = 4.4;
  for (const int substeps : {1, 2, 4, 8, 64}) {
    BouncingScene scene;
    std::vector<std::pair<double, double>> alone;  // height and velocity at the end
    double height = 0;
    for (std::uint32_t i = 0; i < kBalls; ++i) {
      const double gap = 0.002 + 0.0015 * i;
      scene.Ball(2, {0, static_cast<float>(-kSpeed), 0});
      scene.Touch(i == 0 ? kStatic : i - 1, i, 1, static_cast<float>(gap));
      height += gap;
      const double lands = (-kSpeed + std::sqrt(kSpeed * kSpeed + 2 * kFall_m_s2 * height)) / kFall_m_s2;
      const double up = kSpeed + kFall_m_s2 * lands, rest = kFrame_s - lands;
      ASSERT_GT(rest, 0);
      alone.emplace_back(up * rest - kFall_m_s2 * rest * rest / 2, up - kFall_m_s2 * rest);
    }
    std::sort(alone.begin(), alone.end());
    scene.Solve(substeps);
    height = 0;
    for (std::size_t i = 0; i < kBalls; ++i) {
      height += 0.002 + 0.0015 * static_cast<double>(i);
      EXPECT_NEAR(height + scene.bodies[i].moved_m.y, alone[i].first, 3e-6) << i << ", substeps " << substeps;
      EXPECT_NEAR(scene.bodies[i].velocity.y, alone[i].second, 3e-5) << i << ", substeps " << substeps;
    }
  }
}

// The common centre of mass stays on its parabola; the gap opens at e times the speed from the moment when they met.
TEST(ImpactTest, AnUnequalPairPartsFromWhereItMet) {
  constexpr double kGap = 0.03, kE = 0.5, kLight = 1, kHeavy = 3, kUp = 1, kDown = -4;
  for (const int substeps : {1, 2, 4}) {
    BouncingScene scene;
    scene.Ball(kLight, {0, kUp, 0});
    scene.Ball(kHeavy, {0, kDown, 0});
    scene.Touch(0, 1, static_cast<float>(kE), static_cast<float>(kGap));
    scene.Solve(substeps);
    const double meets = kGap / (kUp - kDown), rest = kFrame_s - meets;
    const double apart = scene.bodies[1].moved_m.y - scene.bodies[0].moved_m.y;
    EXPECT_NEAR(kGap + apart, kE * (kUp - kDown) * rest, 2e-6) << substeps;
    const double mean = (kLight * kUp + kHeavy * kDown) / (kLight + kHeavy);
    const double moved = (kLight * scene.bodies[0].moved_m.y + kHeavy * scene.bodies[1].moved_m.y) / (kLight + kHeavy);
    EXPECT_NEAR(moved, mean * kFrame_s - kFall_m_s2 * kFrame_s * kFrame_s / 2, 2e-6) << substeps;
  }
}

// J = (1 + e) v / (1/m + a^2/I) at time t; until then the body only falls, and from then on it turns too.
TEST(ImpactTest, ABodyStruckOffCentreTurnsFromThatMomentOn) {
  constexpr double kHeight = 0.03, kSpeed = 4, kE = 1, kArm = 0.05, kMass = 2, kInertia = .004 * kMass;
  for (const int substeps : {1, 2, 4}) {
    BouncingScene scene;
    scene.Ball(kMass, {0, -kSpeed, 0}, false);
    scene.Touch(kStatic, 0, kE, static_cast<float>(kHeight), {static_cast<float>(kArm), -.1f, 0});
    scene.Solve(substeps);
    const double impulse = (1 + kE) * kSpeed / (1 / kMass + kArm * kArm / kInertia);
    const double rest = kFrame_s - kHeight / kSpeed;
    const SolverBody& body = scene.bodies[0];
    EXPECT_NEAR(body.velocity.y, -kSpeed + impulse / kMass, 1e-5) << substeps;
    EXPECT_NEAR(body.moved_m.y, -kSpeed * kFrame_s + impulse / kMass * rest, 2e-6) << substeps;
    EXPECT_NEAR(body.angular_velocity.z, impulse * kArm / kInertia, 1e-4) << substeps;
    EXPECT_NEAR(body.turned_rad.z, impulse * kArm / kInertia * rest, 1e-5) << substeps;
  }
}

// A light ball between two heavy ones that close in on it is struck the more often the narrower it gets.
TEST(ImpactTest, BlowsWithoutEndAreCutShort) {
  BouncingScene scene;
  scene.Ball(1e4f, {0, 1, 0}, false);
  scene.Ball(0.01f, {0, 0.5f, 0}, false);
  scene.Ball(1e4f, {0, -1, 0}, false);
  scene.Touch(0, 1, 1, 1e-4f);
  scene.Touch(1, 2, 1, 1e-4f);
  scene.Solve(1);
  double momentum = 0;
  for (const SolverBody& body : scene.bodies) {
    EXPECT_TRUE(std::isfinite(body.velocity.y) && std::isfinite(body.moved_m.y));
    momentum += static_cast<double>(body.mass_kg) * body.velocity.y;
  }
  EXPECT_NEAR(momentum, 0.005, 0.005);
}

// The blows of one group know nothing of those of another, wherever these come in the order of times.
TEST(ImpactTest, CompanyChangesNoBit) {
  const auto column = [](BouncingScene& scene, std::uint32_t balls, float gap) {
    const auto first = static_cast<std::uint32_t>(scene.bodies.size());
    for (std::uint32_t i = 0; i < balls; ++i) {
      scene.Ball(1 + static_cast<float>(i), {0, -3, 0});
      scene.Touch(i == 0 ? kStatic : first + i - 1, first + i, .9f, gap * static_cast<float>(i + 1));
    }
  };
  BouncingScene alone, together;
  column(alone, 5, .004f);
  column(together, 7, .0031f);
  column(together, 5, .004f);
  alone.Solve(2);
  together.Solve(2);
  for (std::size_t i = 0; i < 5; ++i) {
    EXPECT_EQ(alone.bodies[i].velocity, together.bodies[7 + i].velocity) << i;
    EXPECT_EQ(alone.bodies[i].moved_m, together.bodies[7 + i].moved_m) << i;
  }
}

// --- Between what bounces and what pushes

// A ball that another one drives against a floor that gives its speed back: every push of the one meets a blow of the
// other in the next substep. No push may come back as a blow.
double EnergyAfterADriveAgainstTheFloor(float mass, float speed, float floor, float driven, float off_centre,
                                        int substeps) {
  BouncingScene scene;
  const std::uint32_t small = scene.Ball(0.6f, {0, speed, 0}), large = scene.Ball(mass, {0, speed, 0});
  scene.Touch(kStatic, small, floor, 0.0005f, {off_centre, -.1f, 0});
  scene.Touch(small, large, driven, -0.008f, {-off_centre, -.1f, 0});
  const auto energy = [&] {
    double sum = 0;
    for (const SolverBody& body : scene.bodies) {
      const Vec3f turns = body.angular_velocity, inertia = body.inertia_kg_m2;
      sum += body.mass_kg * (LengthSquared(Vec3d(body.velocity)) / 2 + kFall_m_s2 * body.moved_m.y) +
             (inertia.x * turns.x * turns.x + inertia.y * turns.y * turns.y + inertia.z * turns.z * turns.z) / 2;
    }
    return sum;
  };
  const double before = energy();
  scene.Solve(substeps);
  return energy() / before;
}

TEST(ImpactsTest, ABallBetweenAFloorThatBouncesAndOneThatPushesGainsNoEnergy) {
  for (const float mass : {0.5f, 3.0f, 40.0f, 400.0f}) {
    for (const float speed : {-1.0f, -6.0f, -20.0f}) {
      for (const float floor : {0.3f, 1.0f}) {
        for (const float driven : {0.0f, 0.5f, 1.0f}) {
          for (const float off_centre : {0.0f, 0.03f}) {
            for (const int substeps : {1, 2, 4, 8, 16, 64}) {
              EXPECT_LE(EnergyAfterADriveAgainstTheFloor(mass, speed, floor, driven, off_centre, substeps), 1.01)
                  << mass << " kg at " << speed << " m/s, " << floor << ", " << driven << ", " << off_centre << " m, "
                  << substeps << " substeps";
            }
          }
        }
      }
    }
  }
}

}  // namespace
}  // namespace tessera::physics
