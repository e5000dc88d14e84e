// Free flight: how a body without contact or joint moves, exactly.
//
// The centre of mass follows the parabola of its acceleration; rotation keeps the angular momentum in world space to
// the bit. Round bodies and those with an axis of symmetry turn exactly; others by a splitting of the free rigid body
// (after McLachlan and Reich) composed to fourth order, in as many pieces as the turn of one step asks for. A T-handle
// at 60 Hz stays within 1e-6 rad of the truth for 20 s.
//
//   FlightState state{{0, 100, 0}, {}, {}, AngularMomentumOf(inertia, {}, w)};
//   Fly(inertia, gravity, {}, 1.0 / 60, &state);
//
// Thread rule: free functions without state. Same bits on every host.
#pragma once

#include "core/world/math.h"

namespace tessera::physics {

struct FlightState {
  Vec3d position;          // m
  Quatd orientation;       // turns the principal axes, unit
  Vec3f velocity;          // m/s
  Vec3f angular_momentum;  // world axes, kg m^2/s
};

// Moves `state` by one step. `inertia` is principal, kg m^2, all > 0; `acceleration`, m/s^2, is constant over the step;
// `torque` is in N m, world axes.
void Fly(Vec3d inertia, Vec3d acceleration, Vec3d torque, double dt_s, FlightState* state);

// I(q)^-1 L, world axes, rad/s; and its inverse. They compute in doubles and round once, so both ends of a wire agree.
Vec3f AngularVelocityOf(Vec3d inertia, Quatd orientation, Vec3f angular_momentum);
Vec3f AngularMomentumOf(Vec3d inertia, Quatd orientation, Vec3f angular_velocity);

}  // namespace tessera::physics
