// Prediction: where a body will be, by the dissertation's Algorithm 1 with orientation and damping added.
//
//   a  = F / m + g          p' = p + v t + a t^2 / 2          v' = v + a t
//
// Damping is the exact solution of dv/dt = a - k v, of which the above is the case k = 0. The orientation turns about w
// by the integral of abs(w). Contacts, joints and the wobble of a body that spins about none of its principal axes are
// left out: the prediction is right for free flight, and a bound for everything else.
#pragma once

#include "core/world/scene.h"

namespace tessera::physics {

struct Forces {
  Vec3d acceleration_m_s2;  // F / m + g
};

// The state `dt_s` >= 0 later. A sleeping body stays.
BodyState Predict(const BodyDef& def, const BodyState& state, const Forces& forces, double dt_s);

// Bounds of all that a body with local bounding radius `radius_m` sweeps over [0, dt_s], by the same formula.
Aabb SweptBounds(const BodyDef& def, const BodyState& state, const Forces& forces, double radius_m, double dt_s);

}  // namespace tessera::physics
