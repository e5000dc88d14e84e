// NeighbourWatch: the neighbours that a region stops waiting for because nothing comes from them.
//
// A region that waits says every kInterval that it is well, so only one that says nothing at all is silent; nobody
// waits for it after kSilence. But regions may wait for each other in a circle: after kStuck nobody is waited for any
// more.
//
//   if (watch.Due(now, last_step)) {
//     say to all neighbours that this region is well;
//     for (const SilentNeighbour& silent : watch.Look(region.WaitingFor(), links, now))
//     region.TakeLinkDown(silent.region);
//   }
//   after each step: watch.Stepped();
//
// Thread rule: none of its own. Time is passed in, never read.
#pragma once

#include <map>
#include <span>
#include <vector>

#include "core/world/ids.h"
#include "region_worker/core/link_table.h"
#include "region_worker/core/time.h"

namespace tessera::worker {

struct SilentNeighbour {
  RegionId region;
  Duration silent{0};
};

class NeighbourWatch {
 public:
  static constexpr Duration kInterval = std::chrono::milliseconds(50);
  static constexpr Duration kSilence = std::chrono::milliseconds(250);
  static constexpr Duration kStuck = std::chrono::seconds(1);
  static constexpr int kStuckTicks = 3;

  // While no step was made for kInterval, once every kInterval.
  bool Due(TimePoint now, TimePoint last_step) const { return now >= next_look_ && now - last_step >= kInterval; }
  // Those of `waited_for` that are silent. After a look that came late nobody is: this process did not listen. Where a
  // tick is long, a neighbour whose turn comes later in it is not stuck.
  std::vector<SilentNeighbour> Look(std::span<const RegionId> waited_for, const LinkTable& links, TimePoint now,
                                    Duration tick_length = Duration(0));
  void Stepped() { waited_since_.clear(); }

 private:
  TimePoint next_look_{};
  std::map<RegionId, TimePoint> waited_since_;
};

}  // namespace tessera::worker
