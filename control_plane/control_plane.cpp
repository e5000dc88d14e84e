#include "control_plane/control_plane.h"

#include <spdlog/spdlog.h>

#include "absl/strings/str_cat.h"
#include "control_plane/orders.h"

namespace tessera::control {
namespace {

using Clock = std::chrono::steady_clock;

// How often a waiting call asks whether anybody still waits for its answer.
constexpr std::chrono::milliseconds kGivenUpInterval{200};

}  // namespace

ControlPlane::ControlPlane(Store& store, std::unique_ptr<Cluster> cluster, std::unique_ptr<CheckpointFiles> files)
    : store_(store), cluster_(std::move(cluster)), files_(std::move(files)) {
  {
    const std::lock_guard lock(mutex_);
    Publish();
  }
  timer_ = std::thread([this] { RunTimer(); });
}

ControlPlane::~ControlPlane() {
  Stop();
  timer_.join();
}

Moment ControlPlane::Now() {
  return {Clock::now().time_since_epoch(), std::chrono::system_clock::now().time_since_epoch()};
}

// Under the lock.
void ControlPlane::Publish() {
  Effects effects = cluster_->TakeEffects();
  for (const std::string& line : effects.log) spdlog::info("{}", OneLine(line, 2 * kMaxReasonBytes));
  for (const SessionId id : effects.desired) {
    if (const auto found = sessions_.find(id); found != sessions_.end()) {
      found->second->desired = true;
      found->second->wake.notify_all();
    }
  }
  chores_.pruned.insert(chores_.pruned.end(), effects.pruned.begin(), effects.pruned.end());
  chores_.abandoned.insert(chores_.abandoned.end(), effects.abandoned.begin(), effects.abandoned.end());
  chores_.forgotten.insert(chores_.forgotten.end(), effects.forgotten.begin(), effects.forgotten.end());
  chores_.restore.insert(effects.restore.begin(), effects.restore.end());
  failovers_.insert(failovers_.end(), effects.failovers.begin(), effects.failovers.end());
  for (auto& [id, renewal] : effects.leases) {
    if (const auto found = sessions_.find(id); found != sessions_.end()) {
      found->second->leases.push_back(std::move(renewal));
      found->second->wake.notify_all();
    }
  }
  for (const auto& [id, status] : effects.closed) {
    if (const auto found = sessions_.find(id); found != sessions_.end()) {
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

std::vector<std::chrono::nanoseconds> ControlPlane::TakeFailovers() {
  const std::lock_guard lock(mutex_);
  return std::exchange(failovers_, {});
}

void ControlPlane::RunTimer() {
  Lock lock(mutex_);
  while (!stop_.wait_for(lock, kTimerInterval, [this] { return stopping_; })) {
    cluster_->HandleTimer(Now());
    Publish();
    Chores chores = std::exchange(chores_, {});
    lock.unlock();
    DoChores(std::move(chores));
    lock.lock();
  }
}

void ControlPlane::Stop() {
  const std::lock_guard lock(mutex_);
  stopping_ = true;
  stop_.notify_all();
  for (const auto& [id, watch] : watches_) watch->wake.notify_all();
  for (const auto& [id, session] : sessions_) {
    session->closed = absl::UnavailableError("the control plane is ending");
    session->wake.notify_all();
    session->cancel();
  }
}

// --- Instances
// --------------------------------------------------------------------------------------------------------

absl::StatusOr<v1::Instance> ControlPlane::CreateInstance(const v1::CreateInstanceRequest& request) {
  if (!request.request_id().empty()) {
    auto made = Call([&](Cluster& cluster, Moment) { return cluster.FindByRequestId(request.request_id()); });
    if (made.ok()) return made;
  }
  const auto plan = PlanInstance(request);
  if (!plan.ok()) return plan.status();
  return Call(
      [&](Cluster& cluster, Moment now) { return cluster.CreateInstance(now, *plan, request.validate_only()); });
}

// One wait, to be repeated: until the watch is woken, `until`, or it is time to ask whether anybody still waits.
absl::Status ControlPlane::WaitFor(Lock& lock, Watch& watch, Clock::time_point until,
                                   const std::function<bool()>& given_up) {
  if (stopping_) return absl::UnavailableError("the control plane is ending");
  if (given_up()) return absl::CancelledError("the caller has given up");
  watch.wake.wait_until(lock, std::min(until, Clock::now() + kGivenUpInterval));
  return absl::OkStatus();
}

absl::Status ControlPlane::WaitForNews(Lock& lock, Watch& watch, v1::InstanceState shown,
                                       const std::function<bool()>& given_up) {
  const Clock::time_point due = Clock::now() + kWatchInterval;
  while (true) {
    if (watch.changed && (Clock::now() >= due || cluster_->StateOf(watch.id()) != shown)) return absl::OkStatus();
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
    const auto instance = cluster_->GetInstance(id);
    if (!instance.ok()) return first ? instance.status() : absl::OkStatus();
    lock.unlock();
    const bool more = sink(*instance);
    lock.lock();
    if (!more || IsFinal(instance->state())) return absl::OkStatus();
    if (absl::Status status = WaitForNews(lock, watch, instance->state(), given_up); !status.ok()) return status;
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
          absl::StrCat("body: no region has answered for body ", request.body(), "; it may have left the world"));
    } else if (absl::Status status = WaitFor(lock, watch, patience, given_up); !status.ok()) {
      outcome = status;
    }
    if (outcome) break;
  }
  cluster_->ForgetProperty(request.id(), *number);
  Publish();
  return *outcome;
}

absl::StatusOr<std::string> ControlPlane::SceneBytes(const std::string& hash) {
  const bool used = Call([&](Cluster& cluster, Moment) { return cluster.SceneInUse(hash); });
  // Read outside the lock: it can be large.
  const auto entry = used ? store_.Get(SceneKey(hash)) : absl::NotFoundError("");
  if (absl::IsNotFound(entry.status())) {
    return absl::NotFoundError(absl::StrCat("scene_hash: no instance uses scene ", OneLine(hash, kMaxNameBytes + 1)));
  }
  if (!entry.ok()) return entry.status();
  return entry->value;
}

// --- Players
// ----------------------------------------------------------------------------------------------------------

absl::StatusOr<Cluster::Joined> ControlPlane::WaitAndJoin(Lock& lock, Watch& watch,
                                                          const v1::JoinInstanceRequest& request,
                                                          const std::function<bool()>& given_up) {
  while (true) {
    const absl::StatusOr<bool> ready = cluster_->CanJoin(request.instance_id());
    if (!ready.ok()) return ready.status();
    if (*ready) return cluster_->Join(Now(), request);
    if (absl::Status status = WaitFor(lock, watch, Clock::time_point::max(), given_up); !status.ok()) return status;
  }
}

absl::StatusOr<v1::JoinInstanceResponse> ControlPlane::Join(const v1::JoinInstanceRequest& request,
                                                            const std::function<bool()>& given_up) {
  Lock lock(mutex_);
  Watch watch(*this, request.instance_id());
  absl::Status begun = cluster_->BeginWait(Now(), request);
  Publish();
  if (!begun.ok()) return begun;
  const auto joined = WaitAndJoin(lock, watch, request, given_up);
  cluster_->EndWait(Now(), request.instance_id());
  Publish();
  if (!joined.ok()) return joined.status();

  // A region that has not heard of the player would refuse it.
  const Clock::time_point patience = Clock::now() + kPlayerKnownTimeout;
  while (!cluster_->AllKnow(request.instance_id(), joined->mark) && Clock::now() < patience) {
    if (!WaitFor(lock, watch, patience, given_up).ok()) break;
  }
  return joined->response;
}

// --- Agents
// -----------------------------------------------------------------------------------------------------------

absl::StatusOr<std::shared_ptr<ControlPlane::Session>> ControlPlane::Attach(const v1::AgentHello& hello,
                                                                            std::function<void()> cancel) {
  const std::lock_guard lock(mutex_);
  if (stopping_) return absl::UnavailableError("the control plane is ending");
  const auto admission = cluster_->HandleHello(Now(), hello);
  if (!admission.ok()) {
    Publish();
    return admission.status();
  }
  auto session = std::make_shared<Session>();
  session->id = admission->session;
  session->admitted = admission->admitted;
  session->cancel = std::move(cancel);
  sessions_[session->id] = session;
  Publish();
  return session;
}

void ControlPlane::Detach(Session& session) {
  const std::lock_guard lock(mutex_);
  cluster_->HandleAgentGone(Now(), session.id);
  if (!session.closed) session.closed = absl::CancelledError("the agent has gone");
  session.wake.notify_all();
  sessions_.erase(session.id);
  Publish();
}

std::optional<v1::ControlMessage> ControlPlane::NextMessage(Session& session) {
  Lock lock(mutex_);
  v1::ControlMessage message;
  while (true) {
    session.wake.wait(lock, [&session] { return session.desired || session.closed || !session.leases.empty(); });
    if (session.closed) return std::nullopt;
    if (!session.leases.empty()) {
      message.mutable_lease()->Swap(&session.leases.front());
      session.leases.pop_front();
      return message;
    }
    session.desired = false;
    std::optional<v1::DesiredSet> desired = cluster_->TakeDesired(Now(), session.id);
    Publish();
    if (!desired) continue;
    message.mutable_desired()->Swap(&*desired);
    return message;
  }
}

absl::Status ControlPlane::HandleAgentMessage(Session& session, const v1::AgentMessage& message) {
  return Call([&](Cluster& cluster, Moment now) { return cluster.HandleAgentMessage(now, session.id, message); });
}

}  // namespace tessera::control
