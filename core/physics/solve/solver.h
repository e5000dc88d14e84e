// Solver: soft contacts and joints of bodies that touch, in small substeps.
//
// Each substep applies forces, warm starts, solves with bias, moves, and relaxes without bias (Catto, Solver2D "soft
// step"). Restitution acts once per impact. Contacts are coloured so that no two of a colour share a moving body, and
// solved eight at a time; which lane or path (SSE2, AVX2) does the work changes no bit. The colour of a constraint
// depends only on the constraints that it is connected to and their order, so an island comes out the same in any
// company. A team of threads shares the contacts of each colour, and that changes no bit either.
//
// Velocities inside are mass-normalised: v' = sqrt(m) v, w' = sqrt(I) w. Then a row is one vector for measuring and for
// applying, a static body is a row of zeros, and rows of a joint can be made orthogonal, which solves them as one
// block.
//
// Thread rule: one thread at a time, which leads the team.
#pragma once

#include <memory>
#include <span>

#include "core/physics/collide/manifold.h"
#include "core/physics/linear.h"
#include "core/physics/solve/rows.h"
#include "core/physics/solve/tuning.h"
#include "core/physics/thread_team.h"

namespace tessera::physics {

// A body that is solved. Static ones (inverse_mass 0) are not listed; constraints name them by kStatic.
struct SolverBody {
  // --- In.
  Vec3f velocity, angular_velocity;  // at the start of the step; out: at its end
  Vec3f acceleration;                // by gravity and forces, m/s^2, constant over the step
  Vec3f angular_acceleration;        // by torques, rad/s^2
  float mass_kg = 1;
  Vec3f inertia_kg_m2;  // principal
  Mat3f rotation;       // turns the principal axes
  // --- Out.
  Vec3f moved_m, turned_rad;  // over the step: displacement and rotation vector, world axes
  Vec3f angular_impulse_nms;  // change of angular momentum by constraints and torques
};

inline constexpr std::uint32_t kStatic = 0xffffffff;

struct ContactConstraint {
  std::uint32_t a = kStatic, b = kStatic;  // in `bodies`; at most one is kStatic
  Manifold* manifold = nullptr;            // in: warm impulses; out: impulses, totals
  PairMaterial material;
  float slop_m = kSlop_m;   // overlap at rest
  float warm_scale = 1;     // factor of the warm impulses: substeps of the last step over those of this one
  bool driven = false;      // one of the two is so heavy that it does not count what it is given
  bool bears = false;       // it bears far more than its bodies weigh: it is rigid, and solved with others that do
  std::uint8_t points = 0;  // those of the manifold, where the caller has their number at hand; 0: it is looked up
};

struct JointConstraint {
  std::uint32_t a = kStatic, b = kStatic;
  JointRows* rows = nullptr;
  float* impulses = nullptr;  // kJointSlots impulses: in, warm ones; out, those of the last substep
  float warm_scale = 1;       // as in ContactConstraint
};

// Any number of islands that are solved with the same number of substeps. Constraints ascend by the ids of their
// bodies.
struct SolveBatch {
  std::span<SolverBody> bodies;
  std::span<const ContactConstraint> contacts;
  std::span<const JointConstraint> joints;
  int substeps = 4;
  float dt_s = 1.0f / 60;
  bool bears = false;  // one of the contacts does
};

enum class SimdPath { kBest, kSse2, kAvx2 };

class Solver {
 public:
  explicit Solver(SimdPath path = SimdPath::kBest, ThreadTeam& team = ThreadTeam::Alone());
  ~Solver();
  void Solve(const SolveBatch& batch);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace tessera::physics
