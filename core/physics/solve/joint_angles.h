// Joint angles: the turn of one frame against another, and how it changes with their angular velocity.
//
// Each angle comes with its gradient: d(value)/dt = gradient . (w_b - w_a), world axes. Where an angle loses its
// meaning (gimbal lock, opposed axes) gradients are bounded and everything stays finite.
//
// Thread rule: free functions without state. Same bits on every host.
#pragma once

#include <array>

#include "core/world/math.h"

namespace tessera::physics {

struct JointAngle {
  double value = 0;  // rad
  Vec3d gradient;    // world axes
};
using JointAngles = std::array<JointAngle, 3>;

// Two frames, axes in world space.
struct FramePair {
  FramePair(Quatd orientation_a, Quatd orientation_b);

  Quatd q_a, q_b;
  std::array<Vec3d, 3> a, b;
  Vec3d InA(Vec3d world) const { return {Dot(a[0], world), Dot(a[1], world), Dot(a[2], world)}; }
  Vec3d InB(Vec3d world) const { return {Dot(b[0], world), Dot(b[1], world), Dot(b[2], world)}; }
};

// The rotation vector that turns a into b, along a's axes.
JointAngles RotationAngles(const FramePair& frames);

// The turn about axis k, which both share, -pi to pi. The other two values say how far these axes are apart, and vanish
// with that.
JointAngles HingeAngles(const FramePair& frames, std::size_t k);

// The angles of b = a Rz(z) Ry(y) Rx(x): all three; or, where x or z is held at 0, the other two all the way round, and
// the held one as the sine of its error.
JointAngles EulerAngles(const FramePair& frames);
JointAngles EulerAnglesWithoutX(const FramePair& frames);
JointAngles EulerAnglesWithoutZ(const FramePair& frames);

// The twist about x, and the rotation vector, along a's y and z, of the swing that takes a's x to b's.
struct SwingTwist {
  JointAngle twist, swing_y, swing_z;
};
SwingTwist SwingTwistOf(const FramePair& frames);

}  // namespace tessera::physics
