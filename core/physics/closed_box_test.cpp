// Bodies that fly about in a closed box have no source of energy, whatever they are made of and whichever of them
// press, bounce, rub, roll or are crowded into a corner. A world that adds to it again and again blows up.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <initializer_list>
#include <random>
#include <vector>

#include "core/physics/testing/bodies.h"

namespace tessera::physics {
namespace {

constexpr double kHalf_m = 3;

double EnergyOf(const World& world, const std::vector<BodyDef>& bodies) {
  double sum = 0;
  for (const BodyDef& body : bodies) {
    if (body.motion != Motion::kDynamic) continue;
    const BodyState state = world.StateOf(body.id);
    sum += (body.mass_kg * LengthSquared(Vec3d(state.linear_velocity)) +
            Dot(Vec3d(state.angular_momentum), Vec3d(state.angular_velocity))) /
           2;
  }
  return sum;
}

struct Box {
  explicit Box(std::uint64_t seed) : random(seed) {
    const double wall = Pick({0.0, 0.5, 1.0}), wall_friction = Pick({0.0, 0.5});
    std::uint64_t id = 1;
    for (int axis = 0; axis < 3; ++axis) {
      for (const double side : {-1.0, 1.0}) {
        Vec3d half{kHalf_m + 2, kHalf_m + 2, kHalf_m + 2}, at;
        (axis == 0 ? half.x : axis == 1 ? half.y : half.z) = 1;
        (axis == 0 ? at.x : axis == 1 ? at.y : at.z) = side * (kHalf_m + 1);
        BodyDef def = Dynamic(id++, MakeShapePtr(BoxShape{half}), at, 0);
        def.motion = Motion::kStatic;
        def.material = {.friction = wall_friction, .restitution = wall};
        bodies.push_back(def);
      }
    }
    const int per_side = 2 + static_cast<int>(seed % 2);
    const double step = 2 * kHalf_m / per_side, speed = Pick({1.0, 5.0, 20.0});
    for (int i = 0; i < per_side * per_side * per_side; ++i) {
      const double size = Uniform(0.1, 0.3) * step;
      const Vec3d at{(i % per_side + 0.5) * step - kHalf_m, (i / per_side % per_side + 0.5) * step - kHalf_m,
                     (i / per_side / per_side + 0.5) * step - kHalf_m};
      const ShapePtr shapes[] = {Ball(size), MakeShapePtr(BoxShape{{size, 0.7 * size, 0.4 * size}}),
                                 MakeShapePtr(CapsuleShape{0.5 * size, 0.6 * size}),
                                 MakeShapePtr(CylinderShape{0.7 * size, 0.6 * size})};
      BodyDef def =
          Dynamic(id++, shapes[static_cast<std::size_t>(Uniform(0, 3.999))], at, std::pow(10.0, Uniform(-1, 2)));
      def.material = {.friction = Pick({0.0, 0.5}), .restitution = Pick({0.0, 0.0, 0.6, 1.0})};
      def.initial.linear_velocity = Vec3f(Vec3d{Uniform(-1, 1), Uniform(-1, 1), Uniform(-1, 1)} * speed);
      def.initial.angular_velocity = Vec3f(Vec3d{Uniform(-1, 1), Uniform(-1, 1), Uniform(-1, 1)} * 5.0);
      bodies.push_back(def);
    }
  }
  double Uniform(double from, double to) { return std::uniform_real_distribution<double>(from, to)(random); }
  double Pick(std::initializer_list<double> of) {
    return *(of.begin() + static_cast<std::ptrdiff_t>(Uniform(0, static_cast<double>(of.size()) - 1e-9)));
  }

  std::mt19937_64 random;
  std::vector<BodyDef> bodies;
};

// Largest energy over the least before it. Exact would be 1; of 2000 boxes 76 come above 1.05 and none above 1.8, and
// those that blow up to thousands (docs/decisions/0083-what-has-turned-far-shows-another-side.md).
constexpr double kMostGained = 2;

TEST(ClosedBoxTest, NothingBlowsUp) {
  const char* const wanted = std::getenv("TESSERA_BOX_SEEDS");  // more than the tests have time for
  const std::uint64_t seeds = wanted == nullptr ? 200 : std::strtoull(wanted, nullptr, 10);
  for (std::uint64_t seed = 1; seed <= seeds; ++seed) {
    const Box box(seed);
    World world({.gravity_m_s2 = {}, .sleep = false});
    AddAll(world, box.bodies);
    double least = EnergyOf(world, box.bodies), gained = 1;
    for (int step = 0; step < 240; ++step) {
      world.Step(kDt);
      const double now = EnergyOf(world, box.bodies);
      gained = std::max(gained, now / least);
      least = std::min(least, now);
      ASSERT_TRUE(std::isfinite(now)) << "seed " << seed << ", step " << step;
    }
    EXPECT_LE(gained, kMostGained) << "seed " << seed;
  }
}

}  // namespace
}  // namespace tessera::physics
