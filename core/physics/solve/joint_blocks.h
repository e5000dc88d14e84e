// JointBlocks: the joints of a batch, ready to be solved substep by substep.
//
// The locked rows of a joint are made orthonormal in mass-normalised space (J' J'^T = L L^T, rows L^-1 J'), so that
// solving them one after the other solves them all at once, exactly. A row that the others already imply drops out.
// Springs, motors and limits come before them, each by itself. Locked rows of connected joints are solved together
// (joint_forest.h).
//
// Thread rule: one thread at a time.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/physics/solve/coloring.h"
#include "core/physics/solve/contact_blocks.h"
#include "core/physics/solve/joint_block.h"
#include "core/physics/solve/joint_forest.h"
#include "core/physics/solve/kernel.h"

namespace tessera::physics {

class JointBlocks {
 public:
  void Fill(std::span<const JointConstraint> joints, const Coloring& coloring, const SolvedState* states,
            const SolvedMass* masses, std::uint32_t nobody, float h);
  void Warm(SolvedState* states) const;
  // Turns the rows along with the bodies, and with them the impulses that the next substep starts with: those of the
  // last one, by which `states` differ from `before`.
  void Turn(SolvedState* states, const SolvedMass* masses, SolvedMemory* before, float h);
  // Solves all joints once, with bias or, to relax, without.
  void Solve(SolvedState* states, const SolvedMass* masses, const StepConstants& step, bool relax);
  void Store(std::span<const JointConstraint> joints);

  bool empty() const { return blocks_.empty(); }

 private:
  void Rejoin(SolvedState* states, const SolvedMass* masses, float h);
  void SolveForest(SolvedState* states, const SolvedMass* masses, const StepConstants& step, bool relax);

  std::vector<JointBlock> blocks_;
  std::vector<std::uint32_t> joint_of_;  // joint, by block
  std::vector<std::uint32_t> order_;     // block, by joint
  JointForest forest_;
  Softness softness_;
};

}  // namespace tessera::physics
