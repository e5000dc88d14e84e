// Neighborhood: the map that is in force for a region, and its neighbours by that map.
//
// Promise: neighbours ascend. Whoever gets a body now is still a neighbour when it acknowledges it: from the
// announcement of a map on, only those that stay neighbours by it are grantable. Thread rule: one thread at a time.
#pragma once

#include <span>
#include <vector>

#include "core/world/partition_map.h"

namespace tessera::region {

class Neighborhood {
 public:
  Neighborhood(RegionId self, PartitionMap map);

  RegionId self() const { return self_; }
  const PartitionMap& map() const { return map_; }
  std::span<const RegionId> neighbors() const { return neighbors_; }
  std::size_t size() const { return neighbors_.size(); }
  RegionId operator[](std::size_t neighbor) const { return neighbors_[neighbor]; }
  // Index among the neighbours, or -1.
  std::ptrdiff_t IndexOf(RegionId id) const;
  // Neighbours that bodies may be granted to, ascending.
  std::span<const RegionId> grantable() const { return grantable_; }

  // Another map may come into force.
  void Announce(const PartitionMap& next);
  // Another map is in force.
  void Adopt(PartitionMap map);

  void Validate() const;

 private:
  const RegionId self_;
  PartitionMap map_;
  std::vector<RegionId> neighbors_, grantable_;
};

}  // namespace tessera::region
