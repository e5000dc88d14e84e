// JointBlock: a joint of a batch in the form in which it is solved. Plain data.
#pragma once

#include <array>
#include <cstdint>

#include "core/physics/solve/kernel.h"
#include "core/physics/solve/rows.h"

namespace tessera::physics {

// A row in the form in which it is solved.
struct JointRow {
  Vec3f linear_a, angular_a, linear_b, angular_b;  // mass-normalised, with signs
  Vec3f linear;                                    // in m/s
  RowKind kind = RowKind::kLocked;
  std::uint8_t origin = 0;  // index among the joint's own rows
  float error = 0;          // now
  float relax_error = 0;    // a spring's error at the start of the substep, to which the force that is relaxed belongs
  float mass = 0;           // effective
  float target_velocity = 0;
  float max_impulse = 0;  // in a substep
  float stiffness = 0;    // impulse in a substep for an error of 1
  float damping = 0;      // impulse in a substep for a velocity of 1
  float impulse = 0;
};

inline constexpr int kLockedRows = 6;

struct JointBlock {
  std::uint32_t a = 0, b = 0;  // in the states
  const JointRows* from = nullptr;
  Vec3f arm_a, arm_b;  // from each centre of mass to the point on b
  int locked = 0, count = 0;
  float gap_m = 0;                        // largest error of the locked rows, m or rad
  bool in_tree = false;                   // its locked rows are solved together with those of its neighbours
  std::array<JointRow, kJointRows> rows;  // locked ones first
  std::array<std::array<float, kLockedRows>, kLockedRows> lower{};  // L
  // The velocities that the rows of a joint in a tree are to lose, and the impulses for that.
  std::array<float, kLockedRows> wanted{}, found{};
  std::array<float, kJointRows> last_errors{};  // errors of the joint's own rows a substep ago
  std::array<float, kJointRows> impulses{};     // along the joint's own rows, while those are made anew
};

}  // namespace tessera::physics
