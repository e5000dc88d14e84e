#include "core/region/tombstones.h"

#include <algorithm>

namespace tessera::region {
namespace {

// How long copies of a granted body may be left after its new owner has removed it: until the granter, and then its
// standby, have heard of the acknowledgement. The control plane gives a region another standby after 5 s.
constexpr std::uint64_t kTombstone_s = 10;

bool OfScene(BodyId id) { return id.value() < kFirstPlayerBody; }

}  // namespace

void Tombstones::Add(BodyId id, Epoch epoch, Tick now) {
  Entry& entry = entries_[id];
  entry = {std::max(entry.epoch, epoch), now};
  if (!OfScene(id)) to_forget_.emplace_back(now, id);
}

void Tombstones::Merge(std::span<const BodyClaim> others, Tick now) {
  for (const BodyClaim& other : others) Add(other.body, other.epoch, now);
}

void Tombstones::Forget(Tick now, std::uint32_t tick_rate_hz) {
  const auto over = [&](Tick since) { return since + kTombstone_s * tick_rate_hz < now; };
  for (; !to_forget_.empty() && over(to_forget_.front().first); to_forget_.pop_front()) {
    // One that was added again is here for longer.
    const auto entry = entries_.find(to_forget_.front().second);
    if (entry != entries_.end() && over(entry->second.since)) entries_.erase(entry);
  }
}

std::vector<BodyClaim> Tombstones::All() const {
  std::vector<BodyClaim> all;
  all.reserve(entries_.size());
  for (const auto& [id, entry] : entries_) all.push_back({id, entry.epoch});
  return all;
}

std::vector<BodyId> Tombstones::SceneBodies(Tick tick) const {
  std::vector<BodyId> bodies;
  for (const auto& [id, entry] : entries_) {
    if (OfScene(id) && entry.since <= tick) bodies.push_back(id);
  }
  return bodies;
}

}  // namespace tessera::region
