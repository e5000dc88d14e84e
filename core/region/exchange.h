// Exchange: momentum across a border.
//
// Both owners of a touching pair solved the contact, each in its own world: a's owner found the impulses S (on a and on
// b), b's owner found S'. Each keeps its own body's result, so S on a and -S' on b do not balance. One tick later both
// know both, and each makes up its share: both bodies end with (1 - w) S + w S', where w = m_a / (m_a + m_b). Either
// solution balances in itself, linear and angular, so the blend does, and momentum is exact.
//
// Thread rule: free functions on values.
#pragma once

#include <tuple>
#include <vector>

#include "core/region/frame.h"

namespace tessera::region {

// One owner's solution of a pair's contact in the last step; a < b.
struct Solution {
  BodyId a, b;
  bool by_owner_of_a = false;
  Vec3f impulse_on_b;  // N s; a received the opposite
  Vec3f angular_on_a, angular_on_b;
  RegionId reporter{};  // region that found it; 0: this one
  RegionId other{};     // if this region found it: the owner of the other body
};

Solution ToSolution(const ImpulseRecord& record);

// Whether one comes before the other: ascending by (a, b), which is the order of a frame's impulses.
inline bool Before(const Solution& x, const Solution& y) { return std::tie(x.a, x.b) < std::tie(y.a, y.b); }

// The impulses that each body of a pair is to receive now.
struct PairCorrection {
  Vec3d impulse_on_a, impulse_on_b;  // N s
  Vec3d angular_on_a, angular_on_b;  // about each one's centre of mass, N m s
};

// The correction that follows from both owners' solutions; null means that this owner found no contact. Masses in kg,
// above 0. Both owners compute the same bits.
PairCorrection CorrectionOf(const Solution* of_a, const Solution* of_b, double mass_a, double mass_b);

}  // namespace tessera::region
