// Scenes of balls: bouncing, rolling, piled, and hung in a row. Scenes 4 to 7 of the suite.
//
// Pure functions, any thread.
#pragma once

#include <cstdint>

#include "core/world/scene.h"

namespace tessera::scenes {

// Scene 4: 7 x 7 balls, r .1, 10 kg, dropped from 5 m (centre) with restitution 1, no friction. Their energy above the
// ground, m g y + m v^2 / 2 with y of the centre, is 24 034 J and stays.
Scene Bounce();

// Scene 5: 25 balls (r .5, 1 kg) on a box (20 x 1 x 20 m, 10 kg), which a constant force of 150 N pulls along the
// ground.
struct Rolling {
  Scene scene;
  BodyId box, first_ball, last_ball;
  Vec3f force_n;                                         // on the box, each step
  Vec3d direction;                                       // unit
  double box_acceleration_m_s2, ball_acceleration_m_s2;  // the truth, along the force
};
Rolling RollingBalls(bool oblique);  // along z, or along (.5, .866) in x-z

// Scenes 6 and 7: 6 x 6 x 6 balls, r .1, 10 kg, centres .21 m apart, each moved by up to 1 mm; dropped by 1 mm with
// restitution 0, or by 1.001 m with restitution 1 (elastic). No friction. Bodies 2 to 217.
inline constexpr int kPileBalls = 216;
inline constexpr double kPileRadius_m = 0.1;
Scene BallPile(bool elastic, std::uint64_t seed = 1);

// Newton's cradle: balls that touch (r .5, 1 kg), each on a hinge 4 m above it; the first is lifted by 30 degrees.
// Restitution 1.
struct Cradle {
  Scene scene;
  BodyId first_ball, last_ball;
};
Cradle NewtonsCradle(int balls = 5);

}  // namespace tessera::scenes
