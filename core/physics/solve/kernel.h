// Kernels: the wide inner loops of the solver, and the memory they work on.
//
// A contact block holds eight contacts, one to a lane; no two of a block, or of a colour, share a moving body. The same
// source is compiled once per instruction set, each into a namespace of its own, and gives the same bits in each. For
// that reason this header holds plain structs only: an inline function here might be emitted with AVX2 instructions and
// then be picked by the linker for everyone.
#pragma once

#include <cstddef>
#include <cstdint>
#include <type_traits>

namespace tessera::physics {

inline constexpr int kLanes = 8;

struct alignas(32) Lanes {
  float f[kLanes];
};

// The part of a body that a substep changes, as vectors of x, y, z, 0. A constraint to the world names a body of zeros.
struct alignas(32) SolvedState {
  float velocity[4], spin[4];  // mass-normalised: sqrt(m) v, sqrt(I) w
  float moved[4], turned[4];   // since the start of the step: m, and the rotation vector in rad
};

// The part of a body that stays over a step.
struct alignas(32) SolvedMass {
  float root_inertia[6];  // inverse square root of the inertia tensor, world axes: xx, yy, zz, xy, xz, yz
  float inverse_root_mass;
  float unused;
};

// Velocities of a body at the start of the last substep.
struct alignas(32) SolvedMemory {
  float velocity[4], spin[4];
};

struct alignas(32) SolvedKick {
  float velocity[4], spin[4];  // changes by accelerations over one substep, mass-normalised
};

enum class Tangent : std::uint8_t { kNone, kFriction, kRolling };

// A contact names a body by its index times this, which is where the body's state begins in units of 8 bytes: loads
// scale by 8 themselves, and every other factor is an instruction more for each body.
inline constexpr std::int32_t kStateUnits = sizeof(SolvedState) / 8;

struct ContactHead {
  std::int32_t a[kLanes], b[kLanes];  // bodies, in units of 8 bytes
  Lanes normal[3];
  Lanes inverse_root_mass_a, inverse_root_mass_b;
  Lanes offset[3];         // from the centre of a to that of b
  Lanes slop;              // overlap at rest, m
  Lanes round_a, round_b;  // radii about which the surfaces bend at the contact, m
  Lanes soft_mass, soft_impulse, bias_rate;
  Lanes restitution;  // 0: relaxing acts across a gap
};

struct PointLanes {
  Lanes r_a[3];
  Lanes angular_a[3], angular_b[3];  // mass-normalised
  Lanes separation;                  // now
  Lanes start_separation;            // at the start of the step
  Lanes mass;                        // effective; 0 where there is no point
  Lanes impulse, total;
};

struct FrictionLanes {
  Lanes coefficient;
  Lanes impact;  // impulse of this substep's impacts, which friction may lean on too
  Lanes tangent[2][3];
  Lanes angular_a[2][3], angular_b[2][3];
  Lanes inverse[3];  // inverse of the 2 x 2 matrix: 11, 22, 12
  Lanes slide_mass;  // inverse of its larger eigenvalue
  Lanes impulse[2], total[2];
};

// Friction against turning about the normal.
template <int kPoints>
struct TwistLanes {
  Lanes angular_a[3], angular_b[3];
  Lanes mass;
  Lanes arm[kPoints];  // friction times the distance from the middle, plus the coefficient of spinning
  Lanes impulse, total;
};

struct RollingLanes {
  Lanes coefficient;
  Lanes angular_a[2][3], angular_b[2][3];
  Lanes inverse[3], slide_mass;
  Lanes impulse[2], total[2];
};

// Correction of lever arms. Impulses act, all step long, where the contact was at its start, though the bodies have
// moved against each other since; that makes angular momentum of both bodies together, which is taken back in the end.
struct LeverArmLanes {
  Lanes apart[3];  // how far b had moved against a before this substep
  Lanes made[3];   // angular momentum that came of it so far
};

struct NoLanes {};

template <int kPoints, Tangent kTangent>
struct ContactBlock {
  static constexpr int kPointCount = kPoints;
  static constexpr bool kHasFriction = kTangent != Tangent::kNone;
  static constexpr bool kHasTwist = kTangent == Tangent::kRolling || (kHasFriction && kPoints > 1);
  static constexpr bool kHasRolling = kTangent == Tangent::kRolling;
  static constexpr int kCouplings = kPoints * (kPoints + 1) / 2;

  ContactHead head;
  PointLanes points[kPoints];
  Lanes weight[kPoints];       // share of each point in the middle where friction acts; they sum to 1
  Lanes coupling[kCouplings];  // velocity at point j for an impulse of 1 at point i <= j
  [[no_unique_address]] std::conditional_t<kHasFriction, FrictionLanes, NoLanes> friction;
  [[no_unique_address]] std::conditional_t<kHasTwist, TwistLanes<kPoints>, NoLanes> twist;
  [[no_unique_address]] std::conditional_t<kHasRolling, RollingLanes, NoLanes> rolling;
  LeverArmLanes lever_arm;
};

inline constexpr int kPointKinds = 3;  // 1, 2 or 4 points
inline constexpr int kContactKinds = 3 * kPointKinds;
inline constexpr int kKindPoints[kContactKinds] = {1, 2, 4, 1, 2, 4, 1, 2, 4};

struct StepConstants {
  float h, inverse_h;
  float push_out_m_s;  // fastest way out of an overlap
};

struct SolvedBodies {
  SolvedState* states;
  const SolvedMass* masses;
};

// Works on `count` blocks of one kind.
using ContactKernel = void (*)(void* blocks, std::size_t count, SolvedBodies bodies, const StepConstants& step);

// Writes to `lanes`, a bit each, which lanes hold a contact that approaches faster than `speed` at any point. Forgets
// the impacts of the last substep.
using ApproachKernel = void (*)(void* blocks, std::size_t count, const SolvedState* states, float speed,
                                std::uint8_t* lanes);

struct ContactKernels {
  ContactKernel prepare;  // computes rows and effective masses from normals, points and impulses
  ContactKernel warm;     // applies the impulses at hand
  ContactKernel solve;    // a sweep with bias
  ContactKernel relax;    // measures separations anew, a sweep without bias
  ContactKernel settle;   // another sweep without bias, adds to the totals
  ContactKernel locate;   // measures separations anew after bounces have moved bodies, and notes where those are
  ApproachKernel approach;
};

struct Kernels {
  ContactKernels contacts[kContactKinds];
  void (*drift)(SolvedState* states, const SolvedMass* masses, std::size_t count, float h);
};

const Kernels& KernelsSse2();
const Kernels& KernelsAvx2();

}  // namespace tessera::physics
