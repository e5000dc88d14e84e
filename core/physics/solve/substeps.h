// Substeps: how many an island needs, from its demand, and which islands give way when all together ask too much.
//
// A contact in n substeps is a spring that carries its load with a give of g / w^2, w ~ n / dt; a tower of N is then a
// column that buckles when N^3 exceeds its stiffness. So the loads that substeps carry grow as n^(2/3). Measured: 2
// substeps hold 15 unit cubes, 4 hold 24, 8 hold 38, 16 hold 60, 32 hold 96. A chain with a heavy end is a string under
// tension, and asks for half the root of its mass ratio. Counts are powers of two and change by one power a step, so
// one blow changes little.
//
// Thread rule: free functions without state.
#pragma once

#include <cstdint>
#include <span>

namespace tessera::physics {

inline constexpr int kMaxSubsteps = 64;

struct IslandDemand {
  int last = 0;             // substeps of the island's last step; 0: it is new
  float load_ratio = 0;     // largest impulse of a contact in a step over the weight of the lighter body times the step
  float mass_ratio = 1;     // largest of two bodies that touch or are jointed
  float penetration_m = 0;  // deepest
  float joint_error_m = 0;  // widest gap
  float impact_m_s = 0;     // fastest approach
  int contacts = 0, joints = 0;
};

// Substeps for an island: a power of two from 1 to kMaxSubsteps.
int SubstepsFor(const IslandDemand& demand);

struct IslandWork {
  int contacts = 0, joints = 0;
  int substeps = 1;  // in: wanted; out: granted
};

// Halves the substeps of the island that costs the most until all together are within the budget, or none has more than
// 1 << kFewestLevel. The budget is in solved contacts times substeps; a joint counts for kJointWork contacts.
void KeepBudget(std::span<IslandWork> islands, std::int64_t budget);

}  // namespace tessera::physics
