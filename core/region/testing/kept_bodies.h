// Bodies that a region granted and keeps copies of, because their new owners have not acknowledged them yet. For tests.
#pragma once

#include <vector>

#include "core/region/log.h"
#include "core/region/region.h"

namespace tessera::region {

inline std::vector<BodyId> KeptBodies(const Region& region) {
  const absl::StatusOr<RegionState> state = DecodeState(region.SaveState(), region.catalog());
  std::vector<BodyId> kept;
  for (const auto& [key, grant] : state->grants) kept.push_back(key.first);
  return kept;
}

}  // namespace tessera::region
