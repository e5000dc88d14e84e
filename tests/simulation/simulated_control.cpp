#include "tests/simulation/simulated_control.h"

#include <algorithm>
#include <optional>

#include "control_plane/backup.h"
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

SimulatedControl::SimulatedControl(Timeline& timeline, VirtualNetwork& network, std::uint64_t seed)
    : timeline_(timeline), network_(network), chance_(seed) {
  network_.SetPlace(kControlNode, kControlPlace);
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
  store_.Promote();
  auto cluster = control::Cluster::Load(
      store_, {}, [this](std::size_t bytes) { return Random(bytes); }, Now());
  cluster_ = *std::move(cluster);
  ++life_;
  writing_until_ = 0;
  network_.Join(kControlNode, {.on_connected = [](Node) {},
                               .on_disconnected = [this](Node agent) { Disconnected(agent); },
                               .on_message = [this](Node from, const Bytes& bytes) { OnMessage(from, bytes); },
                               .on_datagram = {}});
  Publish();
  Tick();
}

// The kernel closes its connections.
void SimulatedControl::Kill() {
  cluster_.reset();
  const std::map<Node, control::StreamId> sessions = std::exchange(sessions_, {});
  for (const auto& [agent, session] : sessions) {
    if (!network_.IsCut(agent, kControlNode)) network_.Break(agent, kControlNode);
  }
  network_.Leave(kControlNode);
}

std::string SimulatedControl::Backup() const {
  std::string file;
  (void)control::WriteBackup(store_, [&file](std::string_view piece) {  // neither the store nor this fails
    file.append(piece);
    return absl::OkStatus();
  });
  return file;
}

void SimulatedControl::BeginFrom(const std::string& backup) {
  Kill();
  store_.Promote();
  std::vector<control::StoreOp> all;
  const auto stored = store_.List("");
  for (const control::StoreEntry& entry : *stored) all.push_back(control::DeleteOp(entry.key, entry.revision));
  const auto emptied = store_.Txn(all);
  const auto restored = control::RestoreBackup(backup, store_);
  if (!emptied.ok() || !restored.ok()) log_.push_back("the backup cannot be restored");
  (void)store_.TakeTried();  // nobody waits for these
  Start();
}

void SimulatedControl::Tick() {
  timeline_.In(std::chrono::microseconds(control::kTimerInterval).count(), [this, life = life_] {
    if (!alive() || life != life_) return;
    network_.InProcess(kControlNode, [this, life] {
      if (!alive() || life != life_) return;
      cluster_->HandleTimer(Now());
      Publish();
      if (alive()) Tick();
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
  writing_until_ = std::max(writing_until_, now) + write_time_ * store_.TakeTried();
  if (writing_until_ <= now) return SetOff(effects);
  network_.SetStalled(kControlNode, true);
  timeline_.At(writing_until_, [this, life = life_, effects = std::move(effects)] {
    if (!alive() || life != life_) return;
    SetOff(effects);
    if (!writing()) network_.SetStalled(kControlNode, false);
  });
}

void SimulatedControl::SetOff(const control::Effects& effects) {
  for (const control::LogLine& line : effects.log) log_.push_back(line.text);
  for (const auto& [id, tick] : effects.pruned) checkpoints_.erase(tick);
  for (const auto& [id, tick] : effects.abandoned) {
    if (const auto found = checkpoints_.find(tick); found != checkpoints_.end() && !found->second.whole) {
      checkpoints_.erase(found);
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
      if (open == session) network_.Break(agent, kControlNode);
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
  for (const auto& [agent, open] : sessions_) {
    if (open == session) (void)network_.Send(kControlNode, agent, Packed(message));
  }
}

void SimulatedControl::SendDesired(control::StreamId session) {
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
    if (session == sessions_.end()) return network_.Break(from, kControlNode);
    const absl::Status status = cluster_->HandleAgentMessage(Now(), session->second, message);
    Publish();
    if (!status.ok()) network_.Break(from, kControlNode);
    return;
  }
  const auto admission = cluster_->HandleHello(Now(), message.hello());
  if (!admission.ok()) {
    log_.push_back("hello refused: " + std::string(admission.status().message()));
    Publish();
    return network_.Break(from, kControlNode);
  }
  sessions_[from] = admission->stream;
  if (!store_.dead()) {
    v1::ControlMessage answer;
    *answer.mutable_admitted() = admission->admitted;
    (void)network_.Send(kControlNode, from, Packed(answer));
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
  Checkpoint& checkpoint = checkpoints_[request.tick()];
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
  const auto found = checkpoints_.find(request.tick());
  if (found == checkpoints_.end()) return absl::NotFoundError("no such checkpoint");
  return found->second.files.at(control::RegionFileName(request.region()));
}

void SimulatedControl::Restore(const std::string& id) {
  (void)Call([&](control::Cluster& cluster, control::Now now) {
    const std::optional<std::uint64_t> before = cluster.RestoreWantedBefore(id);
    if (!before) return 0;
    const control::InstanceEntry* instance = cluster.state().FindInstance(id);
    const Checkpoint* newest = nullptr;
    for (const auto& [tick, checkpoint] : checkpoints_) {
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
