// Reach: which neighbours must see an owned body: those into whose cells its predicted swept bounds, grown by the aura,
// reach.
//
// A body well inside its own cell is told apart by one look at the map. Thread rule: one thread at a time.
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "core/physics/prediction.h"
#include "core/region/settings.h"
#include "core/world/partition_map.h"

namespace tessera::region {

class Reach {
 public:
  Reach(const PartitionMap& map, RegionId self, std::span<const RegionId> neighbors, const Settings& settings,
        double tick_s);

  // The map has changed in place; with it the neighbours.
  void SetNeighbors(std::span<const RegionId> neighbors) { neighbors_ = neighbors; }
  // Starts over for `bodies` bodies, none of which reaches anyone.
  void Clear(std::size_t bodies);
  // Marks whom the body reaches. False if it is so far inside its cell that nothing had to be predicted.
  bool Look(std::size_t body, const BodyDef& def, const BodyState& state, const physics::Forces& forces,
            double radius_m);
  void Show(std::size_t body, std::size_t neighbor) { seen_[body * neighbors_.size() + neighbor] = 1; }
  bool Shows(std::size_t body, std::size_t neighbor) const { return seen_[body * neighbors_.size() + neighbor] != 0; }
  bool ShowsAny(std::size_t body) const {
    const auto first = seen_.begin() + static_cast<std::ptrdiff_t>(body * neighbors_.size());
    return std::find(first, first + static_cast<std::ptrdiff_t>(neighbors_.size()), 1) !=
           first + static_cast<std::ptrdiff_t>(neighbors_.size());
  }
  // Whether both are shown to the same neighbours.
  bool ShowsAlike(std::size_t a, std::size_t b) const {
    const std::size_t count = neighbors_.size();
    const auto first = seen_.begin();
    return std::equal(first + static_cast<std::ptrdiff_t>(a * count),
                      first + static_cast<std::ptrdiff_t>((a + 1) * count),
                      first + static_cast<std::ptrdiff_t>(b * count));
  }
  bool ShowsAnything() const { return std::find(seen_.begin(), seen_.end(), 1) != seen_.end(); }
  // What one of these bodies is shown to, all are.
  void Unite(std::span<const std::size_t> bodies);

 private:
  const PartitionMap& map_;
  const RegionId self_;
  std::span<const RegionId> neighbors_;
  const double aura_m_, horizon_s_;
  std::vector<std::uint8_t> seen_;  // bodies by neighbours
};

}  // namespace tessera::region
