// DepartingBody: a body whose handover was decided in the last step. It is the neighbour's from the next step on.
#pragma once

#include <algorithm>
#include <span>

#include "core/region/frame.h"

namespace tessera::region {

struct DepartingBody {
  GhostRecord record;  // its epoch is that of the new ownership
  RegionId to;
};

// `departing` ascends by body. Null if the body is not among them.
inline const DepartingBody* FindDeparting(std::span<const DepartingBody> departing, BodyId id) {
  const auto at = std::ranges::lower_bound(departing, id, {}, [](const DepartingBody& body) { return body.record.id; });
  return at != departing.end() && at->record.id == id ? &*at : nullptr;
}

inline bool DepartsTo(std::span<const DepartingBody> departing, BodyId id, RegionId to) {
  const DepartingBody* body = FindDeparting(departing, id);
  return body != nullptr && body->to == to;
}

}  // namespace tessera::region
