// ClusterState: the stored records of hosts and instances, the places of their workers, and what those that run have
// reported. The parts of Cluster decide on it. State that only one part needs is in that part.
//
// Promises. Memory follows the store: a record changes only by a write that succeeded, and workers' entries follow
// their instance's placements at once. Ids and revisions are never given twice, over all lives of a control plane on
// one store. Each field of an entry names the part that writes it; a field without a name is written here.
//
//   auto state = ClusterState::Load(store);
//   InstanceEntry* instance = state->FindInstance("inst-7");
//   if (absl::Status status = state->StoreInstance(*instance, next); !status.ok()) return status;
//   state->MarkOrders(*instance);
//
// It has some 70 methods because every write of a record, and every note of what follows from it, is made here, so that
// no part can change one without the other.
//
// Thread rule: none of its own. `store` outlives it. Entries stay where they are until they are removed.
#pragma once

#include <array>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "control_plane/cluster/effects.h"
#include "control_plane/control_records.pb.h"
#include "control_plane/now.h"
#include "control_plane/players.h"
#include "control_plane/store.h"
#include "control_plane/stored_records.h"
#include "core/world/partition_map.h"
#include "net/signing_key.h"
#include "tessera/v1/worker_link.pb.h"

namespace tessera::control {

// No desired set has asked for the worker, in this life or in one before.
inline constexpr std::uint64_t kUnasked = std::numeric_limits<std::uint64_t>::max();

struct WorkerEntry {
  std::uint32_t region = 0;
  std::uint64_t incarnation = 0;
  bool gone = false;     // has ended; for good, since incarnations are not used twice
  std::string ending;    // why, if nobody asked it to
  bool evicted = false;  // gone, though nobody says that it has ended: its host was evicted, or it sent what none may

  // Revision of the first desired set that asks for it, or kUnasked; 0: it may run already. Written by DesiredSets, and
  // by WorkerReports once its agent says hello anew.
  std::uint64_t asked_in = 0;

  // Written by WorkerReports.
  v1::WorkerReport report;  // the last one; empty before the first
  std::string certificate;  // a signed net::WorkerCertificate; empty until the worker has reported its key
  std::string certified;    // that key
  bool reported = false;
  Steady reported_at{0};
  int missed = 0;  // heartbeats in a row that did not name it

  // Written by DesiredSets.
  v1::WorkerOrder order;       // as last given out, without the players
  Players players;             // that went with it
  StreamId given_on = 0;       // the agent's stream that they went out on; 0: none yet
  std::uint64_t ended_in = 0;  // revision of the first desired set that asks it to end; 0: none does

  // Written by Failovers.
  Steady witnessed_at{0};  // when its standby last reported progress of it
  Steady leased_at{0};     // when its lease was last renewed from here

  // Listens, and its address is known.
  bool bound() const { return !gone && report.phase() >= v1::WORKER_PHASE_BOUND && report.address().game_port() != 0; }
};

// Revisions: 2^32 changes in each of 2^31 lives.
inline constexpr int kLifeShift = 32;

// Two neighbours of a world that have no link, and since when.
struct CutLink {
  std::uint32_t one = 0, other = 0;  // the lower region first
  Steady since{0};
};

// A set of instances.
using InstanceNumbers = std::set<std::uint64_t>;

struct HostEntry {
  std::uint64_t number = 0;
  records::Host record;
  Revision revision = kAbsent;
  StreamId stream = 0;                                      // its agent's; 0: not attached
  std::set<std::pair<std::uint64_t, std::size_t>> workers;  // (instance number, index) placed here and not gone

  // Written by Hosts.
  bool lost = false;
  Steady last_heard{0};
  std::chrono::nanoseconds last_heartbeat_time{0};  // wall clock; 0: none in this life
  std::optional<double> clock_ahead_s;  // the host's wall clock against ours, with the heartbeat's way; none: unknown
  Steady no_ports_until{
      0};  // a worker found no free ports there: regions go elsewhere, if they can, until then; 0: none did
  std::chrono::nanoseconds no_ports_since{0};  // wall clock

  // Written by Cluster.
  bool takes_player_changes = false;      // its agent's orders may name players by what changed
  std::uint64_t kept_revocations = 0;     // number of the list that its agent says that it keeps
  std::uint64_t leases_withheld_for = 0;  // number of the list for want of which a lease was not renewed; logged once

  // Set here, cleared by DesiredSets.
  bool desired_changed = false;
};

struct InstanceEntry {
  std::uint64_t number = 0;
  records::Instance record;  // without its players, who are beside it
  Revision revision = kAbsent;
  Players players;
  std::array<Revision, Players::kBuckets> player_revisions{};
  std::uint32_t last_player = 0;     // the highest number that was given; the record has one that is not below it
  PartitionMap map;                  // as in the record
  net::SigningKey key;               // made from the record's seed
  std::vector<WorkerEntry> workers;  // as record.placements
  std::uint64_t connections = 0;     // grows when others are connected to its workers

  // Written by WorkerReports, and by Cluster for a restore; the newest tick that any worker reported since the world
  // last began, also of workers that are gone, or the one that it began with; 0: not known.
  std::uint64_t newest_tick = 0;
  bool newest_tick_is_kept = false;  // no worker told it, but an agent had kept it: there may have been later ones

  // Written by Instances.
  std::string degraded;                        // why; empty in good health
  std::chrono::nanoseconds degraded_since{0};  // by the wall clock, as all times of people
  std::string waits;                           // a word for what is under way; empty: nothing is
  std::chrono::nanoseconds waits_since{0};
  Steady progress_at{0};                                 // when the log last said how far that is, or it began
  std::size_t uncovered_regions = 0, still_regions = 0;  // as HealthWatch has them
  std::vector<CutLink> cut_links;                        // likewise
  Steady start_deadline{0};
  Steady state_since{0};
  bool withdrawn = false;  // the grace of stopping is over: its workers are in no desired set

  // Written by PlannedChanges.
  std::uint64_t moved_regions = 0;  // for slow hosts and cut links, in this life
  std::string links_awaited;        // links of newcomers that the plan under way waits for; empty: none
  std::string taken_back;           // why the last change was taken back; empty: none was, or another was made since
  std::string lacks_room;           // which change waits for room, and why; empty: none does
  std::chrono::nanoseconds lacks_room_since{0};

  // Written by GameEvents and GameMessages.
  std::uint64_t published_events = 0;     // that the game ever published, and restores
  std::size_t game_messages_waiting = 0;  // for an answer

  // Written by InstanceCheckpoints.
  std::string restore_wanted;          // why it is to begin again from a checkpoint; empty: it is not
  std::string restore_waits;           // for what that waits; empty: for nothing
  bool over_checkpoint_quota = false;  // its last one was too large, and was not made

  // Written by Reconciler.
  // Orders follow this before it is stored: a failover's resolution. None once any record was stored.
  struct Told {
    records::Instance record;
    Players players;
  };
  std::optional<Told> told;
  std::string unstored;  // why its last step is not in the store; empty: it is
  std::string awaits;    // silent hosts, as FailoverStep has them

  std::string trouble;  // why its last step could not be taken; logged once
};

// The values of a map, in the order of its keys, for a range-based for.
template <class Map>
class ValuesOf {
 public:
  struct Iterator {
    typename Map::iterator at;
    typename Map::mapped_type& operator*() const { return at->second; }
    Iterator& operator++() {
      ++at;
      return *this;
    }
    bool operator!=(const Iterator& other) const { return at != other.at; }
  };
  explicit ValuesOf(Map& map) : map_(map) {}
  Iterator begin() const { return {map_.begin()}; }
  Iterator end() const { return {map_.end()}; }

 private:
  Map& map_;
};

class ClusterState {
 public:
  // Reads all records and begins a new life on the store. Hosts, instances, buckets of players, scenes and games that
  // cannot be read are set aside; DATA_LOSS: the counters cannot be read. `drop_set_aside` deletes those that lives
  // before set aside.
  static absl::StatusOr<std::unique_ptr<ClusterState>> Load(Store& store, bool drop_set_aside = false);

  // All that questions are asked of, as it is now. Nothing changes in it, and it writes nothing.
  std::unique_ptr<const ClusterState> Picture() const;

  // Hosts' join tokens and certificates as they are now: all that known_callers.h needs of them.
  std::unique_ptr<const ClusterState> CallersPicture() const;
  // Grows with each change of that, or of tokens, which the part that keeps those notes.
  std::uint64_t access_changes() const { return access_changes_; }
  void NoteAccessChanged() { ++access_changes_; }

  // --- Access. Null: there is none.
  const std::map<std::uint64_t, HostEntry>& hosts() const { return hosts_; }              // by the number in the id,
  const std::map<std::uint64_t, InstanceEntry>& instances() const { return instances_; }  // so in order of creation
  auto EachHost() { return ValuesOf(hosts_); }
  auto EachInstance() { return ValuesOf(instances_); }
  const HostEntry* FindHost(std::string_view id) const;
  HostEntry* FindHost(std::string_view id);
  HostEntry* HostOf(StreamId stream);
  const InstanceEntry* FindInstance(std::string_view id) const;
  InstanceEntry* FindInstance(std::string_view id);
  InstanceEntry& instance(std::uint64_t number) { return instances_.at(number); }
  const InstanceEntry* FindByRequestId(const std::string& request_id) const;
  // True if an instance that has not ended uses the scene or game, which then lies in the store under this key.
  bool ContentInUse(const std::string& key) const {
    const auto found = contents_.find(key);
    return found != contents_.end() && found->second.instances > 0 && found->second.revision != kAbsent;
  }
  // True if there was a host of this number, and it was removed.
  bool WasHost(std::uint64_t number) const {
    return number > 0 && number <= counters_.record.last_host() && !IsSetAside(HostKey(number));
  }

  // --- Large scenes, whose pieces are stored before an instance is made with them, outside of the cluster's lock.
  // True: it is in use, and stays so until ReleaseScene.
  bool HoldScene(const std::string& hash);
  // Its pieces are stored: it is in use until ReleaseScene. Where somebody else was faster the pieces are given up.
  absl::Status AdoptScene(const std::string& hash, const ScenePieces& pieces);
  // Its maker needs it no more. Without an instance that uses it it goes.
  void ReleaseScene(const std::string& hash);

  // --- Writing. UNAVAILABLE: nothing was written, and nothing has changed.
  absl::StatusOr<HostEntry*> AddHost(records::Host record);  // gives it its id
  absl::Status StoreHost(HostEntry& host, const records::Host& next);
  absl::Status RemoveHost(HostEntry& host, const absl::Status& why);  // closes its agent's stream with `why`
  absl::StatusOr<InstanceEntry*> AddInstance(records::Instance record, const Contents& contents);  // likewise
  // `contents`: files that `next` uses and the record before did not.
  absl::Status StoreInstance(InstanceEntry& instance, const records::Instance& next, const Contents& contents = {});
  // The same, with its players in the same write.
  absl::Status StoreWithPlayers(InstanceEntry& instance, const records::Instance& next, const Players& players,
                                const Contents& contents = {});
  // The players alone. It costs the buckets that changed, however large the record is.
  absl::Status StorePlayers(InstanceEntry& instance, const Players& players);
  absl::Status RemoveInstance(const InstanceEntry& instance);
  // An instance that had ended needs its scene and game again. `contents` has all that it uses.
  absl::Status ReuseContents(const records::Instance& record, const Contents& contents);

  // --- Records that cannot be read.
  // Moves one out of the way, so that the cluster goes on without it: it stays in the store, under kSetAside.
  absl::Status SetAside(const StoreEntry& entry);
  // The keys of all that this life or one before it has set aside, as they were before. While there is one, no file is
  // removed that it may name.
  const std::vector<std::string>& set_aside() const { return set_aside_; }
  bool IsSetAside(const std::string& key) const;
  // True if this life has lost players of the instance so.
  bool LacksPlayers(std::uint64_t number) const { return lack_players_.contains(number); }

  // --- A store that was made of a backup, or whose records could not all be read: see recovery.h. False once what runs
  // was taken up.
  bool recovering() const { return counters_.record.recovering(); }
  // The records are as new as what runs, but for those that were set aside.
  bool recovers_unreadable() const { return counters_.record.recovers_unreadable(); }
  absl::Status EndRecovery();
  // A host shows an order of this revision. On a store that was made of a backup it may be of a life that the store
  // does not know: then this life, and the numbers of hosts and instances, go on from above. Where that cannot be
  // stored it is tried with the next that is shown.
  void NoteRevision(std::uint64_t shown);
  // Hosts have shown such a life, and what runs has not been taken up since.
  bool restored_again() const { return counters_.record.restored_again(); }

  // --- What parts store under keys of their own. UNAVAILABLE: as above.
  absl::StatusOr<Revision> WriteStored(std::span<const StoreOp> ops);
  absl::StatusOr<std::vector<StoreEntry>> ListStored(std::string_view prefix) const { return store_.List(prefix); }

  // --- The store's health.
  // Why the last write failed; empty if it did not.
  const std::string& store_trouble() const { return store_trouble_; }
  std::uint64_t failed_writes() const { return failed_writes_; }
  // Writes what changes nothing, a second after the last write failed, so that it is known when writing works again.
  void ProbeStore(Now now);

  // --- Room for checkpoints.
  // Why none is made; empty: they are. Each change is logged.
  void SetCheckpointTrouble(const std::string& why);
  const std::string& checkpoint_trouble() const { return checkpoint_trouble_; }

  // --- Agents' streams. An earlier stream of the host is closed with `why`.
  StreamId OpenStream(HostEntry& host, const absl::Status& why);
  void CloseStream(HostEntry& host, const absl::Status& why);
  void ForgetStream(HostEntry& host);  // it is over already

  // --- What follows from a change.
  void SetGone(InstanceEntry& instance, WorkerEntry& worker, std::string ending);
  void MarkDesired(HostEntry& host);                // its desired set may differ
  void MarkOrders(InstanceEntry& instance);         // so may the orders of all its workers
  void MarkChanged(const InstanceEntry& instance);  // wakes those that watch it
  void Log(std::string line, Severity severity = Severity::kInfo) {
    effects_.log.push_back({std::move(line), severity});
  }
  Effects& effects() { return effects_; }

  // Revisions of orders and desired sets; the upper half is the number of this life.
  std::uint64_t NextRevision() { return ++last_revision_; }
  std::uint64_t last_revision() const { return last_revision_; }

 private:
  struct ContentUse {
    int instances = 0;            // that use it, and makers of such that hold it
    Revision revision = kAbsent;  // kAbsent: the store lacks it, for it could not be read
    std::optional<ScenePieces> pieces{};
  };

  explicit ClusterState(Store& store) : store_(store) {}
  ClusterState(const ClusterState&) = default;
  absl::Status BeginLife(const std::vector<StoreEntry>& unreadable);
  absl::Status LoadSetAside(const std::vector<StoreEntry>& unreadable, bool drop_old);
  // Every write: notes whether it failed.
  absl::StatusOr<Revision> Write(std::span<const StoreOp> ops);
  absl::StatusOr<Revision> WriteOne(const StoreOp& op);
  absl::StatusOr<Revision> WriteCounters();
  void Adopt(const StoredRecord<records::Instance>& stored);
  absl::Status AdoptPlayers(InstanceEntry& instance, StoredPlayers stored);
  absl::Status AdoptContent(const std::string& key, const StoredContent& content);
  absl::Status DropStray(const std::string& key, const StoredContent& content);
  // The writes of those of `contents` that the store lacks.
  std::vector<StoreOp> PutMissing(const records::Instance& record, const Contents& contents) const;
  // It has left the store: so do its pieces, later.
  void ForgetContent(std::map<std::string, ContentUse>::iterator use);
  static std::vector<StoreOp> PlayerOps(const InstanceEntry& instance, const Players& players);
  static void FollowPlayers(InstanceEntry& instance, const Players& players, Revision written);
  void FollowPlacements(InstanceEntry& instance);
  static void FollowSeed(InstanceEntry& instance);

  Store& store_;
  StoredRecord<records::Counters> counters_;
  std::map<std::uint64_t, HostEntry> hosts_;
  std::map<std::uint64_t, InstanceEntry> instances_;
  std::map<std::string, std::uint64_t> request_ids_;  // to the instance's number
  std::map<StreamId, std::uint64_t> streams_;         // to the host's number
  std::map<std::string, ContentUse> contents_;        // by key, of instances that have not ended
  std::vector<std::string> set_aside_;
  InstanceNumbers lack_players_;
  StreamId last_stream_ = 0;
  std::uint64_t last_revision_ = 0;
  std::uint64_t operations_ = 0;  // begun in this life
  std::string store_trouble_, checkpoint_trouble_;
  std::uint64_t failed_writes_ = 0;
  std::uint64_t access_changes_ = 1;
  Steady probe_at_{0};  // 0: when the next timer says
  Effects effects_;
};

// The worker with this identity that `host` is to run; null if there is none, or another incarnation of it.
struct FoundWorker {
  InstanceEntry* instance = nullptr;
  WorkerEntry* worker = nullptr;
};
FoundWorker FindWorker(ClusterState& state, const HostEntry& host, const v1::WorkerIdentity& identity);

// The host of the worker at `index`; null if it was removed.
const HostEntry* HostAt(const ClusterState& state, const InstanceEntry& instance, std::size_t index);
HostEntry* HostAt(ClusterState& state, const InstanceEntry& instance, std::size_t index);

// Logs the trouble of an instance's step once, however often the step is tried.
void LogTrouble(ClusterState& state, InstanceEntry& instance, const char* what, const absl::Status& status);

// NOT_FOUND, with the request's field that named the instance.
absl::Status NoInstance(const char* field, const std::string& id);
// NOT_FOUND or FAILED_PRECONDITION, for the field "id".
absl::StatusOr<InstanceEntry*> FindRunning(ClusterState& state, const std::string& id);

}  // namespace tessera::control
