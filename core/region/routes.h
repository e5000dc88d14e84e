// Routes: ways between regions along the neighbours of a partition map.
//
// Distances are found when they are first asked for, by breadth-first search, and kept until another map comes.
// Thread rule: one thread at a time.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include "absl/functional/function_ref.h"
#include "core/world/partition_map.h"

namespace tessera::region {

class Routes {
 public:
  // Goes by this map from now on; the same one again changes nothing.
  void Adopt(const PartitionMap& map);
  // Borders between two regions; none if there is no way.
  std::optional<std::uint32_t> Distance(RegionId from, RegionId to);
  // The neighbour of `self` that is nearest to `to`, of those that `up` allows; the lowest id on a tie. RegionId():
  // none leads there.
  RegionId NextHop(RegionId self, RegionId to, absl::FunctionRef<bool(RegionId)> up);

 private:
  using Distances = std::map<RegionId, std::uint32_t>;
  const Distances& From(RegionId root);

  std::optional<MapVersion> version_;
  std::map<RegionId, std::vector<RegionId>> neighbors_;
  std::map<RegionId, Distances> from_;
};

}  // namespace tessera::region
