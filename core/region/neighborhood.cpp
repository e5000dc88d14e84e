#include "core/region/neighborhood.h"

#include <algorithm>
#include <cassert>
#include <iterator>
#include <utility>

namespace tessera::region {

Neighborhood::Neighborhood(RegionId self, PartitionMap map) : self_(self) { Adopt(std::move(map)); }

std::ptrdiff_t Neighborhood::IndexOf(RegionId id) const {
  const auto it = std::lower_bound(neighbors_.begin(), neighbors_.end(), id);
  return it != neighbors_.end() && *it == id ? it - neighbors_.begin() : -1;
}

void Neighborhood::Announce(const PartitionMap& next) {
  const std::vector<RegionId> then = next.Neighbors(self_);
  grantable_.clear();
  std::set_intersection(neighbors_.begin(), neighbors_.end(), then.begin(), then.end(), std::back_inserter(grantable_));
}

void Neighborhood::Adopt(PartitionMap map) {
  map_ = std::move(map);
  neighbors_ = map_.Neighbors(self_);
  grantable_ = neighbors_;
}

void Neighborhood::Validate() const {
  assert(std::is_sorted(neighbors_.begin(), neighbors_.end()));
  assert(IndexOf(self_) < 0);
  assert(std::includes(neighbors_.begin(), neighbors_.end(), grantable_.begin(), grantable_.end()));
}

}  // namespace tessera::region
