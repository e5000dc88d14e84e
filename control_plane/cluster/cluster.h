// Cluster: all that the control plane knows and decides: hosts, instances, players. A state machine without sockets,
// threads or clocks; requests, agents' messages and the time come in, answers and `Effects` come out.
//
// Promises. What must survive (specs, placements, maps, keys, players, states) is stored before anything that follows
// from it is given out, so a control plane may die between any two calls and the next one, loaded from the same store,
// goes on. What agents can tell again is not stored. Ids and incarnations are never given twice. A request that fails
// changes nothing.
//
//   auto cluster = Cluster::Load(store, settings, SystemRandomBytes, now);
//   absl::StatusOr<v1::AddHostResponse> host = (*cluster)->AddHost(now, request);
//   Effects effects = (*cluster)->TakeEffects();  // after every call: who is to be woken, what is to be logged
//
// Thread rule: none of its own; the owner calls it under one lock. `store` outlives it.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "control_plane/change.h"
#include "control_plane/entries.h"
#include "control_plane/instance_plan.h"
#include "control_plane/moment.h"
#include "control_plane/secrets.h"
#include "control_plane/settings.h"
#include "control_plane/store.h"
#include "tessera/v1/agent_link.pb.h"
#include "tessera/v1/host.pb.h"
#include "tessera/v1/instance.pb.h"
#include "tessera/v1/session.pb.h"

namespace tessera::control {

// What a call set off outside.
struct Effects {
  std::set<SessionId> desired;                                 // TakeDesired has something for these
  std::map<SessionId, absl::Status> closed;                    // these are over, and why
  std::set<std::string> instances;                             // changed, or a report of theirs did
  std::vector<std::pair<SessionId, v1::LeaseRenewal>> leases;  // to be sent at once
  std::vector<std::string> log;                                // one line each
  std::set<std::string> restore;                               // instances that need `Restore` or `CannotRestore`
  std::vector<std::pair<std::string, std::uint64_t>> pruned, abandoned;  // checkpoints, and drafts of them
  std::vector<std::string> forgotten;                                    // instances
  std::vector<std::chrono::nanoseconds> failovers;                       // that ended; how long they took
};

// How many there are in each state; what the metrics show.
struct Census {
  std::map<v1::HostState, int> hosts;
  std::map<v1::InstanceState, int> instances;
  // Of those that run.
  struct Health {
    std::string id;
    int unprotected = 0;                          // regions
    std::chrono::nanoseconds last_checkpoint{0};  // wall clock; 0: none
    double imbalance = 0;                         // 0: not known
    std::uint64_t lost_bodies = 0, lost_ticks = 0;
    bool checkpoints_expected = false;
  };
  std::vector<Health> health;
};

// A process that serves metrics.
struct ScrapeTarget {
  std::string address;      // "10.0.0.5:9101"
  std::string host;         // name
  std::string instance_id;  // of a worker; empty for an agent
  std::uint32_t region = 0;
};

class Cluster {
 public:
  static absl::StatusOr<std::unique_ptr<Cluster>> Load(Store& store, const Settings& settings, RandomBytes random,
                                                       Moment now);

  // --- Hosts. Errors: kInvalidArgument, kAlreadyExists, kNotFound, kFailedPrecondition, naming the field.
  absl::StatusOr<v1::AddHostResponse> AddHost(Moment now, const v1::AddHostRequest& request);
  absl::StatusOr<v1::ListHostsResponse> ListHosts(const v1::ListHostsRequest& request) const;
  absl::StatusOr<v1::GetHostResponse> GetHost(const v1::GetHostRequest& request) const;
  absl::StatusOr<v1::DrainHostResponse> DrainHost(Moment now, const v1::DrainHostRequest& request);
  absl::Status RemoveHost(Moment now, const v1::RemoveHostRequest& request);

  // --- Agents. A session is one attached stream; the latest one of a host counts, and earlier ones end with kAborted.
  struct Admission {
    SessionId session = 0;
    v1::Admitted admitted;
  };
  // kUnauthenticated, kPermissionDenied (host was removed), kInvalidArgument.
  absl::StatusOr<Admission> HandleHello(Moment now, const v1::AgentHello& hello);
  // Not OK: the session is over.
  absl::Status HandleAgentMessage(Moment now, SessionId session, const v1::AgentMessage& message);
  void HandleAgentGone(Moment now, SessionId session);
  // The host's whole desired set, if it has changed since it was last taken.
  std::optional<v1::DesiredSet> TakeDesired(Moment now, SessionId session);
  absl::Status CheckHostSecret(const std::string& host_id, const std::string& secret) const;

  // --- Instances.
  // kResourceExhausted when there is no room for all regions.
  absl::StatusOr<v1::Instance> CreateInstance(Moment now, const InstancePlan& plan, bool validate_only);
  // The instance that this request id made before; kNotFound.
  absl::StatusOr<v1::Instance> FindByRequestId(const std::string& request_id) const;
  absl::StatusOr<v1::Instance> GetInstance(const std::string& id) const;
  absl::StatusOr<v1::ListInstancesResponse> ListInstances(const v1::ListInstancesRequest& request) const;
  // Repeating it is fine: an instance that stops or has ended is returned as it is.
  absl::StatusOr<v1::Instance> DeleteInstance(Moment now, const v1::DeleteInstanceRequest& request);
  // As GetInstance would tell it; nothing if there is no such instance.
  std::optional<v1::InstanceState> StateOf(const std::string& instance_id) const;
  // The work follows; GetInstance tells of it. FAILED_PRECONDITION unless it runs.
  absl::StatusOr<v1::Instance> ScaleInstance(Moment now, const v1::ScaleInstanceRequest& request);
  absl::StatusOr<v1::Instance> RestartWorkers(Moment now, const v1::RestartWorkersRequest& request);
  // --- Properties. The number of the change, which is told to the workers until `PropertyOutcome` is something and
  // `ForgetProperty` is called; 0: only checked.
  absl::StatusOr<std::uint64_t> SetProperty(const v1::SetPropertyRequest& request);
  std::optional<absl::Status> PropertyOutcome(const std::string& id, std::uint64_t number) const;
  void ForgetProperty(const std::string& id, std::uint64_t number);
  // --- Checkpoints. Files are the caller's; here is what they are for.
  // The tick of the one that is being made from here on, or was already.
  absl::StatusOr<std::uint64_t> BeginCheckpoint(Moment now, const std::string& id);
  // FAILED_PRECONDITION: nobody waits for that file.
  absl::Status CheckUpload(const v1::UploadCheckpointRequest& request) const;
  // The file is on the disk. The manifest, when it was the last one.
  std::optional<records::Manifest> NoteUploaded(const v1::UploadCheckpointRequest& request);
  void NoteCheckpoint(Moment now, const std::string& id, const records::Manifest& manifest, std::uint64_t size);
  absl::Status CheckFetch(const v1::FetchStateRequest& request) const;
  absl::StatusOr<v1::Instance> Restore(Moment now, const std::string& id, const records::Manifest& manifest,
                                       const std::string& scene, bool validate_only);
  // No checkpoint is whole: the instance has FAILED.
  void CannotRestore(Moment now, const std::string& id, const std::string& why);
  absl::StatusOr<v1::ListCheckpointsResponse> ListCheckpoints(const v1::ListCheckpointsRequest& request) const;
  // The tick of the checkpoint that is being made; 0 if none is.
  std::uint64_t CheckpointUnderWay(const std::string& id) const;
  std::string SceneHashOf(const std::string& id) const;
  // True if a live instance uses the scene; it then lies in the store under SceneKey(hash).
  bool SceneInUse(const std::string& hash) const { return scenes_.contains(hash); }

  // --- Sessions of players. A join first waits (`BeginWait`), which is what starts a lazy instance, until `CanJoin`;
  // then `Join` and `EndWait`, in one go.
  absl::Status BeginWait(Moment now, const v1::JoinInstanceRequest& request);
  void EndWait(Moment now, const std::string& instance_id);
  // False: not all workers are bound yet. An error: it will never be.
  absl::StatusOr<bool> CanJoin(const std::string& instance_id) const;
  struct Joined {
    v1::JoinInstanceResponse response;
    std::uint64_t mark = 0;  // for AllKnow
  };
  absl::StatusOr<Joined> Join(Moment now, const v1::JoinInstanceRequest& request);
  // True once every worker of the instance has acted on an order made after `mark`.
  bool AllKnow(const std::string& instance_id, std::uint64_t mark) const;
  absl::Status Leave(Moment now, const v1::LeaveInstanceRequest& request);

  // --- Time. Call it about every kTimerInterval.
  void HandleTimer(Moment now);

  Effects TakeEffects() { return std::exchange(effects_, {}); }
  // The name of the host behind a session, for logs; empty if the session is over.
  std::string HostName(SessionId session) const;
  Census Count() const;
  std::vector<ScrapeTarget> ScrapeTargets() const;

 private:
  Cluster(Store& store, const Settings& settings, RandomBytes random)
      : store_(store), settings_(settings), random_(std::move(random)) {}

  // Loading.
  absl::Status LoadAll(Moment now);
  absl::Status LoadCounters();
  absl::Status LoadHosts(Moment now);
  absl::Status LoadInstances(Moment now);
  absl::Status LoadScenes();
  absl::Status TakeProperties(const std::string& scene_hash, const std::string& scene_bytes);

  // Storing: memory follows the store, never the other way round.
  absl::Status StoreHost(HostEntry& host, const records::Host& next);
  absl::Status StoreInstance(InstanceEntry& instance, const records::Instance& next);

  // Hosts.
  const HostEntry* FindHost(const std::string& name_or_id) const;
  absl::StatusOr<HostEntry*> HostOf(SessionId session);
  absl::StatusOr<HostEntry*> Authenticate(const v1::AgentHello& hello);
  v1::HostState StateOf(const HostEntry& host) const;
  v1::Host View(const HostEntry& host) const;
  std::vector<FreeHost> FreeHosts(const InstanceEntry* without) const;
  std::vector<FreeHost> HeardHosts(Moment now, const InstanceEntry* without) const;
  absl::StatusOr<PlacementPlan> PlaceAnew(Moment now, const PartitionMap& map, const InstanceEntry* without) const;
  void MarkDesired(HostEntry& host);
  void NoteTime(Moment now);
  void Heard(Moment now, HostEntry& host);
  void MarkLost(Moment now, HostEntry& host);
  absl::Status HandleHeartbeat(Moment now, HostEntry& host, const v1::AgentHeartbeat& heartbeat);
  void TakeReports(Moment now, HostEntry& host, const google::protobuf::RepeatedPtrField<v1::WorkerReport>& reports,
                   std::set<std::uint64_t>& touched);
  void NoticeAbsent(HostEntry& host, const google::protobuf::RepeatedPtrField<v1::WorkerReport>& reports,
                    std::optional<std::uint64_t> acted_revision, std::set<std::uint64_t>& touched);
  void HandleExited(HostEntry& host, const v1::WorkerExited& exited, std::set<std::uint64_t>& touched);
  // Null if it is not a worker that this host is to run, or one of an earlier incarnation.
  std::pair<InstanceEntry*, WorkerEntry*> FindWorker(const HostEntry& host, const v1::WorkerIdentity& identity);
  void TakeReport(Moment now, HostEntry& host, const v1::WorkerReport& report, std::set<std::uint64_t>& touched);
  static void TakePropertyAnswers(InstanceEntry& instance, const v1::WorkerReport& report);
  void NoteTakenOut(InstanceEntry& instance, const v1::WorkerReport& report);
  bool Holds(const HostEntry& host) const;
  void RenewLease(Moment now, SessionId session, HostEntry& host, const v1::LeaseRequest& request);
  absl::Status TakeInventory(Moment now, HostEntry& host, const v1::InventoryReport& report,
                             std::set<std::uint64_t>& touched);
  void NoticeDeadExited(const v1::WorkerExited& exited, std::set<std::uint64_t>& touched);
  void Witness(Moment now, InstanceEntry& instance, const v1::WorkerReport& before, const v1::WorkerReport& report);

  // Failover and planned maps of a RUNNING instance.
  HostEntry* HostAt(const InstanceEntry& instance, std::size_t index);
  const HostEntry* HostAt(const InstanceEntry& instance, std::size_t index) const;
  bool Silent(Moment now, const InstanceEntry& instance, std::size_t index) const;
  bool Outlives(const InstanceEntry& instance, std::size_t heir, std::size_t other) const;
  std::vector<Death> Deaths(Moment now, const InstanceEntry& instance) const;
  std::optional<records::Instance> NextProtected(const InstanceEntry& instance) const;
  std::optional<records::Instance> NextFailover(Moment now, InstanceEntry& instance);
  std::optional<records::Instance> BuryAndBegin(Moment now, InstanceEntry& instance, const std::vector<Death>& deaths);
  std::optional<records::Instance> GiveUp(Moment now, InstanceEntry& instance, std::string why);
  bool AllRunByMap(const InstanceEntry& instance) const;
  void WatchFailover(Moment now, InstanceEntry& instance, const records::Instance& next);
  void NoteCuts(Moment now, InstanceEntry& instance);
  std::vector<RegionFacts> ChangeFacts(Moment now, const InstanceEntry& instance) const;
  std::optional<records::Instance> NextChange(Moment now, InstanceEntry& instance);
  absl::StatusOr<InstanceEntry*> FindRunning(const std::string& id);
  void StepCheckpoint(Moment now, InstanceEntry& instance);
  void AbandonCheckpoint(Moment now, InstanceEntry& instance, const std::string& why);
  static void SetRestored(const PlacementPlan& placed, const records::Manifest& manifest, records::Instance& next);
  absl::Status BringBackScene(const std::string& hash, const std::string& scene);

  // Players.
  absl::Status DropCheckpoints(InstanceEntry& instance);
  absl::StatusOr<std::uint32_t> PlayerOf(Moment now, const InstanceEntry& instance, const std::string& connect_token,
                                         const std::string& session_key) const;
  absl::StatusOr<std::uint32_t> AddPlayer(const v1::JoinInstanceRequest& request, InstanceEntry& instance);
  absl::StatusOr<std::uint32_t> FindReturning(Moment now, const v1::JoinInstanceRequest& request,
                                              const InstanceEntry& instance) const;

  // Instances.
  const InstanceEntry* FindInstance(const std::string& id) const;
  InstanceEntry* FindInstance(const std::string& id);
  v1::InstanceState ShownState(const InstanceEntry& instance) const;
  LifeFacts Facts(const InstanceEntry& instance, Moment now) const;
  void Reconcile(Moment now, InstanceEntry& instance);
  void Reconcile(Moment now, const std::set<std::uint64_t>& numbers);
  std::optional<records::Instance> NextRecord(Moment now, InstanceEntry& instance, const LifeFacts& facts);
  void NoteTrouble(InstanceEntry& instance, const char* what, const absl::Status& status);
  void NoteDegraded(InstanceEntry& instance, const LifeFacts& facts);
  void StepPlacing(Moment now, const InstanceEntry& instance, records::Instance& next) const;
  void Entered(Moment now, InstanceEntry& instance, v1::InstanceState previous);
  void SetGone(InstanceEntry& instance, WorkerEntry& worker, std::string ending);
  InstanceEntry& Adopt(Moment now, std::uint64_t number, const records::Instance& record, Revision revision);
  void Assign(InstanceEntry& instance);
  void MarkOrders(InstanceEntry& instance);
  void Changed(InstanceEntry& instance);
  void ForgetEnded(Moment now);
  void PrunePlayers(Moment now, InstanceEntry& instance);
  std::optional<records::Instance> NextLeavers(Moment now, InstanceEntry& instance);
  v1::Instance View(const InstanceEntry& instance, bool whole) const;
  void ViewChanges(const InstanceEntry& instance, v1::Instance& view) const;

  std::uint64_t NextRevision() { return last_revision_ += 1; }

  Store& store_;
  Settings settings_;
  RandomBytes random_;
  records::Counters counters_;
  Revision counters_revision_ = kAbsent;
  std::map<std::uint64_t, HostEntry> hosts_;          // by the number in their id
  std::map<std::uint64_t, InstanceEntry> instances_;  // so listings are in the order of creation
  std::map<std::string, SceneUse> scenes_;            // by hash; of instances that have not ended
  std::map<std::string, std::uint64_t> request_ids_;  // to the instance's number
  std::map<SessionId, std::uint64_t> sessions_;       // to the host's number
  SessionId last_session_ = 0;
  Steady last_call_{0};              // of agents or the timer; 0: not yet
  std::uint64_t last_revision_ = 0;  // of orders and desired sets; the upper half is the number of this life
  Effects effects_;
};

// "host-12" with the prefix "host-" is 12; 0 if it is not of that form.
std::uint64_t NumberOf(std::string_view id, std::string_view prefix);
std::string SceneKey(std::string_view hash);

}  // namespace tessera::control
