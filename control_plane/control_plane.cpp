#include "control_plane/control_plane.h"

#include <spdlog/spdlog.h>

#include "absl/strings/str_cat.h"
#include "control_plane/backup.h"
#include "control_plane/cluster/queries.h"
#include "control_plane/instance_plan.h"
#include "control_plane/one_line.h"
#include "core/world/scene_load.h"
#include "game_sdk/tools/check.h"

namespace tessera::control {
namespace {

using Clock = std::chrono::steady_clock;

// How often it is looked how much room checkpoints have.
constexpr std::chrono::milliseconds kRoomInterval{1000};

// A game of another scene loads, and fails callback by callback: names that this scene lacks are refused by file and
// line, INVALID_ARGUMENT.
absl::Status CheckNames(const v1::GameSource& source, const Scene& scene) {
  const std::vector<game::GameFault> faults = game::CheckGame({source.name(), source.content()}, scene);
  if (faults.empty()) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrCat(source.name(), ":", faults.front().line, ": ", faults.front().text,
                   faults.size() > 1 ? absl::StrCat(" (and ", faults.size() - 1, " more)") : ""));
}

}  // namespace

ControlPlane::ControlPlane(Store& store, std::unique_ptr<Cluster> cluster, std::unique_ptr<CheckpointFiles> files,
                           LeaderRights rights, std::chrono::nanoseconds timer_patience)
    : store_(store),
      rights_(std::move(rights)),
      timer_patience_(timer_patience),
      cluster_(std::move(cluster)),
      files_(std::move(files)) {
  {
    const std::lock_guard lock(mutex_);
    Publish();
  }
  last_timer_ = Steady(ReadClocks().steady).count();
  timer_ = std::thread([this] { RunTimer(); });
  files_thread_ = std::thread([this] { RunFiles(); });
  if (rights_.proves_lead) {
    lease_proof_ = std::make_unique<LeaseProof>(rights_.proves_lead,
                                                [this](const AskedLeases::Asked& asked) { GiveLease(asked); });
  }
}

ControlPlane::~ControlPlane() {
  Stop();
  timer_.join();
  files_thread_.join();
}

Now ControlPlane::ReadClocks() {
  return {Clock::now().time_since_epoch(), std::chrono::system_clock::now().time_since_epoch()};
}

// Hands out what the last call set off. Requires the lock.
void ControlPlane::Publish() {
  PublishCallers();
  Effects effects = cluster_->TakeEffects();
  for (const LogLine& line : effects.log) {
    const auto level = line.severity == Severity::kError     ? spdlog::level::err
                       : line.severity == Severity::kWarning ? spdlog::level::warn
                                                             : spdlog::level::info;
    spdlog::log(level, "{}", OneLine(line.text, 2 * kMaxReasonBytes));
  }
  for (const StreamId id : effects.desired) {
    if (const auto found = streams_.find(id); found != streams_.end()) {
      found->second->desired = true;
      found->second->wake.notify_all();
    }
  }
  pending_.pruned.insert(pending_.pruned.end(), effects.pruned.begin(), effects.pruned.end());
  pending_.abandoned.insert(pending_.abandoned.end(), effects.abandoned.begin(), effects.abandoned.end());
  pending_.forgotten.insert(pending_.forgotten.end(), effects.forgotten.begin(), effects.forgotten.end());
  pending_.restore.insert(effects.restore.begin(), effects.restore.end());
  pending_.visuals.insert(effects.visuals.begin(), effects.visuals.end());
  pending_.scene_pieces.insert(pending_.scene_pieces.end(), effects.scene_pieces.begin(), effects.scene_pieces.end());
  if (!pending_.empty()) files_wake_.notify_all();
  if (!effects.failovers.empty()) {
    const std::lock_guard kept(kept_mutex_);
    failovers_.insert(failovers_.end(), effects.failovers.begin(), effects.failovers.end());
  }
  for (auto& [id, renewal] : effects.leases) {
    if (const auto found = streams_.find(id); found != streams_.end()) {
      found->second->leases.Put(std::move(renewal));
      found->second->wake.notify_all();
    }
  }
  for (const auto& [id, status] : effects.closed) {
    if (const auto found = streams_.find(id); found != streams_.end()) {
      found->second->closed = status;
      found->second->wake.notify_all();
      found->second->cancel();
    }
  }
  for (const std::string& id : effects.instances) {
    const auto [first, last] = watches_.equal_range(id);
    for (auto it = first; it != last; ++it) {
      it->second->changed = true;
      it->second->wake.notify_all();
    }
  }
}

// Before whoever changed it is answered: a token that was revoked is known to no call that begins after that.
void ControlPlane::PublishCallers() {
  const std::uint64_t changes = cluster_->state().access_changes();
  if (std::exchange(callers_shown_, changes) == changes) return;
  std::shared_ptr<const KnownCallers> made =
      std::make_shared<const KnownCallers>(cluster_->state(), cluster_->tokens());
  const std::lock_guard kept(kept_mutex_);
  known_callers_.swap(made);
}

std::shared_ptr<const KnownCallers> ControlPlane::known_callers() const {
  const std::lock_guard kept(kept_mutex_);
  return known_callers_;
}

std::vector<std::chrono::nanoseconds> ControlPlane::TakeFailovers() {
  const std::lock_guard kept(kept_mutex_);
  return std::exchange(failovers_, {});
}

void ControlPlane::RunTimer() {
  UrgentLock lock(urgent_);
  // Each instance may need a write: whoever waits has a turn after one.
  const auto between = [&] {
    if (mutex_.waiting() > 0) {
      Publish();
      lock.unlock();
      lock.lock();
    }
    return ReadClocks();
  };
  while (!stop_.wait_for(lock, kTimerInterval, [this] { return stopping_; })) {
    cluster_->HandleTimer(ReadClocks(), between);
    Publish();
    NoteTimer();
  }
}

void ControlPlane::NoteWrite(std::chrono::nanoseconds last_took) {
  std::shared_ptr<const ClusterState> made;
  if (last_took >= kSlowWrite) made = cluster_->state().Picture();
  const std::lock_guard kept(kept_mutex_);
  picture_.swap(made);
}

std::shared_ptr<const ClusterState> ControlPlane::picture() const {
  const std::lock_guard kept(kept_mutex_);
  return picture_;
}

void ControlPlane::RunFiles() {
  if (files_) LookForStrayCheckpoints();
  Lock lock(mutex_);
  while (!stopping_) {
    files_wake_.wait_for(lock, kRoomInterval, [this] { return stopping_ || !pending_.empty(); });
    if (stopping_) return;
    PendingWork work = std::exchange(pending_, {});
    lock.unlock();
    DoPendingWork(std::move(work));
    waiting_scenes_.Sweep(ReadClocks().steady);
    const absl::Status room = files_ ? files_->CheckRoom(0) : absl::OkStatus();
    lock.lock();
    cluster_->SetCheckpointTrouble(std::string(room.message()));
    Publish();
  }
}

void ControlPlane::NoteTimer() {
  last_timer_ = ReadClocks().steady.count();
  const std::lock_guard kept(kept_mutex_);
  store_trouble_ = cluster_->state().store_trouble();
}

bool ControlPlane::Alive() const { return ReadClocks().steady - Steady(last_timer_.load()) < timer_patience_; }

std::string ControlPlane::Trouble() const {
  if (!Alive()) return "the timer stands still: nothing that is due happens";
  const std::lock_guard kept(kept_mutex_);
  return store_trouble_.empty() ? "" : "the store cannot be written: " + store_trouble_;
}

void ControlPlane::Stop() {
  const std::lock_guard lock(mutex_);
  stopping_ = true;
  stop_.notify_all();
  files_wake_.notify_all();
  if (files_) files_->Stop();
  for (const auto& [id, watch] : watches_) watch->wake.notify_all();
  for (const auto& [id, stream] : streams_) {
    stream->closed = absl::UnavailableError("the control plane is ending");
    stream->wake.notify_all();
    stream->cancel();
  }
}

absl::Status ControlPlane::Backup(const std::function<absl::Status(std::string_view)>& sink) const {
  return WriteBackup(store_, sink);
}

absl::Status ControlPlane::CheckRecovered() {
  const bool recovering = Call([](Cluster& cluster, Now) { return cluster.state().recovering(); });
  if (!recovering) return absl::OkStatus();
  return absl::UnavailableError(
      "the cluster was restored from a backup, or lacks records, and takes up what runs; try again in a few seconds");
}

// --- Instances.

absl::StatusOr<v1::Instance> ControlPlane::CreateInstance(const v1::CreateInstanceRequest& request, bool guests) {
  if (!request.request_id().empty()) {
    auto made = Call([&](Cluster& cluster, Now) { return GetByRequestId(cluster.state(), request.request_id()); });
    if (made.ok()) return made;
  }
  const auto plan =
      request.spec().scene_file().empty() ? PlanInstance(request, guests) : PlanOfUploaded(request, guests);
  if (!plan.ok()) return plan.status();
  if (request.spec().has_game()) {
    if (absl::Status status = CheckNames(request.spec().game(), *plan->scene); !status.ok()) return status;
  }
  std::unique_ptr<StagedScene> staged;
  if (!request.validate_only()) {
    auto stored = StageScene(plan->scene_hash, plan->contents.scene);
    if (!stored.ok()) return stored.status();
    staged = *std::move(stored);
  }
  return Call([&](Cluster& cluster, Now now) { return cluster.CreateInstance(now, *plan, request.validate_only()); });
}

absl::Status ControlPlane::WaitForChange(Lock& lock, Watch& watch, v1::InstanceState last_seen,
                                         const std::function<bool()>& given_up) {
  const Clock::time_point due = Clock::now() + kWatchInterval;
  while (true) {
    if (watch.changed && (Clock::now() >= due || StateOf(cluster_->state(), watch.id()) != last_seen))
      return absl::OkStatus();
    const Clock::time_point until = watch.changed ? due : Clock::time_point::max();
    if (absl::Status status = WaitFor(lock, watch, until, given_up); !status.ok()) return status;
  }
}

absl::Status ControlPlane::WatchInstance(const std::string& id, const std::function<bool(const v1::Instance&)>& sink,
                                         const std::function<bool()>& given_up) {
  Lock lock(mutex_);
  Watch watch(*this, id);
  for (bool first = true;; first = false) {
    watch.changed = false;
    const auto instance = GetInstance(cluster_->state(), id);
    if (!instance.ok()) return first ? instance.status() : absl::OkStatus();
    lock.unlock();
    const bool more = sink(*instance);
    lock.lock();
    if (!more || IsFinal(instance->state())) return absl::OkStatus();
    if (absl::Status status = WaitForChange(lock, watch, instance->state(), given_up); !status.ok()) return status;
  }
}

absl::Status ControlPlane::SetProperty(const v1::SetPropertyRequest& request, const std::function<bool()>& given_up) {
  Lock lock(mutex_);
  Watch watch(*this, request.id());
  const auto number = cluster_->SetProperty(request);
  Publish();
  if (!number.ok() || *number == 0) return number.status();
  const Clock::time_point patience = Clock::now() + kPropertyTimeout;
  std::optional<absl::Status> outcome;
  while (!(outcome = cluster_->PropertyOutcome(request.id(), *number)).has_value()) {
    if (Clock::now() >= patience) {
      outcome = absl::DeadlineExceededError(
          request.body() == 0
              ? std::string("body: no region has answered for the world's record")
              : absl::StrCat("body: no region has answered for body ", request.body(), "; it may have left the world"));
    } else if (absl::Status status = WaitFor(lock, watch, patience, given_up); !status.ok()) {
      outcome = status;
    }
    if (outcome) break;
  }
  cluster_->ForgetProperty(request.id(), *number);
  Publish();
  return *outcome;
}

absl::Status ControlPlane::WatchGameEvents(const v1::WatchGameEventsRequest& request,
                                           const std::function<bool(const v1::PublishedEvent&)>& sink,
                                           const std::function<bool()>& given_up) {
  Lock lock(mutex_);
  Watch watch(*this, request.id());
  std::uint64_t after = request.after();
  for (bool first = true;; first = false) {
    watch.changed = false;
    const auto events = cluster_->GameEventsAfter(request.id(), after);
    if (!events.ok()) return absl::IsNotFound(events.status()) && !first ? absl::OkStatus() : events.status();
    if (!events->empty()) {
      lock.unlock();
      for (const v1::PublishedEvent& event : *events) {
        if (!sink(event)) return absl::OkStatus();
      }
      after = events->back().number();
      lock.lock();
      continue;
    }
    const auto state = StateOf(cluster_->state(), request.id());
    if (!state || IsFinal(*state)) return absl::OkStatus();
    while (!watch.changed) {
      if (absl::Status status = WaitFor(lock, watch, Clock::time_point::max(), given_up); !status.ok()) return status;
    }
  }
}

absl::Status ControlPlane::SendToGame(const v1::SendToGameRequest& request, const std::function<bool()>& given_up) {
  Lock lock(mutex_);
  Watch watch(*this, request.id());
  const auto number = cluster_->SendToGame(ReadClocks(), request);
  Publish();
  if (!number.ok() || *number == 0) return number.status();
  const Clock::time_point patience = Clock::now() + kPropertyTimeout;
  while (true) {
    if (const auto outcome = cluster_->GameMessageOutcome(request.id(), *number)) return *outcome;
    if (Clock::now() >= patience) {
      return absl::DeadlineExceededError(
          "target: no region has answered yet; the message may still come, ask again with the same request_id");
    }
    if (absl::Status status = WaitFor(lock, watch, patience, given_up); !status.ok()) return status;
  }
}

absl::StatusOr<v1::SetGameResponse> ControlPlane::SetGame(const v1::SetGameRequest& request) {
  const auto instance =
      Call([&](Cluster& cluster, Now) { return control::GetInstance(cluster.state(), request.id()); });
  if (!instance.ok()) return instance.status();
  const auto bytes = SceneBytes(instance->scene_hash());
  if (!bytes.ok()) return bytes.status();
  const auto scene = LoadScene(SceneForm::kSerialised, *bytes, "scene");
  if (!scene.ok()) return scene.status();
  const auto hash = CheckGame(request.game(), "game", scene->scene);
  if (!hash.ok()) return hash.status();
  if (absl::Status status = CheckNames(request.game(), *scene->scene); !status.ok()) return status;
  auto changed = Call([&](Cluster& cluster, Now now) { return cluster.SetGame(now, request, *hash); });
  if (!changed.ok()) return changed.status();
  v1::SetGameResponse response;
  *response.mutable_instance() = *std::move(changed);
  response.set_game_hash(*hash);
  return response;
}

absl::StatusOr<std::string> ControlPlane::ContentBytes(const std::string& key) {
  const bool used = Call([&](Cluster& cluster, Now) { return cluster.state().ContentInUse(key); });
  // It is read outside the lock because it can be large.
  return used ? ReadContent(store_, key) : absl::NotFoundError("");
}

absl::StatusOr<std::string> ControlPlane::SceneBytes(const std::string& hash) {
  auto bytes = ContentBytes(SceneKey(hash));
  if (!absl::IsNotFound(bytes.status())) return bytes;
  return absl::NotFoundError(absl::StrCat("scene_hash: no instance uses scene ", OneLine(hash, kMaxNameBytes + 1)));
}

absl::StatusOr<std::string> ControlPlane::GameBytes(const std::string& hash) {
  auto bytes = ContentBytes(GameKey(hash));
  if (!absl::IsNotFound(bytes.status())) return bytes;
  return absl::NotFoundError(absl::StrCat("game_hash: no instance runs game ", OneLine(hash, kMaxNameBytes + 1)));
}

// --- Players.

absl::StatusOr<Joined> ControlPlane::WaitAndJoin(LastLock& lock, Watch& watch, const v1::JoinInstanceRequest& request,
                                                 const std::optional<trust::Ticket>& ticket, bool stranger,
                                                 const std::function<bool()>& given_up) {
  while (true) {
    const absl::StatusOr<bool> ready = CanJoin(cluster_->state(), request.instance_id(), request.viewer());
    if (!ready.ok()) return ready.status();
    if (*ready) return cluster_->Join(ReadClocks(), request, ticket, stranger);
    if (absl::Status status = WaitFor(lock, watch, Clock::time_point::max(), given_up); !status.ok()) return status;
  }
}

// Once more under the lock, where the issuer may have been removed since: those who sign well pay for both.
absl::Status ControlPlane::CheckTicketsSignature(const std::string& ticket) {
  if (ticket.empty()) return absl::OkStatus();
  const auto shown = trust::ParseTicket(ticket);
  if (!shown.ok()) return shown.status();
  const std::optional<records::Issuer> issuer =
      CallOfPlayer([&](Cluster& cluster, Now) -> std::optional<records::Issuer> {
        const records::Issuer* found = cluster.issuers().Find(shown->ticket.key);
        return found == nullptr ? std::nullopt : std::optional(*found);
      });
  return CheckSignature(*shown, issuer ? &*issuer : nullptr);
}

absl::StatusOr<v1::JoinInstanceResponse> ControlPlane::Join(const v1::JoinInstanceRequest& request,
                                                            const std::function<bool()>& given_up,
                                                            const std::optional<std::string>& stranger) {
  // Whoever joined a record that is about to be replaced would be forgotten with it, and so would a ticket's use.
  if (absl::Status status = CheckRecovered(); !status.ok()) return status;
  if (absl::Status status = CheckTicketsSignature(request.ticket()); !status.ok()) return status;
  LastLock lock(last_);
  Watch watch(*this, request.instance_id());
  const auto ticket = cluster_->TakeTicket(ReadClocks(), request, stranger);
  if (!ticket.ok()) return ticket.status();
  absl::Status begun = cluster_->BeginWait(ReadClocks(), request);
  Publish();
  if (!begun.ok()) return begun;
  const auto joined = WaitAndJoin(lock, watch, request, *ticket, stranger.has_value(), given_up);
  if (!request.viewer()) cluster_->EndWait(ReadClocks(), request.instance_id());
  Publish();
  if (!joined.ok()) return joined.status();

  // A region that has not heard of the player would refuse it.
  const Clock::time_point patience = Clock::now() + kPlayerKnownTimeout;
  while (!AllKnow(cluster_->state(), request.instance_id(), joined->mark) && Clock::now() < patience) {
    if (!WaitFor(lock, watch, patience, given_up).ok()) break;
  }
  return joined->response;
}

}  // namespace tessera::control
