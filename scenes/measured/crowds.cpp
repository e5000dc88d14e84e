#include "scenes/measured/crowds.h"

#include <cmath>

#include "scenes/measured/builder.h"

namespace tessera::scenes {
namespace {

Quatd AnyOrientation(Random& random) {
  for (;;) {
    const auto component = [&] { return random.Between(-1, 1); };
    const double x = component(), y = component(), z = component(), w = component();
    const double length = x * x + y * y + z * z + w * w;
    if (length > 0.01 && length <= 1) return Normalized(Quatd{x, y, z, w});
  }
}

}  // namespace

Scene Rain(int count, double spacing_m) {
  constexpr int kLayers = 4;
  Builder make("rain");
  make.Ground();
  const ShapePtr shapes[] = {BoxOf(0.5, 0.5, 0.5), BallOf(0.5), CapsuleOf(0.4, 0.6)};
  const int a_layer = (count + kLayers - 1) / kLayers;
  const int side = static_cast<int>(std::ceil(std::sqrt(a_layer)));
  for (int i = 0; i < count; ++i) {
    const int cell = i % a_layer;
    const Vec3d place{(cell % side - (side - 1) / 2.0) * spacing_m, 2 + i / a_layer * 1.5,
                      (cell / side - (side - 1) / 2.0) * spacing_m};
    make.Dynamic(shapes[i % 3], place, 1);
  }
  return make.Take();
}

Scene ConvexOnMesh(int side, int layers) {
  constexpr int kCells = 100;  // 20 000 triangles
  constexpr double kCell = 1;
  const Material material{.friction = 0.5, .restitution = 0.6};
  Builder make("convex on mesh");
  make.Static(GridMeshOf(kCells, kCell,
                         [](double x, double z) { return 1.5 * SinCosOf(x * 0.25).sin * SinCosOf(z * 0.25).cos; }),
              {}, material);
  std::vector<Vec3f> rock;
  Random random(7);
  while (rock.size() < 24) {
    const Vec3d point{random.Between(-1, 1), random.Between(-1, 1), random.Between(-1, 1)};
    const double length = Length(point);
    if (length > 0.1 && length <= 1) rock.push_back(Vec3f(point * (0.6 / length)));
  }
  const ShapePtr shapes[] = {BoxOf(0.5, 0.5, 0.5), BallOf(0.5), CapsuleOf(0.35, 0.4), HullOf(rock)};
  for (int i = 0; i < side * side * layers; ++i) {
    const Vec3d place{(i % side - (side - 1) / 2.0) * 2, 4.0 + i / (side * side) * 2,
                      (i / side % side - (side - 1) / 2.0) * 2};
    make.Dynamic(shapes[i % 4], place, 1, material).initial.orientation = AnyOrientation(random);
  }
  return make.Take();
}

Sleepers SleepersBesideRollers(int sleepers, int rollers) {
  constexpr double kSpacing = 1.5, kLane = 1.5, kSpeed = 3, kRadius = 0.5;
  Builder make("asleep");
  make.Ground();
  Sleepers result;
  const ShapePtr ball = BallOf(kRadius), cube = BoxOf(0.5, 0.5, 0.5);
  for (int i = 0; i < rollers; ++i) {
    BodyDef& roller = make.Dynamic(ball, {i * kLane, kRadius, -20}, 1);
    TurnAbout(roller, {i * kLane, 0, -20}, {-kSpeed / kRadius, 0, 0});
    result.last_roller = roller.id;
  }
  result.first_roller = BodyId(2);
  const int side = static_cast<int>(std::ceil(std::sqrt(sleepers)));
  for (int i = 0; i < sleepers; ++i) {
    BodyDef& sleeper = make.Dynamic(cube, {i % side * kSpacing, 0.5, i / side * kSpacing}, 1);
    sleeper.may_sleep = true;
    sleeper.initial.asleep = true;
  }
  result.scene = make.Take();
  return result;
}

Scene ThinBoxesOnWaves(int count) {
  constexpr double kSpacing = 0.3;
  Builder make("thin boxes on waves");
  make.Static(GridMeshOf(60, 0.2, [](double x, double z) { return 0.15 * SinCosOf(3 * x).sin * SinCosOf(3 * z).sin; }),
              {}, {.friction = 0.6});
  Random random(16);
  const ShapePtr box = BoxOf(0.01, 0.1, 0.02);
  const int side = static_cast<int>(std::ceil(std::sqrt(count)));
  for (int i = 0; i < count; ++i) {
    const Vec3d place{(i % side - (side - 1) / 2.0) * kSpacing, 1 + random.Between(0, 0.5),
                      (i / side - (side - 1) / 2.0) * kSpacing};
    make.Dynamic(box, place, 0.1, {.friction = 0.6}).initial.orientation = AnyOrientation(random);
  }
  return make.Take();
}

}  // namespace tessera::scenes
