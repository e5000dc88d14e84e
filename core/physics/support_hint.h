// SupportHint and ExclusionGroup: facts about a body that cannot be seen in its world. A caller knows how the body is
// supported by bodies outside, and which contacts are accounted for there.
#pragma once

#include <cstdint>

namespace tessera::physics {

// The support of a body by bodies outside the world. It changes what the loads pass takes a body to weigh upon another,
// and so the number of substeps; it applies no force.
struct SupportHint {
  // Forces on the body stand for bodies outside the world that it rests on or carries. What it presses with is then
  // taken from the impulses of its contacts, not from the weight of the bodies that are seen to stand on it.
  bool external = false;
  // Island load (World::IslandLoadOf) of the part of its island that is outside the world. The part in the world gets
  // no fewer substeps than that load needs.
  float island_load = 0;
};

// A filter of contacts: two bodies of one group do not touch each other, except that triggers still report them.
enum class ExclusionGroup : std::uint8_t {
  kNone = 0,  // The body touches everything.
};

constexpr bool Excludes(ExclusionGroup a, ExclusionGroup b) { return a != ExclusionGroup::kNone && a == b; }

}  // namespace tessera::physics
