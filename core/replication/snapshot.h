// Snapshots: how a client comes to see what a region owns.
//
// A region quantises what changed once a tick into a SnapshotHistory that all its clients share. Per client a
// SnapshotSender writes datagrams: each decodes alone, holds some bodies, and says per body which acknowledged ticks
// predict it (none: it is told whole). The client's SnapshotReceiver rebuilds them and makes the acknowledgements. So a
// lost datagram costs only itself.
//
//   history.Push(tick, changed, departures);                             // once a tick that is sent
//   for (auto& bytes : sender.Write(history, view, ...).datagrams) send;  // per client
//   ...
//   receiver.Read(bytes);  send(receiver.WriteAck());                    // client
//   ...
//   sender.Acknowledge(ack_bytes);
//
// A body that rests and is acknowledged costs neither bytes nor time; where all do, a datagram goes out now and then.
// What a client has no interest in is not told (interest.h), and what it is told keeps within its bytes a second: what
// matters most goes first, what has to wait matters more with each snapshot, and a world is joined piece by piece, the
// nearest first. A body that is there no more is named until that is acknowledged, with why: removed, handed to whom,
// or out of interest. Nothing in a datagram is trusted: every count and range is checked, an error leaves the receiver
// as it was. Thread rule: one thread at a time for a history with its senders, and for each receiver.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
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
  // PropertySet::Encode of what differs from the scene. Pushed: null where nothing does. Received: null where nothing
  // new is told of them.
  std::shared_ptr<const Bytes> properties = nullptr;
};

struct DepartureRecord {
  enum class Why : std::uint8_t {
    kRemoved,        // for good
    kHandedOver,     // to `to`, which goes on telling of it under a higher epoch
    kOutOfInterest,  // is there still, with the same owner and epoch, and may come back
  };
  BodyId id;
  Epoch epoch;  // of the ownership that ended; of the one that goes on when out of interest
  RegionId to;
  Why why = to == RegionId() ? Why::kRemoved : Why::kHandedOver;
  friend bool operator==(const DepartureRecord&, const DepartureRecord&) = default;
};

// Quantised states of the last ticks, shared by all clients of a region.
class SnapshotHistory {
 public:
  SnapshotHistory(const Aabb& world_bounds, const Settings& settings);
  ~SnapshotHistory();
  // Ticks ascend. `bodies` that came or may have changed since the last call; `departures` of what left since, and may
  // have come back. All others are as they were.
  void Push(Tick tick, std::span<const BodyRecord> bodies, std::span<const DepartureRecord> departures);

 private:
  friend class SnapshotSender;
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

// Whose eyes a snapshot is for.
struct ClientView {
  // The place that the settings' interest is around: where the regions have the client's body, never what a client
  // says. Unknown: all is of interest.
  std::optional<Vec3d> centre{};
  BodyId own{};             // always first
  double budget_share = 1;  // of the client's bytes a second: this region's
};

struct WrittenSnapshot {
  std::vector<Bytes> datagrams;  // each at most settings.max_datagram_bytes; none while there is nothing to tell
  bool full = false;             // no body in it had a baseline: what a client gets that has nothing yet
  std::uint32_t bodies = 0;      // records written
  std::uint32_t deferred = 0;    // that were due and have to wait for the budget
};

class SnapshotSender {
 public:
  explicit SnapshotSender(const Settings& settings);
  ~SnapshotSender();
  SnapshotSender(SnapshotSender&&) noexcept;
  SnapshotSender& operator=(SnapshotSender&&) noexcept;
  // Of the history's newest tick. `last_input` and `input_margin` are told to the client: the last input of its that
  // was applied, and how many ticks early it came.
  WrittenSnapshot Write(const SnapshotHistory& history, const ClientView& view, std::uint32_t last_input,
                        std::int32_t input_margin_ticks);
  WrittenSnapshot Write(const SnapshotHistory& history, std::uint32_t last_input, std::int32_t input_margin_ticks) {
    return Write(history, ClientView(), last_input, input_margin_ticks);
  }
  absl::Status Acknowledge(std::span<const std::uint8_t> ack);
  // Asks for the memory that Write will look at. Of the next of many clients, before writing to the one before it: what
  // was last touched many clients ago takes as long to come as all the rest of Write.
  void Prefetch() const;

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
  // At `tick`. Velocities are as told for bodies near the own one, and follow from the poses for others.
  std::vector<BodyRecord> bodies;
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
