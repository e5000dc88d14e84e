// SnapshotHistory: the quantised states of a region's bodies over the last ticks, shared by the senders of all its
// clients. snapshot.h shows how it is used. Thread rule: one thread at a time, together with its senders.
#pragma once

#include <memory>
#include <span>

#include "core/replication/snapshot_record.h"
#include "core/replication/snapshot_settings.h"
#include "core/world/bounds.h"
#include "core/world/ids.h"

namespace tessera::replication {

class SnapshotHistory {
 public:
  SnapshotHistory(const Aabb& world_bounds, const SnapshotSettings& settings);
  ~SnapshotHistory();
  // Ticks ascend. `bodies` came or may have changed since the last call; `departures` left since, and may have come
  // back. All other bodies are as they were.
  void Push(Tick tick, std::span<const BodyRecord> bodies, std::span<const DepartureRecord> departures);

 private:
  friend class SnapshotSender;
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace tessera::replication
