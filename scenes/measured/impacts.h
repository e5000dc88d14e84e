// Fast bodies, slopes and single blows: scene 12 and the stresses with a closed form.
//
// Pure functions, any thread.
#pragma once

#include <cstdint>

#include "core/world/scene.h"

namespace tessera::scenes {

// Scene 12: a ball (r .25, 10 times as dense as water) flies along +x at a static wall about x = 0. `offset` in 0 to 1
// shifts its start by that part of the way it makes in a step of 1/60 s. No gravity.
struct Shot {
  Scene scene;
  BodyId bullet;
  double wall_face_m;  // x of the face it flies at
};
Shot ShotAtWall(double speed_m_s, double wall_half_thickness_m, double offset, double restitution = 0);
// The same wall with ten boxes of 1 kg behind it.
Shot ShotAtGuardedBoxes(double offset);
// A rod of 1 m, r .02, that spins at 30 rad/s across its way.
Shot SpinningRodAtWall(double speed_m_s, double offset);
// Two such bullets head on; restitution 1. The second is `bullet` + 1.
Shot HeadOn(double speed_m_s, double offset);
// A bullet without restitution at a wall that gives all speed back, with another, `driver` times as heavy, close
// behind: `bullet` + 1. Nothing may gain energy.
Shot DrivenAtWall(double speed_m_s, double driver, double offset);
// Past the edge of a wall at 1 cm.
Shot NearMiss(double speed_m_s, double offset);
// Through a trigger of 10 cm.
Shot ThroughTrigger(double speed_m_s, double offset);

// A unit cube on a slope whose angle is `share` of the angle at which friction .5 lets go.
Scene SlopeAtLimit(double share);
// A ball (r .5) thrown along x at 7 m/s without spin: it ends rolling at 5.
Scene SlidingToRolling();
// A rod that falls level-headed by `tilt_rad` upon the ground: I and the impact point give its spin after.
// Frictionless.
struct RodDrop {
  Scene scene;
  BodyId rod;
  double half_length_m, radius_m, tilt_rad, speed_m_s, mass_kg;
};
RodDrop ObliqueRod(double restitution);
// A ball that rolls at 8 m/s over a flat mesh of 80 x 80 squares.
Scene BallOverFlatMesh();

// Two unit cubes that begin in each other by `share` of their size, lying on the ground.
Scene Overlapping(double share);
// A needle: inertia 1000 : 1, dropped spinning on the ground.
Scene InertiaNeedle();

}  // namespace tessera::scenes
