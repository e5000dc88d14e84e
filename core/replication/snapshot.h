// Snapshots: how a client comes to see what a region owns.
//
// A region quantises its bodies once a tick into a SnapshotHistory that all its clients share. Per client a
// SnapshotSender writes datagrams: each decodes alone, holds some bodies, and says per body against which acknowledged
// tick it is coded (none: full). The client's SnapshotReceiver rebuilds them and makes the acknowledgements. So a lost
// datagram costs only itself.
//
//   history.Push(tick, bodies, departures);                    // once a tick that is sent
//   for (auto& bytes : sender.Write(history).datagrams) send;  // per client
//   ...
//   receiver.Read(bytes);  send(receiver.WriteAck());          // client
//   ...
//   sender.Acknowledge(ack_bytes);
//
// A body that rests and is acknowledged costs nothing; where all do, a datagram goes out now and then. A body that left
// is named until its absence is acknowledged, with where it went. Nothing in a datagram is trusted: every count and
// range is checked, an error leaves the receiver as it was. Thread rule: one thread at a time.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/replication/settings.h"
#include "core/world/bounds.h"
#include "core/world/ids.h"
#include "core/world/scene.h"

namespace tessera::replication {

using Bytes = std::vector<std::uint8_t>;

struct BodyRecord {
  BodyId id;
  Epoch epoch;  // of its ownership
  BodyState state;
};

struct DepartureRecord {
  BodyId id;
  Epoch epoch;  // of the ownership that ended
  RegionId to;  // RegionId(): removed for good
};

// Quantised states of the last ticks, shared by all clients of a region.
class SnapshotHistory {
 public:
  SnapshotHistory(const Aabb& world_bounds, const Settings& settings);
  ~SnapshotHistory();
  // `bodies` ascending by id, all that the region owns; `departures` since the last Push. Ticks ascend.
  void Push(Tick tick, std::span<const BodyRecord> bodies, std::span<const DepartureRecord> departures);

 private:
  friend class SnapshotSender;
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

struct WrittenSnapshot {
  std::vector<Bytes> datagrams;  // each at most settings.max_datagram_bytes; none while there is nothing to tell
  bool full = false;             // no body in it had a baseline: what a client gets that has nothing yet
  std::uint32_t bodies = 0;      // records written
};

class SnapshotSender {
 public:
  explicit SnapshotSender(const Settings& settings);
  ~SnapshotSender();
  SnapshotSender(SnapshotSender&&) noexcept;
  SnapshotSender& operator=(SnapshotSender&&) noexcept;
  // Of the history's newest tick. `last_input` and `input_margin` are told to the client: the last input of its that
  // was applied, and how many ticks early it came.
  WrittenSnapshot Write(const SnapshotHistory& history, std::uint32_t last_input, std::int32_t input_margin_ticks);
  absl::Status Acknowledge(std::span<const std::uint8_t> ack);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

// What one datagram told.
struct ReceivedSnapshot {
  Tick tick;
  std::uint32_t last_input = 0;
  std::int32_t input_margin_ticks = 0;
  std::uint32_t full_records = 0;  // bodies that came without a baseline
  std::vector<BodyRecord> bodies;  // at `tick`
  std::vector<DepartureRecord> departures;
};

class SnapshotReceiver {
 public:
  SnapshotReceiver(const Aabb& world_bounds, const Settings& settings);
  ~SnapshotReceiver();
  SnapshotReceiver(SnapshotReceiver&&) noexcept;
  SnapshotReceiver& operator=(SnapshotReceiver&&) noexcept;
  // Errors: INVALID_ARGUMENT (malformed, names what), FAILED_PRECONDITION (its baseline is not here; harmless, it is
  // not acknowledged). A datagram that is a duplicate gives ALREADY_EXISTS.
  absl::StatusOr<ReceivedSnapshot> Read(std::span<const std::uint8_t> datagram);
  // The newest sequence and a bit mask of those before it; empty while nothing came.
  Bytes WriteAck() const;
  // Of the datagrams that were sent up to the newest one that came; 0 while nothing came. What is missing was lost or
  // is late.
  std::uint32_t newest_sequence() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace tessera::replication
