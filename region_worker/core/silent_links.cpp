#include "region_worker/core/silent_links.h"

#include <algorithm>
#include <utility>

namespace tessera::worker {

void SilentLinks::Look(std::span<const RegionId> closed, const LinkTable& links, TimePoint now) {
  const Duration passed = std::min<Duration>(now - std::exchange(looked_at_, now), kLongestLook);
  next_look_ = now + kInterval;
  std::erase_if(silences_, [&](const auto& entry) { return std::ranges::find(closed, entry.first) == closed.end(); });
  for (const RegionId region : closed) {
    const std::optional<TimePoint> heard = links.HeardFrom(region);
    const auto [known, is_new] = silences_.try_emplace(region, Silence{.heard = heard});
    Silence& silence = known->second;
    if (silence.heard != heard) {
      silence = {.heard = heard};
    } else if (!is_new) {
      silence.counted += passed;
    }
  }
}

bool SilentLinks::Is(RegionId region, const LinkTable& links) const {
  const auto found = silences_.find(region);
  return found != silences_.end() && found->second.counted >= kSilence &&
         found->second.heard == links.HeardFrom(region);
}

}  // namespace tessera::worker
