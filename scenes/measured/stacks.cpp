#include "scenes/measured/stacks.h"

#include <numbers>

#include "scenes/measured/builder.h"

namespace tessera::scenes {

Scene Tower(int n, double jitter_m, std::uint64_t seed) {
  Builder make("tower");
  Random random(seed);
  make.Ground();
  const ShapePtr cube = BoxOf(0.5, 0.5, 0.5);
  for (int i = 0; i < n; ++i) {
    const double x = random.Between(-jitter_m, jitter_m), z = random.Between(-jitter_m, jitter_m);
    make.Dynamic(cube, {x, 0.5 + i, z}, 1);
  }
  return make.Take();
}

Scene LoadedStack(int n, double ratio) {
  Builder make("loaded stack");
  make.Ground();
  const ShapePtr cube = BoxOf(0.5, 0.5, 0.5);
  for (int i = 0; i < n; ++i) make.Dynamic(cube, {0, 0.5 + i, 0}, 1);
  make.Dynamic(cube, {0, 0.5 + n, 0}, ratio);
  return make.Take();
}

Scene HeavyLoadStack(const HeavyLoad& load) {
  constexpr double kGravity_m_s2 = 9.81;
  Builder make("heavy load");
  make.Ground();
  const double half = load.size_m / 2;
  const ShapePtr cube = BoxOf(half, half, half);
  for (int i = 0; i < load.n; ++i) make.Dynamic(cube, {0, half + i * load.size_m, 0}, 1);
  make.Dynamic(cube, {load.aside_m, half + load.n * load.size_m, 0}, load.ratio);
  Scene scene = make.Take();
  const SinCos lean = SinCosOf(load.lean_rad);
  scene.gravity_m_s2 = Vec3d{lean.sin, -lean.cos, 0} * kGravity_m_s2;
  return scene;
}

Scene PressAgainstWall(const Press& press) {
  constexpr double kWall = 0.01, kLight = 0.1, kHeavy = 0.2;  // half widths, m
  Builder make("press");
  make.Ground();
  make.Static(BoxOf(kWall, 2, 2), {0, 2, 0});
  make.Dynamic(press.ball ? BallOf(kLight) : BoxOf(kLight, kLight, kLight), {-kWall - kLight, kHeavy, 0}, 1);
  make.Dynamic(BoxOf(kHeavy, kHeavy, kHeavy), {-kWall - 2 * kLight - press.gap_m - kHeavy, kHeavy, 0}, press.heavy_kg);
  return make.Take();
}

Scene MassRatioPyramid(int base, double apex_density) {
  constexpr double kSpacing = 1.1;
  Builder make("mass ratio pyramid");
  make.Ground();
  const ShapePtr cube = BoxOf(0.5, 0.5, 0.5);
  for (int row = 0; row < base; ++row) {
    for (int i = 0; i < base - row; ++i) {
      const double x = (i - (base - row - 1) / 2.0) * kSpacing;
      make.Dynamic(cube, {x, 0.5 + row, 0}, row == base - 1 ? apex_density : 1);
    }
  }
  return make.Take();
}

Scene Pyramid(int layers) {
  constexpr double kSize = 2, kPitch = 2.5;
  Builder make("pyramid");
  make.Ground();
  const ShapePtr cube = BoxOf(kSize / 2, kSize / 2, kSize / 2);
  for (int layer = 0; layer < layers; ++layer) {
    const int side = layers - layer;
    for (int i = 0; i < side * side; ++i) {
      const double x = (i % side - (side - 1) / 2.0) * kSize, z = (i / side - (side - 1) / 2.0) * kSize;
      make.Dynamic(cube, {x, kSize / 2 + layer * kPitch, z}, 1);
    }
  }
  return make.Take();
}

Scene ManyPyramids(int rows, int base) {
  Builder make("many pyramids");
  make.Ground();
  const ShapePtr cube = BoxOf(0.5, 0.5, 0.5);
  for (int pyramid = 0; pyramid < rows * rows; ++pyramid) {
    const double left = (pyramid % rows - (rows - 1) / 2.0) * (base * 1.1 + 2),
                 z = (pyramid / rows - (rows - 1) / 2.0) * 3;
    for (int row = 0; row < base; ++row) {
      for (int i = 0; i < base - row; ++i) {
        make.Dynamic(cube, {left + (i - (base - row - 1) / 2.0) * 1.1, 0.5 + row, z}, 1);
      }
    }
  }
  return make.Take();
}

Scene ShapeStack(ShapePtr shape, double height_m, double mass_kg, int n) {
  Builder make("stack");
  make.Ground();
  for (int i = 0; i < n; ++i) make.Dynamic(shape, {0, (i + 0.5) * height_m, 0}, mass_kg);
  return make.Take();
}

ShapePtr EightSidedPrism(double radius_m, double half_height_m) {
  std::vector<Vec3f> points;
  for (int i = 0; i < 16; ++i) {
    const SinCos at = SinCosOf((i % 8 + 0.5) * std::numbers::pi / 4);
    points.push_back(Vec3f(Vec3d{radius_m * at.cos, i < 8 ? -half_height_m : half_height_m, radius_m * at.sin}));
  }
  return HullOf(std::move(points));
}

}  // namespace tessera::scenes
