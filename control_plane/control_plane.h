// ControlPlane: the Cluster under one lock, with what waits on it: attached agents, watched instances, joining players.
//
// The store is written under the lock (docs/decisions/0094). So that a slow one harms little, agents' messages, orders
// to them and the timer have the next turn before all others, and questions are answered from a picture meanwhile. Who
// calls is looked up in another, smaller one, always.
//
// Everything is woken by the change it waits for. Thread rule: any thread. The calls that wait take `given_up`, asked
// about five times a second, and end early with kCancelled; after `Stop` they all end with kUnavailable.
//
// It has some 70 methods: one for each call that waits, or that handles files outside the lock. All other calls go
// through Call.
//
//   ControlPlane plane(store, std::move(cluster));
//   auto host = plane.Call([&](Cluster& cluster, Now now) { return cluster.AddHost(now, request); });
#pragma once

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <utility>

#include "control_plane/bundle.h"
#include "control_plane/checkpoint_files.h"
#include "control_plane/cluster/cluster.h"
#include "control_plane/cluster/known_callers.h"
#include "control_plane/draft_file.h"
#include "control_plane/lease_proof.h"
#include "control_plane/pending_leases.h"
#include "control_plane/turn_lock.h"
#include "control_plane/waiting_scenes.h"

namespace tessera::control {

// The rights that one of several control planes has.
struct LeaderRights {
  // At this moment; without it nothing is sent to agents any more. Asked under the lock, and must not block.
  std::function<bool()> leads = [] { return true; };
  // True: it led when this was called, or later. Without it workers' leases run out. Asked by one thread, which holds
  // no lock and has to wait for the store. Empty: nobody else can lead.
  std::function<bool()> proves_lead = nullptr;
};

// How often a waiting call asks whether anybody still waits for its answer.
inline constexpr std::chrono::milliseconds kGivenUpInterval{200};

class ControlPlane {
 public:
  // An attached agent's stream, with what is to be sent on it.
  struct AgentStream {
    StreamId id = 0;
    v1::Admitted admitted;
    std::string certificate_serial;  // serial of the certificate that is to be made; empty: none
    std::function<void()> cancel;    // ends the stream's reading
    std::condition_variable_any wake;
    bool desired = false;
    PendingLeases leases;
    std::optional<absl::Status> closed;
  };

  // Without `files` no checkpoints are kept. `timer_patience`: see Alive.
  ControlPlane(Store& store, std::unique_ptr<Cluster> cluster, std::unique_ptr<CheckpointFiles> files = nullptr,
               LeaderRights rights = {}, std::chrono::nanoseconds timer_patience = kTimerPatience);
  ~ControlPlane();

  // The machine's clocks, by which all its calls go.
  static Now ReadClocks();

  // Calls `action(Cluster&, Now)` under the lock; what it sets off goes out before the result comes back.
  template <class Action>
  auto Call(Action&& action) {
    const std::lock_guard lock(mutex_);
    auto result = action(*cluster_, ReadClocks());
    Publish();
    return result;
  }
  // The same for what anybody may ask who plays: operators and agents go first.
  template <class Action>
  auto CallOfPlayer(Action&& action) {
    const std::lock_guard lock(last_);
    auto result = action(*cluster_, ReadClocks());
    Publish();
    return result;
  }
  // Answers `question(const ClusterState&)`: of the cluster as it is, or, while a slow write holds it up, as it was
  // before that one.
  template <class Question>
  auto Ask(Question&& question) {
    if (!mutex_.try_lock_for(kQuestionPatience)) {
      if (const std::shared_ptr<const ClusterState> kept = picture()) return question(*kept);
      mutex_.lock();
    }
    const std::lock_guard lock(mutex_, std::adopt_lock);
    return question(cluster_->state());
  }
  // `look(const Cluster&)`; nothing while a slow write holds it up.
  template <class Look>
  auto Glance(Look&& look) -> std::optional<decltype(look(std::declval<const Cluster&>()))> {
    if (!mutex_.try_lock_for(kQuestionPatience)) return std::nullopt;
    const std::lock_guard lock(mutex_, std::adopt_lock);
    return look(std::as_const(*cluster_));
  }
  // Those who call at the doors that speak TLS, by their proofs. It waits for no call under way.
  std::shared_ptr<const KnownCallers> known_callers() const;
  // Requires the lock: the store is about to be written, and the last write took so long.
  void NoteWrite(std::chrono::nanoseconds last_took);

  // Plans and places; the scene is checked outside the lock.
  // `guests`: whether players may join without a ticket where the request does not say so.
  absl::StatusOr<v1::Instance> CreateInstance(const v1::CreateInstanceRequest& request, bool guests = true);
  // Gives `sink` the instance as it is, then after each change: a change of its state at once, others at most every
  // kWatchInterval. Ends with OK after ENDED, FAILED or when it is forgotten, or when `sink` returns false.
  absl::Status WatchInstance(const std::string& id, const std::function<bool(const v1::Instance&)>& sink,
                             const std::function<bool()>& given_up);
  // Waits until the body's owner has made the change and its standby knows of it. kDeadlineExceeded: nobody has said so
  // in kPropertyTimeout; it may come about still.
  absl::Status SetProperty(const v1::SetPropertyRequest& request, const std::function<bool()>& given_up);
  // Gives `sink` the events that the instance's game published after the one with this number, and each later one. Ends
  // with OK after the last one of an instance that has ended, when it is forgotten, or when `sink` returns false.
  absl::Status WatchGameEvents(const v1::WatchGameEventsRequest& request,
                               const std::function<bool(const v1::PublishedEvent&)>& sink,
                               const std::function<bool()>& given_up);
  // Waits until the target's record has the message and its standby knows of it. kDeadlineExceeded: nobody has said so
  // in kPropertyTimeout; it may come still, and is asked for again with its request id.
  absl::Status SendToGame(const v1::SendToGameRequest& request, const std::function<bool()>& given_up);
  // Checks the game with the instance's scene, outside the lock: it loads, and uses no name that the scene lacks.
  absl::StatusOr<v1::SetGameResponse> SetGame(const v1::SetGameRequest& request);
  // Waits until all workers are bound, then until they know of the player. `stranger`: as Cluster::TakeTicket takes it.
  absl::StatusOr<v1::JoinInstanceResponse> Join(const v1::JoinInstanceRequest& request,
                                                const std::function<bool()>& given_up,
                                                const std::optional<std::string>& stranger = std::nullopt);
  // The serialised scene, and a game's file. kNotFound unless a live instance uses it.
  absl::StatusOr<std::string> SceneBytes(const std::string& hash);
  absl::StatusOr<std::string> GameBytes(const std::string& hash);

  // --- Large scenes: see waiting_scenes.h.
  // Room for one that comes; ALREADY_EXISTS: a world can be made of it as it is.
  absl::StatusOr<WaitingScenes::Place> BeginScene(const std::string& hash, std::uint64_t size);
  // It has come, whole.
  absl::Status KeepScene(const WaitingScenes::Place& place, DraftFile draft);

  // `shown_serial`: as Hosts::Admit takes it.
  absl::StatusOr<std::shared_ptr<AgentStream>> Attach(const v1::AgentHello& hello, std::function<void()> cancel,
                                                      const std::string& shown_serial = "");
  void Detach(AgentStream& stream);
  // Waits for the next lease or desired set; nothing once the stream is over.
  std::optional<v1::ControlMessage> NextMessage(AgentStream& stream);
  absl::Status HandleAgentMessage(AgentStream& stream, const v1::AgentMessage& message);

  // --- Checkpoints.
  // A file for what comes in pieces. FAILED_PRECONDITION: this control plane keeps no checkpoints.
  absl::StatusOr<DraftFile> NewDraft() const;
  // RESOURCE_EXHAUSTED: the disk has no room for it beside the store's reserve.
  absl::Status AppendTo(DraftFile& draft, const std::string& piece) const;
  // Takes a region's file, whole. Errors are those of UploadCheckpoint.
  absl::Status TakeUpload(const v1::UploadCheckpointRequest& request, const DraftFile& file);
  absl::StatusOr<std::string> StateFile(const v1::FetchStateRequest& request);
  // Waits until the checkpoint is on the disk. A change of who runs what is waited for, too, for kCheckpointTimeout.
  absl::StatusOr<v1::Checkpoint> CheckpointInstance(const v1::CheckpointInstanceRequest& request,
                                                    const std::function<bool()>& given_up);
  absl::StatusOr<v1::RestoreInstanceResponse> RestoreInstance(const v1::RestoreInstanceRequest& request);
  // Waits until the world begins anew. DEADLINE_EXCEEDED: it did not come to stand; as with all errors it goes on.
  absl::StatusOr<v1::UpgradeInstanceResponse> UpgradeInstance(const v1::UpgradeInstanceRequest& request,
                                                              const std::function<bool()>& given_up);
  absl::StatusOr<std::string> ExportCheckpoint(const v1::ExportCheckpointRequest& request);
  // `guests`: whether players may join the instance without a ticket.
  absl::StatusOr<v1::Instance> ImportCheckpoint(const v1::ImportCheckpointRequest& request, const DraftFile& file,
                                                bool guests = true);

  // --- Files of meshes: see cluster/visuals.h.
  // Whether one of that name and size would be taken; ALREADY_EXISTS: it is there.
  absl::Status CheckPutVisual(const std::string& sha256, std::uint64_t size);
  // Keeps the file, whole or not at all. One that is there already is fine.
  absl::Status PutVisual(const std::string& sha256, const std::string& bytes);
  // NOT_FOUND: there is no such file.
  absl::StatusOr<std::uint64_t> VisualSize(const std::string& sha256);
  // kVisualStoredBytes from `at` on, a multiple of that; of the last piece what there is. UNAVAILABLE: it went away
  // meanwhile, or the store does not answer.
  absl::StatusOr<std::string> VisualPiece(const std::string& sha256, std::uint64_t at);

  // Worlds of which checkpoints were kept, and which the store did not know, when this began; 0 before they were looked
  // for. Their files stay.
  std::size_t stray_checkpoints() const { return stray_checkpoints_; }

  // The durations of the failovers that ended since the last call.
  std::vector<std::chrono::nanoseconds> TakeFailovers();

  Revision store_revision() const { return store_.revision(); }

  // False: the timer has stood still for its patience, and with it all that is due. Only a restart helps.
  bool Alive() const;
  // Why what is asked of this control plane is not done, in one line; empty: it is. Both wait for no call under way.
  std::string Trouble() const;

  // All that is stored, as backup.h has it.
  absl::Status Backup(const std::function<absl::Status(std::string_view)>& sink) const;
  // UNAVAILABLE while it is being found out what runs, after a restore from a backup.
  absl::Status CheckRecovered();
  // Ends all calls that wait, and every stream.
  void Stop();

 private:
  // Somebody who waits for an instance to change. It is made and ended under the lock.
  struct Watch {
    Watch(ControlPlane& plane, const std::string& id) : plane_(plane), place_(plane.watches_.emplace(id, this)) {}
    ~Watch() { plane_.watches_.erase(place_); }
    Watch(const Watch&) = delete;
    Watch& operator=(const Watch&) = delete;

    const std::string& id() const { return place_->first; }
    std::condition_variable_any wake;
    bool changed = false;

   private:
    ControlPlane& plane_;
    std::multimap<std::string, Watch*>::iterator place_;
  };
  using Lock = std::unique_lock<TurnLock>;
  using UrgentLock = std::unique_lock<UrgentTurn>;
  using LastLock = std::unique_lock<LastTurn>;

  void Publish();
  void PublishCallers();
  void RunTimer();
  void NoteTimer();
  void GiveLease(const AskedLeases::Asked& asked);
  std::shared_ptr<const ClusterState> picture() const;
  void LookForStrayCheckpoints();
  // The thread of all that waits for files and that no call waits for: removals, restores, and a look at the room.
  void RunFiles();
  struct PendingWork {
    std::vector<std::pair<std::string, std::uint64_t>> pruned, abandoned;
    std::vector<std::string> forgotten;
    std::set<std::string> restore, visuals;
    std::vector<std::string> scene_pieces;
    bool empty() const {
      return pruned.empty() && abandoned.empty() && forgotten.empty() && restore.empty() && visuals.empty() &&
             scene_pieces.empty();
    }
  };
  void DoPendingWork(PendingWork work);
  absl::Status WritePieces(const std::string& sha256, const std::string& bytes);
  absl::Status RemovePieces(const std::string& sha256);
  void RemoveVisual(const std::string& sha256);
  // A scene that is stored before an instance is made with it; the end of this object lets it go.
  class StagedScene {
   public:
    StagedScene(ControlPlane& plane, std::string hash) : plane_(plane), hash_(std::move(hash)) {}
    ~StagedScene();
    StagedScene(const StagedScene&) = delete;
    StagedScene& operator=(const StagedScene&) = delete;

   private:
    ControlPlane& plane_;
    const std::string hash_;
  };
  // Null: it is small, and is written with its instance. It is in the store on return, without the lock.
  absl::StatusOr<std::unique_ptr<StagedScene>> StageScene(const std::string& hash, const std::string& bytes);
  absl::Status WriteScenePieces(const std::vector<std::string>& keys, const std::string& bytes);
  void RemoveScenePieces(const std::vector<std::string>& keys);
  absl::Status KeepImported(const std::string& id, const BundleReader& bundle, Lock& lock);
  absl::StatusOr<std::string> ContentBytes(const std::string& key);
  absl::StatusOr<InstancePlan> PlanOfUploaded(const v1::CreateInstanceRequest& request, bool guests);
  // The scene and game of a checkpoint.
  absl::StatusOr<Contents> KeptContents(const std::string& id, const records::Manifest& manifest) const;
  absl::Status CompleteCheckpoint(const std::string& id, records::Manifest manifest);
  absl::StatusOr<records::Manifest> FindWhole(const std::string& id, std::uint64_t tick,
                                              std::vector<std::string>& damaged, std::uint64_t before = 0);
  absl::StatusOr<v1::RestoreInstanceResponse> RestoreBefore(const v1::RestoreInstanceRequest& request,
                                                            std::uint64_t before);
  // ABORTED: another one can be begun.
  absl::StatusOr<v1::Checkpoint> AwaitCheckpoint(Lock& lock, Watch& watch, std::uint64_t tick,
                                                 const std::function<bool()>& given_up);
  absl::StatusOr<std::uint64_t> AwaitUpgradeTick(const std::string& id, const std::function<bool()>& given_up);
  absl::StatusOr<v1::Instance> BeginAnew(const std::string& id, std::uint64_t tick,
                                         const std::function<bool()>& given_up);
  // Waits once, to be repeated: until the watch is woken, until `until`, or until it is time to ask whether anybody
  // still waits.
  template <class AnyLock>
  absl::Status WaitFor(AnyLock& lock, Watch& watch, std::chrono::steady_clock::time_point until,
                       const std::function<bool()>& given_up) {
    if (stopping_) return absl::UnavailableError("the control plane is ending");
    if (given_up()) return absl::CancelledError("the caller has given up");
    watch.wake.wait_until(lock, std::min(until, std::chrono::steady_clock::now() + kGivenUpInterval));
    return absl::OkStatus();
  }
  absl::Status WaitForChange(Lock& lock, Watch& watch, v1::InstanceState last_seen,
                             const std::function<bool()>& given_up);
  absl::Status CheckTicketsSignature(const std::string& ticket);
  absl::StatusOr<Joined> WaitAndJoin(LastLock& lock, Watch& watch, const v1::JoinInstanceRequest& request,
                                     const std::optional<trust::Ticket>& ticket, bool stranger,
                                     const std::function<bool()>& given_up);

  Store& store_;
  const LeaderRights rights_;
  const std::chrono::nanoseconds timer_patience_;
  TurnLock mutex_;
  UrgentTurn urgent_{mutex_};
  LastTurn last_{mutex_};
  std::unique_ptr<Cluster> cluster_;
  std::unique_ptr<CheckpointFiles> files_;
  PendingWork pending_;
  WaitingScenes waiting_scenes_{kWaitingScenesBytes, kWaitingSceneGrace};
  std::mutex uploads_mutex_;         // held by the one who has an upload in memory
  std::mutex visual_mutex_;          // held by who writes or removes pieces of a file; before mutex_
  std::mutex scene_mutex_;           // held by who writes pieces of a scene; before mutex_
  std::set<std::string> importing_;  // instances whose files are being kept
  std::map<StreamId, std::shared_ptr<AgentStream>> streams_;
  std::multimap<std::string, Watch*> watches_;
  // Trouble and Alive read these without the lock: a lock that is never given back is a fault that they are to find.
  std::atomic<std::int64_t> last_timer_{0};  // Steady, in nanoseconds
  std::atomic<std::size_t> stray_checkpoints_{0};
  mutable std::mutex kept_mutex_;  // guards what follows, up to the empty line; after mutex_
  std::string store_trouble_;
  std::shared_ptr<const ClusterState> picture_;  // while writes are slow: from before the last one
  std::shared_ptr<const KnownCallers> known_callers_;
  std::vector<std::chrono::nanoseconds> failovers_;

  std::uint64_t callers_shown_ = 0;  // ClusterState::access_changes of known_callers_; 0: there is none yet
  bool stopping_ = false;
  std::condition_variable_any stop_, files_wake_;
  std::thread timer_, files_thread_;
  std::unique_ptr<LeaseProof> lease_proof_;  // null: none is needed. The first to end, as it uses the others
};

}  // namespace tessera::control
