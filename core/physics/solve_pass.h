// SolvePass: how the bodies of each solved island move, by what contacts and joints do to them.
//
// Thread rule: one thread at a time, which leads the team.
#pragma once

#include <span>
#include <vector>

#include "core/physics/motion/body_motion.h"
#include "core/physics/solve_batches.h"

namespace tessera::physics {

class SolvePass {
 public:
  // `portable`: solve with what every processor has, rather than with the widest that this one has; the bits are the
  // same.
  explicit SolvePass(bool portable, ThreadTeam& team = ThreadTeam::Alone())
      : team_(team), solver_(portable ? SimdPath::kSse2 : SimdPath::kBest, team) {}

  // Solves all islands. The impulses go to the manifolds and the joints, and are where the next solve starts.
  void Solve(const SolveInput& in);
  // Writes the motions, by awake_index, of the bodies that `Solve` has solved.
  void ReadBack(const SolveInput& in, std::span<BodyMotion> motions);

  // For assertions; linear.
  bool Validate(const SolveInput& in) const { return batches_.Validate(in); }

 private:
  // Sums of the impulses that contacts gave a body over the step.
  struct Gain {
    Vec3d momentum, angular_momentum;
  };
  void SumGains(const SolveInput& in, const IslandBatch& batch);
  // `midway`: as in IslandBatch. `gain`: of a body of an unanchored island; null for others.
  static BodyMotion MotionOf(const RigidBody& body, const SolverBody& out, const Quatd& midway, const Gain* gain,
                             double dt_s);

  ThreadTeam& team_;
  SolveBatches batches_;
  Solver solver_;
  std::vector<Gain> gains_;  // by body of the batch at hand, where its island is unanchored
};

}  // namespace tessera::physics
