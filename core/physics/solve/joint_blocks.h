// JointBlocks: the joints of a batch, ready to be solved substep by substep.
//
// The locked rows of a joint are made orthonormal in mass-normalised space (J' J'^T = L L^T, rows L^-1 J'), so that
// solving them one after the other solves them all at once, exactly. A row that the others already imply drops out.
// Springs, motors and limits come before them, each by itself.
//
// Thread rule: one thread at a time.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/physics/solve/coloring.h"
#include "core/physics/solve/contact_blocks.h"
#include "core/physics/solve/kernel.h"

namespace tessera::physics {

// A row as it is solved.
struct JointRow {
  Vec3f linear_a, angular_a, linear_b, angular_b;  // mass-normalised, with signs
  Vec3f linear;                                    // in m/s
  RowKind kind = RowKind::kLocked;
  std::uint8_t origin = 0;  // which of the joint's rows
  float error = 0;          // now
  float relax_error = 0;    // of a spring: at the start of the substep, where the force that is relaxed belongs
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
  std::array<JointRow, kJointRows> rows;                            // locked ones first
  std::array<std::array<float, kLockedRows>, kLockedRows> lower{};  // L
  std::array<float, kJointRows> impulses{};  // along the joint's own rows, while those are made anew
};

class JointBlocks {
 public:
  void Fill(std::span<const JointConstraint> joints, const Coloring& coloring, const SolvedState* states,
            const SolvedMass* masses, std::uint32_t nobody, float h);
  void Warm(SolvedState* states) const;
  // Turns the rows along with the bodies, and with them the impulses that the next substep starts with: those of the
  // last one, which are what `states` have beyond `before`.
  void Turn(const SolvedState* states, const SolvedMass* masses, SolvedMemory* before, float h);
  // The joints of a color: once, with or without bias.
  void Solve(std::size_t color, SolvedState* states, const SolvedMass* masses, const StepConstants& step, bool relax);
  void Store(std::span<const JointConstraint> joints);

  bool empty() const { return blocks_.empty(); }

 private:
  std::vector<JointBlock> blocks_;
  std::vector<std::uint32_t> joint_of_;  // by block
  std::vector<std::uint32_t> starts_;    // by color, the left over ones last
  Softness softness_;
};

}  // namespace tessera::physics
