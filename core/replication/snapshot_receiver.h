// SnapshotReceiver: rebuilds the states in a region's snapshots, and makes the acknowledgements. snapshot.h shows how
// it is used. Nothing in a datagram is trusted. Thread rule: one thread at a time.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "absl/status/statusor.h"
#include "core/replication/snapshot_record.h"
#include "core/replication/snapshot_settings.h"
#include "core/world/bounds.h"
#include "core/world/ids.h"

namespace tessera::replication {

// The contents of one datagram.
struct ReceivedSnapshot {
  Tick tick;
  std::uint32_t last_input = 0;
  std::int32_t input_margin_ticks = 0;
  std::uint32_t full_records = 0;  // bodies that came without a baseline
  // States at `tick`. Bodies near the own one come with velocities; those of others follow from the poses.
  std::vector<BodyRecord> bodies;
  std::vector<DepartureRecord> departures;
};

class SnapshotReceiver {
 public:
  SnapshotReceiver(const Aabb& world_bounds, const SnapshotSettings& settings);
  ~SnapshotReceiver();
  SnapshotReceiver(SnapshotReceiver&&) noexcept;
  SnapshotReceiver& operator=(SnapshotReceiver&&) noexcept;
  // Errors: INVALID_ARGUMENT (malformed, names the fault), FAILED_PRECONDITION (its baseline is not here; harmless, it
  // is not acknowledged). A datagram that is a duplicate gives ALREADY_EXISTS.
  absl::StatusOr<ReceivedSnapshot> Read(std::span<const std::uint8_t> datagram);
  // The newest sequence and a bit mask of those before it; empty while nothing came.
  Bytes WriteAck() const;
  // Number of datagrams that were sent up to the newest one that came; 0 while nothing came. Those that did not come
  // were lost or are late.
  std::uint32_t newest_sequence() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace tessera::replication
