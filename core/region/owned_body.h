// OwnedBody: a dynamic body that a region owns, as it is after the last step.
#pragma once

#include <algorithm>
#include <span>

#include "core/world/ids.h"
#include "core/world/scene.h"

namespace tessera::region {

struct OwnedBody {
  const BodyDef* def = nullptr;
  Epoch epoch;
  BodyState state;
  double gravity_scale = 1;  // the definition's, or what a game made of it
};

// The players' bodies among bodies that ascend; `id_of` gives the id of one.
template <class List, class IdOf>
auto PlayersAmong(const List& bodies, const IdOf& id_of) {
  const auto first = std::ranges::lower_bound(bodies, BodyId(kFirstPlayerBody), {}, id_of);
  const auto last = std::ranges::lower_bound(first, std::ranges::end(bodies), BodyId(2 * kFirstPlayerBody), {}, id_of);
  return std::span(first, last);
}
inline std::span<const OwnedBody> PlayersAmong(std::span<const OwnedBody> owned) {
  return PlayersAmong(owned, [](const OwnedBody& body) { return body.def->id; });
}

}  // namespace tessera::region
