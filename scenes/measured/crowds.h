// Crowds: many bodies at once, for speed and for what small things do on rough ground. Scenes 14 and 16 and the rain.
//
// Body 1 is the ground. Pure functions, any thread.
#pragma once

#include "core/world/scene.h"

namespace tessera::scenes {

// Boxes (half .5), balls (.5) and capsules (.4, .6) in turn, in four layers 1.5 m apart from y = 2, on a plane;
// friction .5. Spacing 2.5 m is `rain`, 1.2 m is `dense`.
inline constexpr double kRainSpacing_m = 2.5, kDenseSpacing_m = 1.2;
Scene Rain(int count = 4000, double spacing_m = kRainSpacing_m);

// Scene 14: hulls, boxes, balls and capsules, 21 x 21 x 4, upon a wavy mesh of 20 000 triangles; friction .5,
// restitution .6.
Scene ConvexOnMesh(int side = 21, int layers = 4);

// `sleepers` boxes that lie on the ground asleep, and `rollers` balls that roll beside them. The rollers come first.
struct Sleepers {
  Scene scene;
  BodyId first_roller, last_roller;
};
Sleepers SleepersBesideRollers(int sleepers = 50'000, int rollers = 100);

// Scene 16: 400 thin boxes (.02 x .2 x .04 m) dropped on a mesh of waves. Below `kWaveFloor_m` one has fallen through.
inline constexpr double kWaveFloor_m = -1;
Scene ThinBoxesOnWaves(int count = 400);

}  // namespace tessera::scenes
