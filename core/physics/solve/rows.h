// Rows: one-dimensional constraints between two bodies, as a joint states them at the start of a step.
//
// The velocity along a row is   linear . (v_b - v_a) + angular_b . w_b - angular_a . w_a,
// and an impulse of 1 along it gives b (linear, angular_b) and a (-linear, -angular_a). World axes, about the centres
// of mass. A joint that is fixed to the world has a body a of infinite mass.
#pragma once

#include <array>
#include <cstdint>
#include <limits>

#include "core/physics/linear.h"

namespace tessera::physics {

enum class RowKind : std::uint8_t {
  kLocked,  // velocity 0, error driven to 0
  kLimit,   // one-sided: error >= 0 is the distance left to the stop, negative beyond it; pushes along +row only
  kMotor,   // velocity driven to `target_velocity` with at most `max_force`
  kSpring,  // force = -stiffness * error - damping * velocity, implicit
};

struct Row {
  Vec3f linear, angular_a, angular_b;
  RowKind kind = RowKind::kLocked;
  float error = 0;                                           // m or rad at the start of the step
  float target_velocity = 0;                                 // m/s or rad/s
  float max_force = std::numeric_limits<float>::infinity();  // N or N m, either way
  float stiffness = 0, damping = 0;                          // N/m, N s/m or N m/rad, N m s/rad
  std::uint8_t slot = 0;  // which of the joint's stored impulses is this row's; the same from step to step
};

inline constexpr int kJointRows = 18;  // six axes, each locked, or with a motor, a spring and a limit
inline constexpr int kJointSlots = 24;

struct JointRows {
  // Where the joint holds each body, from its centre of mass, and what lies between: from the point of a to that of b.
  // World axes. With these the solver turns the rows along with the bodies from substep to substep, taking all axes as
  // fixed to a: without, a chain under load swings itself apart.
  Vec3f arm_a, arm_b, gap;
  int count = 0;
  std::array<Row, kJointRows> rows;  // locked ones first
};

}  // namespace tessera::physics
