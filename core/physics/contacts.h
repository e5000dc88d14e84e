// Contacts and pair events of a step, read from what Bullet found and solved.
#pragma once

#include <span>
#include <vector>

#include "core/physics/bullet_world.h"
#include "core/physics/world.h"

namespace tessera::physics {

// One entry a pair, ascending by ids. `origin`: of Bullet's coordinates.
void SummarizeContacts(std::span<const Touch> solved, std::span<const ManifoldImpulse> impulses, Vec3d origin,
                       std::vector<Contact>* out);

// Remembers which pairs touch, and says what changed.
class PairWatch {
 public:
  // `touches`: all manifolds with points, ascending by ids.
  void Update(std::span<const Touch> touches, std::vector<PairEvent>* events);
  bool empty() const { return touching_.empty(); }

 private:
  struct Pair {
    BodyId low, high;
    bool trigger = false;
  };
  static bool Before(const Pair& a, const Pair& b);

  std::vector<Pair> touching_, next_;  // ascending
};

}  // namespace tessera::physics
