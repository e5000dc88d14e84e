// What Cluster remembers of hosts, instances and workers: the stored record, and beside it what was observed. Plain
// data.
#pragma once

#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "control_plane/control_records.pb.h"
#include "control_plane/failover.h"
#include "control_plane/life.h"
#include "control_plane/moment.h"
#include "control_plane/placement.h"
#include "control_plane/store.h"
#include "core/world/partition_map.h"
#include "tessera/v1/worker_link.pb.h"

namespace tessera::control {

// One attached stream of an agent; from 1, never used twice in a process. 0: none.
using SessionId = std::uint64_t;

struct WorkerEntry {
  std::uint32_t region = 0;
  std::uint64_t incarnation = 0;
  v1::WorkerReport report;  // the last one; empty before the first
  bool reported = false;
  bool gone = false;           // has ended; for good, since incarnations are not used twice
  std::string ending;          // why, if nobody asked it to
  int missed = 0;              // heartbeats in a row that did not name it
  v1::WorkerOrder order;       // as last given out
  std::uint64_t ended_in = 0;  // revision of the first desired set that asks it to end
  Steady reported_at{0};
  double body_cost_s = 0;       // of a step, smoothed; 0: not measured yet
  Steady witnessed_at{0};       // when its heir last told of news from it
  Steady leased_at{0};          // when we last renewed its lease
  Steady unprotected_since{0};  // by its own word, while its heir's host is heard; 0: it is protected

  // Listens, and we know where.
  bool bound() const { return !gone && report.phase() >= v1::WORKER_PHASE_BOUND && report.address().game_port() != 0; }
};

struct HostEntry {
  std::uint64_t number = 0;
  records::Host record;
  Revision revision = kAbsent;
  SessionId session = 0;
  bool lost = false;
  Steady last_heard{0};
  std::chrono::nanoseconds last_heartbeat_time{0};  // wall clock; 0: none in this life
  bool desired_changed = false;
  std::uint64_t acted_revision = 0;                         // the last desired set that the agent has acted on
  std::set<std::pair<std::uint64_t, std::size_t>> workers;  // (instance number, index) placed here and not gone
};

// A checkpoint that is being made. Not stored: after a restart it is begun anew.
struct CheckpointDraft {
  std::uint64_t tick = 0;
  Steady since{0};
  std::uint64_t map_version = 0;                         // by another map its files are not the whole world
  std::map<std::uint32_t, records::ManifestFile> files;  // by region: those that are on the disk
};

// A change of a property that somebody waits for. Not stored: who waits asks again.
struct PropertyChangeEntry {
  v1::PropertyChange change;
  std::optional<absl::Status> outcome;
};

struct InstanceEntry {
  std::uint64_t number = 0;
  records::Instance record;
  Revision revision = kAbsent;
  PartitionMap map;
  std::vector<WorkerEntry> workers;  // as record.placements
  std::string degraded;              // why; empty in good health
  std::string trouble;               // why its last step could not be stored; logged once
  int waiting = 0;                   // joins that wait for the workers
  Steady start_deadline{0};
  Steady state_since{0};
  FailoverWatch failover;      // of the failover under way, if there is one
  std::string restore_wanted;  // why the world has to be taken from a checkpoint; empty: it has not
  std::optional<CheckpointDraft> checkpoint;
  Steady next_checkpoint{0};  // 0: not yet reckoned
  Steady change_after{0};     // no planned map before
  // Pairs of regions, the lower first, whose link failed an heir, and until when they are kept apart. Not stored.
  std::map<std::pair<std::uint32_t, std::uint32_t>, Steady> cuts;
  std::vector<PropertyChangeEntry> property_changes;  // ascending by number
  bool withdrawn = false;                      // the grace of stopping is over: its workers are in no desired set
  std::map<std::uint32_t, Steady> gone_since;  // players without a connection; not stored: counted anew by a new life
  std::map<std::uint32_t, std::pair<std::uint64_t, Steady>> left;  // player -> (mark, when): see Cluster::AllKnow
};

struct SceneUse {
  int instances = 0;
  Revision revision = kAbsent;
};

}  // namespace tessera::control
