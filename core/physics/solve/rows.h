// Rows: the one-dimensional constraints of a joint between two bodies, at the start of a step.
//
// The velocity along a row is   linear . (v_b - v_a) + angular_b . w_b - angular_a . w_a,
// and an impulse of 1 along it gives b (linear, angular_b) and a (-linear, -angular_a). All is in world axes, about the
// centres of mass. A joint that is fixed to the world has a body a of infinite mass.
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
  std::uint8_t slot = 0;  // index of this row's impulse among those that the joint stores; the same from step to step
};

inline constexpr int kJointRows = 18;  // six axes, each locked, or with a motor, a spring and a limit
inline constexpr int kJointSlots = 24;

struct JointRows {
  // Arms from each centre of mass to the point where the joint holds that body, and the gap from a's point to b's, in
  // world axes. With these the solver turns the rows along with the bodies from substep to substep, as if all axes were
  // fixed to a; without that a chain under load swings itself apart.
  Vec3f arm_a, arm_b, gap;
  int count = 0;
  std::array<Row, kJointRows> rows;  // locked ones first
};

}  // namespace tessera::physics
