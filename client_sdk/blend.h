// Poses between poses.
//
// Pure functions; any thread.
#pragma once

#include "core/world/math.h"
#include "core/world/scene.h"

namespace tessera::client {

// Along the straight line, and the shorter arc; `share` from 0 (a) to 1 (b).
inline Pose Between(const Pose& a, const Pose& b, double share) {
  const Quatd& p = a.orientation;
  const Quatd& q = b.orientation;
  const double near = 1 - share;
  const double far = p.x * q.x + p.y * q.y + p.z * q.z + p.w * q.w < 0 ? -share : share;
  return {a.position + (b.position - a.position) * share,
          Normalized(
              Quatd(near * p.x + far * q.x, near * p.y + far * q.y, near * p.z + far * q.z, near * p.w + far * q.w))};
}

inline bool AtRest(const BodyState& state) {
  return state.asleep || (state.linear_velocity == Vec3f() && state.angular_velocity == Vec3f());
}

// A rotation by a share of the angle, about the same axis, nearly.
inline Quatd Share(const Quatd& turn, double share) { return Between({{}, {}}, {{}, turn}, share).orientation; }

}  // namespace tessera::client
