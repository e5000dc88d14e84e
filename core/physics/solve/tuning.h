// Constants of the solver, each with its unit, its reason, and the harm if it changes.
#pragma once

namespace tessera::physics {

// Softness of a contact or joint: the stiffness of a mass-spring-damper of this frequency (as a share of the substep
// rate) and damping ratio, times the effective mass. Higher shares ring; lower ones sink.
inline constexpr float kContactShare = 0.25f, kContactDamping = 10;

inline constexpr float kJointShare = 0.25f, kJointDamping = 2;

// Give of rows that are solved together, against that of a row by itself. Larger shows as a gap under a heavy load; at
// 0 rounding could make a heavy chain's matrix singular.
inline constexpr double kTreeSoftness = 1e-9;

// Joints that a substep has opened further than this, m or rad, are put back along a curve, and looked at again, so
// many times at most. Only bodies that turn by a large part of a circle in a substep need it.
inline constexpr float kCurvedGap_m = 0.005f;
inline constexpr int kRejoinRounds = 4;

// A joint that is torn open or beyond its stop is pulled back no faster than this. Without a limit, the limbs of
// ragdolls that are wedged apart in a heap come back at tens of m/s.
inline constexpr float kJointPush_m_s = 10, kJointPush_rad_s = 20;

// Square of the turn in a substep, rad^2, up to which a joint follows the curve of its point.
inline constexpr float kCurvingTurn2 = 0.01f;
// The same limit where joints are solved together. Bodies that turn faster lose a little energy; without that loss a
// taut chain with a heavy end whips itself up, as its links swing across at about the substep rate.
inline constexpr float kTreeCurvingTurn2 = 1e-4f;

// Overlaps are pushed out no faster than this, m/s, so that bodies placed into each other do not explode.
inline constexpr float kPushOut_m_s = 3;
// With more substeps than this the speed is as much lower. Bodies that cannot part, such as a slab under the arm of a
// turnstile, are pushed in each substep anew: at full speed in each of 64 that is millions of newtons.
inline constexpr int kPushingSubsteps = 4;

// Depth at which contacts rest, m, whatever they carry. Towers stand with anything from a millimetre to none; a larger
// depth is visible, and at 0 a resting point comes and goes.
inline constexpr float kSlop_m = 0.0003f;
// The same for pairs with a ball: all that is seen of it is a ball that lies lower than it should. A wall of boxes
// sways with less than the whole.
inline constexpr float kBallSlop_m = 0.00015f;
// That depth as a share of the smaller body's inner radius, where this is less: a card must not sink by its thickness.
inline constexpr float kSlopShare = 0.01f, kLeastSlop_m = 1e-5f;

// Approaches slower than this, m/s, do not bounce. Lower lets resting bodies tremble; higher ends a ball's bouncing
// early.
inline constexpr float kBounce_m_s = 0.2f;
// Most blows of one contact in a substep. A ball between two walls that close in on it is struck without end; what is
// left after these, relaxing takes.
inline constexpr int kMostBlows = 32;
// A body whose speed a blow changes by less, m/s, hits others when it would have without. Higher puts those blows off
// by the way that this makes in a substep; at 0 each thing that bounces in a large vehicle asks after all others there.
inline constexpr float kUnmoved_m_s = 0.001f;

// Points that lie this much deeper than the others, m, carry a new contact alone until impulses show which points do.
inline constexpr float kTouching_m = 0.002f;

// A body that has turned by more than this in a step, rad, touches with another side by then. Without a limit the point
// that touched at the start is found to be far away, and contacts of what spins at hundreds of rad/s stop nothing;
// lower, and what tips over an edge is held back.
inline constexpr float kOtherSide_rad = 1.5f;

// A contact of something round that flies past a body gives this at most so many times the energy of its impulse as
// turning; beyond, the body that is harder to turn bears what is to be made good. Without a limit a crate of 100 g that
// a heavy ball hits at 200 m/s is turned at 10 000 rad/s; lower, and what rolls fast is no longer turned as it should.
inline constexpr float kMostTurned = 4;

// Bodies that have moved by less than this against each other since the start of a step, m, are taken to touch where
// they did then. Smaller, and resting piles tremble by millimetres a second, because the correction of their lever arms
// comes a step late; larger, and impacts lose angular momentum: this times their impulse.
inline constexpr float kLeverArm_m = 2e-5f;

// The fewest substeps an island gets, as a power of two. With 1 a pyramid trembles and sinks by centimetres; 2 hold it.
inline constexpr int kFewestLevel = 1;
// The substeps that a new island starts with: with 2 a box put on a slope that it can stand on slips by millimetres
// first.
inline constexpr int kFirstLevel = 2;
// The fewest of an island with a joint. With 1 the limits of a ragdoll's joints fight each other until it bursts.
inline constexpr int kFewestJointedLevel = 2;

// Further demands for more substeps: a joint torn open this far gets 8, an overlap this deep or an approach this
// fast 4.
inline constexpr float kWideGap_m = 0.01f, kDeep_m = 0.05f, kFast_m_s = 20;

// An island gets fewer substeps only when all its demands, times this, would still ask for fewer. At 1 the count flips.
inline constexpr float kFewerMargin = 1.3f;

// Cost of solving a joint, in contacts.
inline constexpr int kJointWork = 16;

}  // namespace tessera::physics
