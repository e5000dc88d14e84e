#include "tests/simulation/simulated_control.h"

#include <algorithm>
#include <optional>

#include "control_plane/branches.h"
#include "control_plane/checkpoint_files.h"

namespace tessera::simulation {
namespace {

template <class Message>
Bytes Packed(const Message& message) {
  const std::string text = message.SerializeAsString();
  return {text.begin(), text.end()};
}

}  // namespace

SimulatedControl::SimulatedControl(Timeline& timeline, VirtualNetwork& network, SimulatedStore& shared,
                                   std::uint64_t seed, std::uint32_t number, bool several)
    : timeline_(timeline),
      network_(network),
      shared_(shared),
      chance_(seed),
      number_(number),
      several_(several),
      store_(shared) {
  network_.SetPlace(node(), PlaceOfControl(number_));
  network_.SetPlace(kStoreNode, kStorePlace);
  store_.reaches = [this] { return ReachesStore(); };
}

control::Now SimulatedControl::Now() const {
  const std::chrono::microseconds now(timeline_.now());
  return {std::chrono::hours(1) + now, std::chrono::hours(24 * 365 * 50) + now + clock_moved_};
}

std::string SimulatedControl::Random(std::size_t bytes) {
  std::string text(bytes, '\0');
  for (char& byte : text) byte = static_cast<char>(chance_.Next());
  return text;
}

// --- Its life.

void SimulatedControl::Start() {
  running_ = true;
  if (several_) return Follow();
  Lead(0);
}

void SimulatedControl::Lead(std::int64_t token) {
  ++life_;
  writing_until_ = 0;
  token_ = token;
  store_.Begin(token);
  auto cluster = control::Cluster::Load(
      store_, {}, [this](std::size_t bytes) { return Random(bytes); }, Now());
  if (!cluster.ok()) {
    log_.push_back("cannot lead: " + std::string(cluster.status().message()));
    if (several_) return StepDown();
    return timeline_.In(kElectionPoll, [this, life = life_] {
      if (running_ && life == life_) Lead(0);
    });
  }
  cluster_ = *std::move(cluster);
  network_.Join(node(), {.on_connected = [](Node) {},
                         .on_disconnected = [this](Node agent) { Disconnected(agent); },
                         .on_message = [this](Node from, const Bytes& bytes) { OnMessage(from, bytes); },
                         .on_datagram = {}});
  if (several_) WatchElection();
  Publish();
  Tick();
}

// Drops all that was loaded, and all that it waited for.
void SimulatedControl::Drop() {
  ++life_;
  cluster_.reset();
  unsent_.clear();
  asked_leases_ = {};
  writing_until_ = 0;
  BreakAll(std::exchange(sessions_, {}));
  network_.Leave(node());
}

// Whoever is cut off learns of it by silence.
void SimulatedControl::BreakAll(const std::map<Node, control::StreamId>& sessions) {
  for (const auto& [agent, session] : sessions) {
    if (!network_.IsCut(agent, node())) network_.Break(agent, node());
  }
}

// The kernel closes its connections.
void SimulatedControl::Kill() {
  running_ = stopped_ = look_is_due_ = false;
  Drop();
}

void SimulatedControl::SetStopped(bool stopped) {
  if (!running_ || stopped == stopped_) return;
  stopped_ = stopped;
  ++stops_;
  const std::uint64_t life = life_;
  if (!stopped) {
    for (const control::Effects& effects : std::exchange(unsent_, {})) SetOff(effects);
  }
  UpdateStall();
  // The worst order: all that waited comes before the look at the clock that says who leads.
  if (!stopped && life == life_ && std::exchange(look_is_due_, false)) LookAtElection();
}

void SimulatedControl::BeginFrom(const std::string& backup) {
  Kill();
  if (!shared_.BeginFrom(backup)) log_.push_back("the backup cannot be restored");
  Start();
}

void SimulatedControl::Tick() {
  timeline_.In(std::chrono::microseconds(control::kTimerInterval).count(), [this, life = life_] {
    if (!alive() || life != life_) return;
    network_.InProcess(node(), [this, life] {
      if (!alive() || life != life_) return;
      cluster_->HandleTimer(Now());
      Publish();
      if (alive() && life == life_) Tick();
    });
  });
}

void SimulatedControl::Publish() {
  if (store_.dead()) {
    Kill();
    if (on_died) on_died();
    return;
  }
  control::Effects effects = cluster_->TakeEffects();
  const Micros now = timeline_.now();
  writing_until_ = std::max(writing_until_, now) + store_.TakeWriteTime();
  if (writing_until_ <= now) {
    SetOff(effects);
    if (alive() && store_.lost()) EndReign("a write was refused");
    return;
  }
  UpdateStall();
  timeline_.At(writing_until_, [this, life = life_, effects = std::move(effects)] {
    if (!alive() || life != life_) return;
    if (stopped_) {
      unsent_.push_back(effects);
    } else {
      SetOff(effects);
    }
    if (writing()) return;
    UpdateStall();
    if (!alive() || life != life_ || !(store_.lost() || deposed_)) return;
    network_.InProcess(node(), [this, life] {
      if (life == life_) StepDown();
    });
  });
}

void SimulatedControl::SetOff(const control::Effects& effects) {
  for (const control::LogLine& line : effects.log) log_.push_back(line.text);
  for (const auto& [id, tick] : effects.pruned) shared_.checkpoints().erase(tick);
  for (const auto& [id, tick] : effects.abandoned) {
    auto& checkpoints = shared_.checkpoints();
    if (const auto found = checkpoints.find(tick); found != checkpoints.end() && !found->second.whole) {
      checkpoints.erase(found);
    }
  }
  for (const auto& [session, renewal] : effects.leases) {
    v1::ControlMessage message;
    *message.mutable_lease() = renewal;
    SendTo(session, message);
  }
  for (const control::StreamId session : effects.desired) SendDesired(session);
  for (const auto& [session, status] : effects.closed) {
    for (const auto& [agent, open] : std::map(sessions_)) {
      if (open == session) network_.Break(agent, node());
    }
  }
  for (const std::string& id : effects.restore) {
    timeline_.In(1000, [this, id, life = life_] {
      if (alive() && life == life_) Restore(id);
    });
  }
}

// --- Agents.

void SimulatedControl::SendTo(control::StreamId session, const v1::ControlMessage& message) {
  if (!MaySend()) return;  // whoever was deposed may hold orders that the new leader has replaced
  for (const auto& [agent, open] : sessions_) {
    if (open == session) (void)network_.Send(node(), agent, Packed(message));
  }
}

void SimulatedControl::SendDesired(control::StreamId session) {
  if (!alive() || !MaySend()) return;
  const std::optional<v1::DesiredSet> desired = cluster_->TakeDesired(session);
  if (!desired) return;
  v1::ControlMessage message;
  *message.mutable_desired() = *desired;
  SendTo(session, message);
}

void SimulatedControl::OnMessage(Node from, const Bytes& bytes) {
  if (!alive()) return;
  v1::AgentMessage message;
  if (!message.ParseFromArray(bytes.data(), static_cast<int>(bytes.size()))) return;
  if (!message.has_hello()) {
    const auto session = sessions_.find(from);
    if (session == sessions_.end()) return network_.Break(from, node());
    if (several_ && message.has_lease()) return AskLease(session->second, message.lease());
    const absl::Status status = cluster_->HandleAgentMessage(Now(), session->second, message);
    Publish();
    if (!status.ok()) network_.Break(from, node());
    return;
  }
  const auto admission = cluster_->HandleHello(Now(), message.hello());
  if (!admission.ok()) {
    log_.push_back("hello refused: " + std::string(admission.status().message()));
    Publish();
    return network_.Break(from, node());
  }
  sessions_[from] = admission->stream;
  if (!store_.dead()) {
    v1::ControlMessage answer;
    *answer.mutable_admitted() = admission->admitted;
    (void)network_.Send(node(), from, Packed(answer));
  }
  Publish();
}

void SimulatedControl::Disconnected(Node agent) {
  const auto session = sessions_.find(agent);
  if (session == sessions_.end() || !alive()) return;
  cluster_->HandleAgentGone(session->second);
  sessions_.erase(session);
  Publish();
}

// --- Checkpoints.

absl::Status SimulatedControl::TakeUpload(const v1::UploadCheckpointRequest& request, const Bytes& bytes) {
  if (!alive()) return absl::UnavailableError("dead");
  absl::Status status =
      Call([&](control::Cluster& cluster, control::Now now) { return cluster.CheckUpload(now, request); });
  if (!status.ok() || !alive()) return status;
  SimulatedCheckpoint& checkpoint = shared_.checkpoints()[request.tick()];
  checkpoint.files[control::RegionFileName(request.identity().region())] = bytes;
  auto manifest = Call([&](control::Cluster& cluster, control::Now) { return cluster.NoteUploaded(request); });
  if (!manifest || !alive()) return absl::OkStatus();
  checkpoint.manifest = *std::move(manifest);
  checkpoint.whole = true;
  return Call([&](control::Cluster& cluster, control::Now now) {
    cluster.NoteCheckpoint(now, request.identity().instance_id(), checkpoint.manifest, bytes.size());
    return absl::OkStatus();
  });
}

absl::StatusOr<Bytes> SimulatedControl::StateFile(const v1::FetchStateRequest& request) {
  if (!alive()) return absl::UnavailableError("dead");
  const absl::Status status = cluster_->CheckFetch(request);
  if (!status.ok()) return status;
  const auto found = shared_.checkpoints().find(request.tick());
  if (found == shared_.checkpoints().end()) return absl::NotFoundError("no such checkpoint");
  return found->second.files.at(control::RegionFileName(request.region()));
}

void SimulatedControl::Restore(const std::string& id) {
  (void)Call([&](control::Cluster& cluster, control::Now now) {
    const std::optional<std::uint64_t> before = cluster.RestoreWantedBefore(id);
    if (!before) return 0;
    const control::InstanceEntry* instance = cluster.state().FindInstance(id);
    const SimulatedCheckpoint* newest = nullptr;
    for (const auto& [tick, checkpoint] : shared_.checkpoints()) {
      const bool kept = control::KeptOf(instance->record.checkpoints(), tick) != nullptr;
      if (checkpoint.whole && kept && (*before == 0 || tick < *before)) newest = &checkpoint;
    }
    if (newest != nullptr) {
      const auto restored = cluster.Restore(now, id, newest->manifest, {"scene", ""}, false);
      if (restored.ok()) return 0;
      const std::string why(restored.status().message());
      if (absl::IsUnavailable(restored.status()) || absl::IsResourceExhausted(restored.status())) {
        cluster.NoteRestoreWaits(id, why);
      } else {
        cluster.CannotRestore(now, id, why);
      }
    } else {
      cluster.CannotRestore(now, id, "no checkpoint is whole");
    }
    return 0;
  });
}

}  // namespace tessera::simulation
