// Tombstones: bodies that were removed for good, so that no copy of them is promoted.
//
// A body that came from a neighbour may have copies elsewhere for a while: the granter keeps one until it hears the
// acknowledgement, and the granter's standby until it hears of that. Should a region die meanwhile, such a copy would
// bring the body back. So a removed body leaves its id and last epoch here, and in the log: in a failover they outrank
// every copy that is not of a higher epoch. They are forgotten once copies cannot be left; those of the scene's own
// bodies stay, because they also tell that nobody has lost them.
//
// Thread rule: one thread at a time.
#pragma once

#include <deque>
#include <map>
#include <span>
#include <utility>
#include <vector>

#include "core/region/body_claim.h"

namespace tessera::region {

class Tombstones {
 public:
  // A body that ceased to be in the step to `now`, under the epoch that it had.
  void Add(BodyId id, Epoch epoch, Tick now);
  // Those that a dead region, or an earlier life of this one, had; `now` is this region's tick.
  void Merge(std::span<const BodyClaim> others, Tick now);
  // Forgets those that have been here long enough. Costs nothing for the others.
  void Forget(Tick now, std::uint32_t tick_rate_hz);

  // Whether it was removed, as far as this region knows.
  bool Has(BodyId id) const { return entries_.contains(id); }
  // Ascending, each body once.
  std::vector<BodyClaim> All() const;
  // Those of the scene's bodies that were removed by `tick`, ascending.
  std::vector<BodyId> SceneBodies(Tick tick) const;

 private:
  struct Entry {
    Epoch epoch;
    Tick since;
  };
  std::map<BodyId, Entry> entries_;
  std::deque<std::pair<Tick, BodyId>> to_forget_;  // those that are not of the scene, in the order in which they came
};

}  // namespace tessera::region
