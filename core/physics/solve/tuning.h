// Constants of the solver. Each with its unit, its reason, and what breaks if it changes.
#pragma once

namespace tessera::physics {

// How soft a contact or joint is: the stiffness of a mass-spring-damper of this frequency (as a share of the substep
// rate) and damping ratio, times the effective mass. Higher shares ring; lower ones sink.
inline constexpr float kContactShare = 0.25f, kContactDamping = 10;

inline constexpr float kJointShare = 0.25f, kJointDamping = 2;

// Overlaps are pushed out no faster than this, m/s, so that bodies placed into each other do not explode.
inline constexpr float kPushOut_m_s = 3;

// Depth at which contacts rest, m, whatever they carry. At 0 the corners of a loaded face would part by rounding and
// let a tower lean.
inline constexpr float kSlop_m = 0.001f;

// Points that lie this much deeper than the others, m, carry a new contact alone until it has impulses to tell by.
inline constexpr float kTouching_m = 0.002f;

}  // namespace tessera::physics
