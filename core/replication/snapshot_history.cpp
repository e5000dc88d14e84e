#include "core/replication/snapshot_history.h"

#include <cassert>

namespace tessera::replication {

SnapshotHistory::SnapshotHistory(const Aabb& world_bounds, const Settings& settings)
    : impl_(std::make_unique<Impl>(world_bounds, settings)) {
  assert(settings.history_ticks >= 2);
}
SnapshotHistory::~SnapshotHistory() = default;

void SnapshotHistory::Push(Tick tick, std::span<const BodyRecord> bodies, std::span<const DepartureRecord> departures) {
  Impl& history = *impl_;
  assert(history.empty() || tick > history.newest().tick);
  for (const DepartureRecord& departure : departures) history.departed[departure.id] = departure;

  static const std::vector<HistoryItem> kNone;
  const std::vector<HistoryItem>& before = history.empty() ? kNone : history.newest().items;
  HistoryEntry& entry = history.ring[history.head];
  assert(&entry.items != &before);
  entry.tick = tick;
  entry.items.clear();
  entry.items.reserve(bodies.size());
  auto previous = before.begin();
  for (const BodyRecord& body : bodies) {
    assert(entry.items.empty() || entry.items.back().id < body.id);
    const QuantizedState state = history.quantizer.Quantize(body.state);
    while (previous != before.end() && previous->id < body.id) ++previous;
    const bool present = previous != before.end() && previous->id == body.id;
    if (!present) history.departed.erase(body.id);
    const bool unchanged = present && previous->epoch == body.epoch && previous->state == state;
    entry.items.push_back({body.id, body.epoch, unchanged ? previous->since : tick, state});
  }
  history.head = (history.head + 1) % history.ring.size();
  history.count = std::min(history.count + 1, history.ring.size());
}

}  // namespace tessera::replication
