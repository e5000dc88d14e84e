// Reports of a step about pairs of bodies: contacts with their impulses, and pairs that began or ceased to touch.
#pragma once

#include <cstdint>

#include "core/world/ids.h"
#include "core/world/math.h"

namespace tessera::physics {

// The tag of a body that nobody has given one (World::SetTag).
inline constexpr std::uint32_t kNoTag = 0xffffffff;

// The impulse between two touching bodies in the last step: the sum of normal, lateral, rolling and spinning
// impulses over their contact points, and the impulses that two bodies got because continuous collision stopped one at
// the other. body_a < body_b. Pairs that slept at the start of the step, and pairs with a trigger, have none.
struct PairImpulse {
  BodyId body_a, body_b;
  std::uint32_t tag_a = kNoTag, tag_b = kNoTag;      // see World::SetTag
  Vec3f impulse_on_b;                                // N s; a received the opposite
  Vec3f angular_impulse_on_a, angular_impulse_on_b;  // about each body's own centre of mass, N m s
};

// The same with a place. A pair that only continuous collision stopped has the centre of a as its point, and no depth.
struct Contact : PairImpulse {
  Vec3d point;        // mean of the contact points, world space, m
  Vec3f normal;       // from a to b, unit; 0 where there is no point
  float depth_m = 0;  // deepest point; negative while apart
};

// A pair that began or ceased to touch, or to overlap where one of the two is a trigger. body_a < body_b. A pair
// touches from a distance of 0 until it is 5 mm apart. Falling asleep ends nothing; removing a body ends its pairs in
// the next step.
struct PairEvent {
  BodyId body_a, body_b;
  bool trigger = false;
  bool begin = false;
  friend bool operator==(const PairEvent&, const PairEvent&) = default;
};

}  // namespace tessera::physics
