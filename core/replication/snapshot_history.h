// Inside of SnapshotHistory: what a SnapshotSender reads. Not for others.
#pragma once

#include <cstddef>
#include <unordered_map>
#include <vector>

#include "core/replication/quantize.h"
#include "core/replication/snapshot.h"

namespace tessera::replication {

// A body at one tick.
struct HistoryItem {
  BodyId id;
  Epoch epoch;
  Tick since;  // the first tick of the run, up to this one, in which nothing of it changed
  QuantizedState state;
};

struct HistoryEntry {
  Tick tick;
  std::vector<HistoryItem> items;  // ascending by id
};

struct SnapshotHistory::Impl {
  Impl(const Aabb& world_bounds, const Settings& settings)
      : quantizer(world_bounds, settings), ring(settings.history_ticks) {}

  bool empty() const { return count == 0; }
  // The age 0 is the newest. Requires age < count.
  std::size_t SlotAt(std::size_t age) const { return (head + ring.size() - 1 - age) % ring.size(); }
  const HistoryEntry& newest() const { return ring[SlotAt(0)]; }
  Tick oldest_tick() const { return ring[SlotAt(count - 1)].tick; }

  Quantizer quantizer;
  std::vector<HistoryEntry> ring;
  std::size_t head = 0;   // where the next entry goes
  std::size_t count = 0;  // entries in use
  // The last departure of each body that has left and not come back.
  std::unordered_map<BodyId, DepartureRecord> departed;
};

}  // namespace tessera::replication
