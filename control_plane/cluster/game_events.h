// GameEvents: the events that games publish, on their way from the regions to the games' backends.
//
// The region that owns the world's record reports its events, numbered, until an order says that they are stored. Here
// each is stored before that order goes out, so it is kept exactly once, whichever of both ends dies. Readers have a
// cursor, the number that an event has here; it goes on when a restore from a checkpoint takes the world's numbers
// back, and the restore is an event of its own, which says up to which number the ones before are still true.
//
//   events.Take(instance, report, now);                  // each report repeats what no order has called stored
//   auto more = events.After(instance, cursor, 100);
//
// At most kMaxPublishedKept are kept of an instance. Thread rule: as the cluster.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "control_plane/cluster/cluster_state.h"
#include "control_plane/now.h"

namespace tessera::control {

class GameEvents {
 public:
  // `state` outlives it.
  explicit GameEvents(ClusterState& state) : state_(state) {}
  // Reads what is stored. DATA_LOSS names the key that cannot be read.
  absl::Status Load();

  void Take(InstanceEntry& instance, const v1::WorkerReport& report, Now now);
  // Notices that the instance began again with a checkpoint. Repeating it does nothing.
  void NoteRestore(InstanceEntry& instance, Now now);
  // Number, as the regions have it, of the newest event that is stored.
  std::uint64_t StoredUpTo(const InstanceEntry& instance) const;
  // Oldest first, at most so many. OUT_OF_RANGE: events after `number` are not kept any more, or it was never given.
  absl::StatusOr<std::vector<v1::PublishedEvent>> After(const InstanceEntry& instance, std::uint64_t number,
                                                        std::size_t most) const;
  void Forget(std::uint64_t instance);

 private:
  struct Kept {
    v1::PublishedEvent event;
    Revision revision = kAbsent;
  };
  struct Log {
    records::GameEvents head;
    Revision revision = kAbsent;  // the head's; kAbsent: nothing was ever stored
    std::deque<Kept> events;      // ascending
  };

  // Stores `head` with the events that are new, and drops the oldest. False: it could not be, and nothing has changed.
  bool Store(InstanceEntry& instance, Log& log, const records::GameEvents& head, std::vector<v1::PublishedEvent> added);

  ClusterState& state_;
  std::map<std::uint64_t, Log> logs_;  // by the instance's number
};

}  // namespace tessera::control
