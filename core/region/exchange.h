// Exchange: momentum across a border.
//
// Both owners of a touching pair solved the contact, each in its own world: a's owner found the impulses S (on a and on
// b), b's owner found S'. Each keeps its own body's result, so S on a and -S' on b do not balance. One tick later both
// know both, and each makes up its share: both bodies end with (1 - w) S + w S', where w = m_a / (m_a + m_b). Either
// solution balances in itself, linear and angular, so the blend does, and momentum is exact.
//
// Thread rule: free functions on values.
#pragma once

#include <functional>
#include <span>
#include <vector>

#include "core/region/frame.h"

namespace tessera::region {

// One owner's solution of a pair's contact in the last step; a < b.
struct Solution {
  BodyId a, b;
  bool by_owner_of_a = false;
  Vec3f impulse_on_b;  // N s; a received the opposite
  Vec3f angular_on_a, angular_on_b;
  RegionId owner_of_a{}, owner_of_b{};  // then; 0: not told here
};

Solution ToSolution(const ImpulseRecord& record);

// What each body of a pair is to receive now.
struct PairCorrection {
  BodyId a, b;
  Vec3d impulse_on_a, impulse_on_b;  // N s
  Vec3d angular_on_a, angular_on_b;  // about each one's centre of mass, N m s
  RegionId owner_of_a{}, owner_of_b{};
};

// Pairs ascending by (a, b). `solutions` in any order, at most one a side: a side that is missing found no contact.
// Both owners compute the same bits.
std::vector<PairCorrection> CorrectionsOf(std::vector<Solution> solutions,
                                          const std::function<double(BodyId)>& mass_of);

}  // namespace tessera::region
