// Cluster: the control plane's decisions behind one lock: hosts, instances, players. A state machine without sockets,
// threads or clocks; requests, agents' messages and the time come in, answers and `Effects` come out.
//
// Promises. What must survive (specs, placements, maps, keys, players, states) is stored before anything that follows
// from it is given out, so a control plane may die between any two calls and the next one, loaded from the same store,
// goes on. What agents can send again is not stored. Ids and incarnations are never given twice. A request that fails
// changes nothing.
//
//   auto cluster = Cluster::Load(store, settings, SystemRandomBytes, now);
//   absl::StatusOr<v1::AddHostResponse> host = (*cluster)->AddHost(now, request);
//   Effects effects = (*cluster)->TakeEffects();      // after every call: who is to be woken, what is to be logged
//   auto page = ListHosts((*cluster)->state(), list);  // questions are asked of the state, by queries.h
//
// It routes: each request and event goes to the part that it concerns, and then the Reconciler leads the instances on
// that it touched. Parts share the ClusterState and do not know each other; what one needs of another passes through
// here. So it has some 90 methods: one for each request of the API and each message of an agent, and those that lead
// from part to part. Thread rule: none of its own; the owner calls it under one lock. `store` outlives it.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "control_plane/cluster/access_tokens.h"
#include "control_plane/cluster/bans.h"
#include "control_plane/cluster/cluster_state.h"
#include "control_plane/cluster/desired_sets.h"
#include "control_plane/cluster/effects.h"
#include "control_plane/cluster/failovers.h"
#include "control_plane/cluster/game_events.h"
#include "control_plane/cluster/game_logs.h"
#include "control_plane/cluster/game_messages.h"
#include "control_plane/cluster/hosts.h"
#include "control_plane/cluster/instance_checkpoints.h"
#include "control_plane/cluster/instance_players.h"
#include "control_plane/cluster/instances.h"
#include "control_plane/cluster/issuers.h"
#include "control_plane/cluster/planned_changes.h"
#include "control_plane/cluster/property_changes.h"
#include "control_plane/cluster/reconciler.h"
#include "control_plane/cluster/recovery.h"
#include "control_plane/cluster/revocations.h"
#include "control_plane/cluster/tickets.h"
#include "control_plane/cluster/upgrades.h"
#include "control_plane/cluster/visuals.h"
#include "control_plane/cluster/worker_reports.h"
#include "control_plane/cluster/world_releases.h"
#include "control_plane/control_settings.h"
#include "control_plane/instance_plan.h"
#include "control_plane/now.h"
#include "control_plane/secrets.h"
#include "control_plane/store.h"
#include "tessera/v1/access.pb.h"
#include "tessera/v1/agent_link.pb.h"
#include "tessera/v1/host.pb.h"
#include "tessera/v1/instance.pb.h"
#include "tessera/v1/session.pb.h"

namespace tessera::control {

class Cluster {
 public:
  static absl::StatusOr<std::unique_ptr<Cluster>> Load(Store& store, const ControlSettings& settings,
                                                       RandomBytes random, Now now);
  Cluster(const Cluster&) = delete;
  Cluster& operator=(const Cluster&) = delete;

  const ClusterState& state() const { return *state_; }
  Effects TakeEffects() { return std::exchange(state_->effects(), {}); }
  // Call it about every kTimerInterval. `between` is called after each instance, and may let others call this cluster
  // meanwhile; it gives the time of then. Empty: it is all done at one time.
  void HandleTimer(Now now, const std::function<Now()>& between = nullptr);

  // --- Hosts: see hosts.h.
  absl::StatusOr<v1::AddHostResponse> AddHost(Now now, const v1::AddHostRequest& request);
  absl::StatusOr<v1::DrainHostResponse> DrainHost(const v1::DrainHostRequest& request);
  absl::Status RemoveHost(Now now, const v1::RemoveHostRequest& request);

  // --- Access: see access_tokens.h.
  absl::StatusOr<v1::CreateTokenResponse> CreateToken(Now now, const v1::CreateTokenRequest& request) {
    return tokens_.Create(request, now);
  }
  const AccessTokens& tokens() const { return tokens_; }
  // No old backup brings it back.
  absl::Status RevokeToken(Now now, const v1::RevokeTokenRequest& request);

  // --- Issuers of tickets: see issuers.h.
  // A key that was removed before counts again.
  absl::StatusOr<v1::AddIssuerResponse> AddIssuer(Now now, const v1::AddIssuerRequest& request);
  const Issuers& issuers() const { return issuers_; }
  // No old backup brings it back.
  absl::Status RemoveIssuer(const v1::RemoveIssuerRequest& request);

  // --- The list of who is let in no more: see revocations.h.
  const Revocations& revocations() const { return revocations_; }

  // --- Agents. The latest stream of a host counts, and earlier ones end with kAborted.
  // `shown_serial`: that of the certificate of the agent's connection; empty: it shows none.
  absl::StatusOr<Admission> HandleHello(Now now, const v1::AgentHello& hello, const std::string& shown_serial = "");
  // Not OK: the stream is over.
  absl::Status HandleAgentMessage(Now now, StreamId stream, const v1::AgentMessage& message);
  void HandleAgentGone(StreamId stream);
  // The host's whole desired set, if it may have changed since it was last taken.
  std::optional<v1::DesiredSet> TakeDesired(StreamId stream) { return desired_sets_.Take(stream); }

  // --- Instances. Each answer is the instance as it is then.
  // kResourceExhausted when there is no room for all regions.
  absl::StatusOr<v1::Instance> CreateInstance(Now now, const InstancePlan& plan, bool validate_only);
  // See ClusterState.
  bool HoldScene(const std::string& hash) { return state_->HoldScene(hash); }
  absl::Status AdoptScene(const std::string& hash, const ScenePieces& pieces) {
    return state_->AdoptScene(hash, pieces);
  }
  void ReleaseScene(const std::string& hash) { state_->ReleaseScene(hash); }
  // Repeating it is fine: an instance that stops or has ended is returned as it is.
  absl::StatusOr<v1::Instance> DeleteInstance(Now now, const v1::DeleteInstanceRequest& request);
  // The work follows. FAILED_PRECONDITION unless the instance runs.
  absl::StatusOr<v1::Instance> ScaleInstance(Now now, const v1::ScaleInstanceRequest& request);
  absl::StatusOr<v1::Instance> RestartWorkers(Now now, const v1::RestartWorkersRequest& request);
  absl::StatusOr<v1::Instance> PauseInstance(Now now, const v1::PauseInstanceRequest& request);
  absl::StatusOr<v1::Instance> ResumeInstance(Now now, const v1::ResumeInstanceRequest& request);
  absl::StatusOr<v1::Instance> SetPace(Now now, const v1::SetPaceRequest& request);
  // `hash`: that of the game in the request, which was checked with the instance's scene.
  absl::StatusOr<v1::Instance> SetGame(Now now, const v1::SetGameRequest& request, const std::string& hash);

  // --- Properties: see property_changes.h.
  absl::StatusOr<std::uint64_t> SetProperty(const v1::SetPropertyRequest& request);
  std::optional<absl::Status> PropertyOutcome(const std::string& id, std::uint64_t change) const;
  void ForgetProperty(const std::string& id, std::uint64_t change);

  // --- Games: see game_logs.h, game_events.h and game_messages.h.
  absl::StatusOr<v1::ListGameLinesResponse> ListGameLines(const v1::ListGameLinesRequest& request) const;
  // At most kPublishedAtOnce.
  absl::StatusOr<std::vector<v1::PublishedEvent>> GameEventsAfter(const std::string& id, std::uint64_t number) const;
  absl::StatusOr<std::uint64_t> SendToGame(Now now, const v1::SendToGameRequest& request);
  std::optional<absl::Status> GameMessageOutcome(const std::string& id, std::uint64_t number) const;

  // --- Files of meshes: see visuals.h. The caller writes and removes their pieces.
  Visuals& visuals() { return visuals_; }
  const Visuals& visuals() const { return visuals_; }

  // --- Checkpoints: see instance_checkpoints.h. The caller keeps the files.
  absl::StatusOr<std::uint64_t> BeginCheckpoint(Now now, const std::string& id);
  // As ClusterState has it.
  void SetCheckpointTrouble(const std::string& why) { state_->SetCheckpointTrouble(why); }
  std::uint64_t CheckpointUnderWay(const std::string& id) const;
  // NOT_FOUND if there is no such instance any more.
  absl::Status WhyNoCheckpoint(const std::string& id) const;
  absl::Status CheckUpload(Now now, const v1::UploadCheckpointRequest& request);
  absl::Status CheckCheckpointQuota(std::uint64_t bytes) const { return checkpoints_.CheckQuota(bytes); }
  std::optional<records::Manifest> NoteUploaded(const v1::UploadCheckpointRequest& request);
  void NoteCheckpoint(Now now, const std::string& id, const records::Manifest& manifest, std::uint64_t size);
  absl::Status CheckFetch(const v1::FetchStateRequest& request) const;
  // All workers start again, from the checkpoint, with programs of the release that is chosen.
  absl::StatusOr<v1::Instance> Restore(Now now, const std::string& id, const records::Manifest& manifest,
                                       const Contents& contents, bool validate_only,
                                       ReleaseChoice release = ReleaseChoice::kKept);
  // While the instance cannot go on but from a checkpoint: it is to be older than this tick; 0: any is fine.
  std::optional<std::uint64_t> RestoreWantedBefore(const std::string& id) const;
  // It cannot be restored now, and is tried again.
  void NoteRestoreWaits(const std::string& id, const std::string& why);
  // No checkpoint is whole: the instance has FAILED.
  void CannotRestore(Now now, const std::string& id, const std::string& why);

  // --- Upgrades: see upgrades.h. The caller makes the checkpoint of the tick after which the world stands.
  absl::StatusOr<v1::Instance> BeginUpgrade(Now now, const std::string& id, bool validate_only);
  // Nothing yet: not all of it stands. FAILED_PRECONDITION: it is not being upgraded any more.
  absl::StatusOr<std::optional<std::uint64_t>> UpgradeTick(const std::string& id) const;
  // The world begins anew, from the checkpoint.
  absl::StatusOr<v1::Instance> FinishUpgrade(Now now, const std::string& id, const records::Manifest& manifest,
                                             const Contents& contents);
  // It comes to nothing, and the world goes on. Repeating it is fine.
  absl::Status EndUpgrade(Now now, const std::string& id, const std::string& why);

  // --- Players: see instance_players.h.
  // The first step of a join: whether the instance lets such a request in, and the ticket, if it has one, which is used
  // up by it. `stranger`: the caller has proved nothing else, and comes from there (CountedAddress), where that is
  // known; nothing: it has. Errors are those of CheckGuest, GuestRates, Tickets and Bans.
  absl::StatusOr<std::optional<trust::Ticket>> TakeTicket(Now now, const v1::JoinInstanceRequest& request,
                                                          const std::optional<std::string>& stranger);
  absl::Status BeginWait(Now now, const v1::JoinInstanceRequest& request);
  void EndWait(Now now, const std::string& instance_id);
  // Joins that wait for the instance's workers.
  int WaitingPlayers(const std::string& instance_id) const;
  // `ticket`: as TakeTicket gave it. `stranger`: its viewers are counted apart (core/world/viewer_number.h).
  absl::StatusOr<Joined> Join(Now now, const v1::JoinInstanceRequest& request,
                              const std::optional<trust::Ticket>& ticket = std::nullopt, bool stranger = false);
  absl::Status Leave(Now now, const v1::LeaveInstanceRequest& request);
  absl::StatusOr<v1::KickPlayerResponse> KickPlayer(Now now, const v1::KickPlayerRequest& request);
  // The ban is stored first, then whoever plays so is kicked.
  absl::StatusOr<v1::BanPlayerResponse> BanPlayer(Now now, const v1::BanPlayerRequest& request);
  absl::Status UnbanPlayer(const v1::UnbanPlayerRequest& request);
  absl::StatusOr<v1::ListBansResponse> ListBans(const v1::ListBansRequest& request) const;

 private:
  Cluster(std::unique_ptr<ClusterState> state, const ControlSettings& settings, RandomBytes random, Now now);
  absl::Status LoadParts(Now now);
  absl::Status GiveSeeds();
  void Adopt(Now now, InstanceEntry& instance);
  absl::StatusOr<v1::Instance> DeleteUnknown(const v1::DeleteInstanceRequest& request);
  // Work that comes before the cluster knows what runs.
  void TakeWhileRecovering(const HostEntry& host, const v1::AgentMessage& message, Now now);
  // Lists of revocations: what agents keep, and what follows from one that was taken up.
  bool TakesRevocations(HostEntry& host, const v1::AgentMessage& message, Now now);
  void TakeUpRevocations(const HostEntry& host, const v1::SignedRevocations& list, Now now);
  void RemoveRevoked(InstanceNumbers& touched);
  void DropRevokedAccess();
  absl::Status NoteRevoked(const absl::Status& named, const std::string& what);
  void SendBannedAway(Now now);
  void RenewLease(HostEntry& host, const v1::LeaseRequest& request, Now now);
  void HoldBack(StreamId stream, const v1::AgentMessage& message);
  void StepRecovery(Now now);
  void Forget(std::uint64_t number);
  absl::Status StoreUpgradeEnd(Now now, InstanceEntry& instance, const std::optional<records::Instance>& next);
  void NoteTime(Now now);
  void StepInTime(Now now, InstanceEntry& instance);
  void NoteGameDeath(const HostEntry& host, const v1::WorkerExited& exited, InstanceNumbers& touched);
  void NoteHeard(Now now, HostEntry& host);
  void TakeReport(Now now, const HostEntry& host, const v1::WorkerReport& report, InstanceNumbers& touched);
  void TakeReports(Now now, HostEntry& host, const ReportList& reports, std::optional<std::uint64_t> acted_revision,
                   InstanceNumbers& touched);
  absl::StatusOr<v1::Instance> Ask(Now now, InstanceEntry& instance,
                                   const absl::StatusOr<std::optional<records::Instance>>& next, bool validate_only,
                                   const Contents& contents = {});
  std::unique_ptr<ClusterState> state_;
  ControlSettings settings_;
  RandomBytes random_;
  Revocations revocations_;
  Hosts hosts_;
  AccessTokens tokens_;
  Issuers issuers_;
  Tickets tickets_;
  Bans bans_;
  WorkerReports reports_;
  Instances instances_;
  PlannedChanges changes_;
  Failovers failovers_;
  InstanceCheckpoints checkpoints_;
  InstancePlayers players_;
  PropertyChanges properties_;
  GameLogs game_logs_;
  GameEvents game_events_;
  GameMessages game_messages_;
  Visuals visuals_;
  Upgrades upgrades_;
  Reconciler reconciler_;
  DesiredSets desired_sets_;
  Recovery recovery_;
  std::vector<std::pair<StreamId, v1::AgentMessage>> held_back_;  // until the recovery ends
};

}  // namespace tessera::control
