// ActiveContact: a pair with manifolds, as the passes after the narrow phase see it.
//
// Pairs lie all over the memory, and most passes look at all of them; so the narrow phase copies what they read side by
// side while the pair is in the cache.
#pragma once

#include <cstdint>

#include "core/physics/collide/manifold.h"

namespace tessera::physics {

struct Pair;

inline constexpr std::uint32_t kAsleep = 0xffffffff;  // in place of an awake_index: a body that is static or sleeps

struct ActiveContact {
  Pair* pair;
  std::uint32_t low, high;          // awake_index, or kAsleep; at least one is awake
  std::uint32_t low_tag, high_tag;  // see World::SetTag
  Manifold* manifolds;
  std::uint32_t count;              // number of manifolds
  int substeps;                     // The pair's last solve had so many; the solve pass replaces it by its own.
  bool responds, live;              // as in Pair
  bool driven;                      // one of the two is kinematic and under way
  std::uint8_t points;              // points of the first manifold; 0: not counted
  float penetration_m, impact_m_s;  // deepest overlap and fastest approach of its points, if it is live
  float load_ns, inner_m, slop_m;   // as in Pair
  Vec3f normal;                     // normal of the first manifold
  PairMaterial material;

  bool both() const { return low != kAsleep && high != kAsleep; }
  // awake_index of one that is awake.
  std::uint32_t one() const { return low != kAsleep ? low : high; }
};

}  // namespace tessera::physics
