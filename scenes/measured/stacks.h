// Stacks: towers, loaded stacks, pyramids. Scenes 9, 10 and 15.
//
// All stand on `Ground()`, which is body 1; what stands on it follows from the bottom up. Pure functions, any thread.
#pragma once

#include <cstdint>

#include "core/world/scene.h"

namespace tessera::scenes {

inline constexpr BodyId kGround{1};

// Scene 9: unit cubes of 1 kg, friction .5, each shifted sideways by up to `jitter_m`. The top one's centre belongs at
// n - .5.
Scene Tower(int n, double jitter_m = 0, std::uint64_t seed = 1);

// A unit cube of `ratio` kg on `n` of 1 kg. The load's centre belongs at n + .5.
Scene LoadedStack(int n, double ratio);

// A cube of `size_m` of `ratio` kg on `n` of 1 kg, all under a pull that leans by `lean_rad` towards x. The load stands
// `aside_m` off the middle.
struct HeavyLoad {
  int n = 10;
  double size_m = 1, ratio = 3000, lean_rad = 0, aside_m = 0;
};
Scene HeavyLoadStack(const HeavyLoad& load);

// A cube or a ball of 1 kg and .2 m, and `gap_m` behind it a cube of `heavy_kg` and .4 m, before a wall of 2 cm whose
// middle is at x = 0. Push the heavy one, kPresser, towards +x.
inline constexpr BodyId kPressed{3}, kPresser{4};
struct Press {
  double heavy_kg = 10, gap_m = 0;
  bool ball = false;
};
Scene PressAgainstWall(const Press& press);

// Scene 10: a triangle of unit cubes, `base` at the bottom, one less in each row; the one at the top is `apex_density`
// times as heavy.
Scene MassRatioPyramid(int base, double apex_density);

// Scene 15: layer i of `layers` has (layers - i)^2 cubes of 2 m, .5 m of air between the layers; 1240 at 15.
Scene Pyramid(int layers = 15);
// Scene 15: `rows` x `rows` flat pyramids of unit cubes, `base` at the bottom; 14 x 14 of base 10 are 10 780.
Scene ManyPyramids(int rows = 14, int base = 10);

// n of one shape upon each other; `height_m` of one. For cylinders and hulls, small boxes and cards.
Scene ShapeStack(ShapePtr shape, double height_m, double mass_kg, int n);
ShapePtr EightSidedPrism(double radius_m, double half_height_m);

}  // namespace tessera::scenes
