// Substeps: how many an island needs, from what its last step showed, and who gives way when all together ask too much.
//
// A contact in n substeps is a spring that carries what lies on it with a give of g / w^2, w ~ n / dt; a tower of N is
// then a column that buckles when N^3 exceeds its stiffness. So loads grow as n^(2/3). Measured: 2 substeps hold 15
// unit cubes, 4 hold 24, 8 hold 38, 16 hold 60, 32 hold 96. A chain with a heavy end is a string under tension, and
// asks for half the root of its mass ratio. Counts are powers of two and change by one power a step, so one blow
// changes little.
//
// Thread rule: free functions, none.
#pragma once

#include <cstdint>
#include <span>

namespace tessera::physics {

inline constexpr int kMaxSubsteps = 64;

struct IslandDemand {
  int last = 0;             // substeps of its last step; 0: it is new
  float load_ratio = 0;     // largest impulse of a contact in the last step over what the lighter body weighs in one
  float mass_ratio = 1;     // largest, of two that touch or are jointed
  float penetration_m = 0;  // deepest
  float joint_error_m = 0;  // widest gap
  float impact_m_s = 0;     // fastest approach
  int contacts = 0, joints = 0;
};

// A power of two from 1 to kMaxSubsteps.
int SubstepsFor(const IslandDemand& demand);

struct IslandWork {
  int contacts = 0, joints = 0;
  int substeps = 1;  // in: wanted; out: granted
};

// Halves the substeps of whichever island costs the most until all together are within the budget, or none has more
// than kFewestSubsteps. `budget`: in solved contacts times substeps; a joint counts for kJointWork.
void KeepBudget(std::span<IslandWork> islands, std::int64_t budget);

}  // namespace tessera::physics
