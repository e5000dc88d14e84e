// Scenes of jointed bodies: chains, loops, pendulums, springs, motors, ragdolls. Scene 11 among them.
//
// Pure functions, any thread.
#pragma once

#include <vector>

#include "core/world/scene.h"

namespace tessera::scenes {

// Scene 11: `links` capsules (1 m from joint to joint, r .125, 1 kg) and a ball of `ratio` kg (r 1, hung at its
// surface), stretched out level from the origin along x and let go. No gap should open at any joint.
struct Chain {
  Scene scene;
  std::vector<BodyId> bodies;  // from the fixed end; the ball last
  double link_m = 1, ball_radius_m = 1;
  double link_inertia_kg_m2 = 0, ball_inertia_kg_m2 = 0;  // about the axis of swinging
};
Chain BallAndChain(double ratio, int links = 32);

// A ring of capsules hinged end to end, lying on the ground, one of them pushed.
Scene ClosedLoop(int links = 12);

// A rod of 1 m on a hinge at its end, let go at `amplitude_rad`: a physical pendulum of I = m l^2 / 3.
struct Pendulum {
  Scene scene;
  BodyId rod;
  double length_m, gravity_m_s2;
};
Pendulum RodPendulum(double amplitude_rad);

// A mass on a spring along a slider's axis, off its rest by `amplitude_m`.
struct SpringMass {
  Scene scene;
  BodyId mass;
  double frequency_hz, amplitude_m;
};
SpringMass MassOnSpring(double frequency_hz, double amplitude_m = 0.1);

// A bar on a hinge with a motor that turns it at `rate_rad_s`.
Scene HingeMotor(double rate_rad_s = 3);

// `count` figures of ten bodies that fall on the ground in a heap.
Scene Ragdolls(int count);

// How far a joint has come apart: the distance of its two anchors, m. Of boxes, balls, capsules and cylinders, whose
// centre of mass is their shape's origin; `b` is null for the world.
double GapOf(const JointDef& joint, const BodyState& a, const BodyState* b);

}  // namespace tessera::scenes
