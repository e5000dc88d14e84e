// SnapshotSender: writes the snapshots of one client, and keeps what the client has acknowledged. snapshot.h shows how
// it is used. Thread rule: one thread at a time, together with the history that it writes from.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "absl/status/status.h"
#include "core/replication/snapshot_history.h"
#include "core/replication/snapshot_record.h"
#include "core/replication/snapshot_settings.h"
#include "core/world/ids.h"
#include "core/world/math.h"

namespace tessera::replication {

// Where a client looks from, and what this region may send it.
struct ClientView {
  // The centre of the settings' radius of interest: where the regions have the client's body, never what a client says.
  // Unknown: all is of interest.
  std::optional<Vec3d> centre{};
  BodyId own{};             // always first
  TeamId team = 0;          // sees what its bodies are shown, and what they say of themselves, to their team
  double budget_share = 1;  // this region's share of the client's bytes a second
};

struct WrittenSnapshot {
  std::vector<Bytes> datagrams;  // each at most settings.max_datagram_bytes; none while there is nothing to send
  bool full = false;             // all its records are full: a client gets this that has nothing yet
  std::uint32_t bodies = 0;      // records written
  std::uint32_t deferred = 0;    // records that were due and have to wait for the budget
};

class SnapshotSender {
 public:
  explicit SnapshotSender(const SnapshotSettings& settings);
  ~SnapshotSender();
  SnapshotSender(SnapshotSender&&) noexcept;
  SnapshotSender& operator=(SnapshotSender&&) noexcept;
  // Writes the history's newest tick. The client is also sent `last_input`, the number of its last input that was
  // applied, and `input_margin_ticks`, how many ticks early that came.
  WrittenSnapshot Write(const SnapshotHistory& history, const ClientView& view, std::uint32_t last_input,
                        std::int32_t input_margin_ticks);
  WrittenSnapshot Write(const SnapshotHistory& history, std::uint32_t last_input, std::int32_t input_margin_ticks) {
    return Write(history, ClientView(), last_input, input_margin_ticks);
  }
  // Takes in SnapshotReceiver::WriteAck. Errors: INVALID_ARGUMENT (malformed, or acknowledges what was never sent).
  absl::Status Acknowledge(std::span<const std::uint8_t> ack);
  // Asks for the memory that Write will look at. To be called on the next of many clients before writing to the one
  // before it: fetching what was last touched many clients ago takes as long as all the rest of Write.
  void Prefetch() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace tessera::replication
