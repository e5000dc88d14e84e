// Bodies that nothing touches, and a top on its tip: scenes 1 to 3 of the suite.
//
// Body ids are named below. Pure functions, any thread.
#pragma once

#include "core/world/scene.h"

namespace tessera::scenes {

// One ball, 1 kg, at rest 100 m up, g = 10: after 1 s it has fallen 5 m.
inline constexpr BodyId kFaller{1};
Scene FreeFall();

// Scene 1: a box of .1 x .4 x .9 m and 10 kg. With gravity, v = (-2, 2, 8) and w = (.1, 5, .1); its simple twin
// without, v = (-.9, .4, .1) and w = (.5, 0, 0).
inline constexpr BodyId kFreeBox{1};
Scene FreeBox(bool simple = false);

// Scene 2: principal inertia (1, 2, 3) kg m^2, no gravity, w = (.01, 10, .01): it turns over and over. The stable twin
// starts with w = (.5, .5, 10).
inline constexpr BodyId kTHandle{1};
Scene THandle(bool stable = false);

// Scene 3: a pyramid on 7 corners, r = h = 2 m, upside down, its tip on the ground, tilted by 15 degrees, spinning at
// 75 rad/s about its axis, and already in steady precession.
struct SpinningTop {
  Scene scene;
  BodyId top;
  double precession_rad_s = 0;  // the truth: slow root of I1 W^2 cos(tilt) - I3 w W + M g d = 0, I1 about the tip
};
SpinningTop MakeSpinningTop();

}  // namespace tessera::scenes
