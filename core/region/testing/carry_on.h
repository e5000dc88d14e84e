// CarryOn: a region dies, and its heir goes on with the copy that its standby had; for tests with two regions.
//
//   ASSERT_TRUE(CarryOn(*one, RegionId(2), copy, {BodyId(4)}).ok());
#pragma once

#include <vector>

#include "absl/status/statusor.h"
#include "core/region/region.h"
#include "core/region/resolve.h"
#include "core/region/standby_copy.h"
#include "core/world/partition_change.h"

namespace tessera::region {

// `expected`: the bodies that the world should have, ascending. The result tells which of them are lost. Errors are
// those that the steps of a failover give.
inline absl::StatusOr<Resolution> CarryOn(Region& heir, RegionId dead, const StandbyCopy& copy,
                                          const std::vector<BodyId>& expected = {}) {
  const auto map = FailoverMap(heir.map(), std::vector{dead}, MapVersion(heir.map().version().value() + 1));
  if (!map.ok()) return map.status();
  const StandbyCopy* const primaries[] = {&copy};
  const auto inventory = heir.BeginFailover(*map, primaries);
  if (!inventory.ok()) return inventory.status();
  auto resolution = Resolve(*map, std::vector{dead}, std::vector{*inventory}, expected);
  if (!resolution.ok()) return resolution.status();
  const auto resumed = heir.Resume(*resolution, primaries);
  if (!resumed.ok()) return resumed.status();
  return resolution;
}

}  // namespace tessera::region
