#include "region_worker/core/neighbour_watch.h"

#include <algorithm>
#include <utility>

namespace tessera::worker {

std::vector<SilentNeighbour> NeighbourWatch::Look(std::span<const RegionId> waited_for, const LinkTable& links,
                                                  TimePoint now, Duration tick_length) {
  const Duration stuck = std::max(kStuck, kStuckTicks * tick_length);
  const bool late = now > std::exchange(next_look_, now + kInterval) + kInterval;
  std::erase_if(waited_since_, [&](const auto& entry) {
    return late || std::ranges::find(waited_for, entry.first) == waited_for.end();
  });
  std::vector<SilentNeighbour> silent;
  for (const RegionId region : waited_for) {
    const TimePoint since = waited_since_.try_emplace(region, now).first->second;
    const TimePoint heard = std::max(since, links.HeardFrom(region).value_or(TimePoint()));
    if (now - heard >= kSilence || now - since >= stuck) silent.push_back({region, now - heard});
  }
  for (const SilentNeighbour& neighbour : silent) waited_since_.erase(neighbour.region);
  return silent;
}

}  // namespace tessera::worker
