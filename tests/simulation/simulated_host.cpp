#include "tests/simulation/simulated_host.h"

#include <algorithm>
#include <csignal>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/world/byte_view.h"
#include "core/world/sha256.h"

namespace tessera::simulation {
namespace {

constexpr Micros kCare = Milliseconds(100);  // between looks at deadlines
constexpr Micros kFetching = 2000;           // to get a file from the control plane

// As agent/limits.h has them.
constexpr Micros kAdmissionPatience = Milliseconds(2000);  // for one of several control planes
constexpr Micros kFirstBackoff = Milliseconds(50), kLastBackoff = Milliseconds(2000);
constexpr Micros kRefusal = 1000;  // by a machine on which no control plane runs

}  // namespace

SimulatedHost::SimulatedHost(Surroundings& around, const Controls& controls, std::uint32_t number,
                             std::uint32_t capacity, std::string join_token)
    : around_(around),
      controls_(controls),
      number_(number),
      capacity_(capacity),
      join_token_(std::move(join_token)),
      chance_(number) {
  around_.network.SetPlace(node(), number_);
}

std::vector<SimulatedWorker*> SimulatedHost::workers() const {
  std::vector<SimulatedWorker*> workers;
  workers.reserve(processes_.size());
  for (const auto& [key, process] : processes_) workers.push_back(process.worker.get());
  return workers;
}

// --- The agent's life.

void SimulatedHost::StartAgent() {
  ++life_;
  supervisor_ =
      std::make_unique<agent::Supervisor>(agent::PortRange(20'000, 29'999), [](std::uint16_t) { return true; });
  supervisor_->SetStateFolder(absl::StrCat("host-", number_));
  for (const v1::WorkerExited& exited : saved_.exits()) supervisor_->AdoptExit(exited);
  for (const agent::WorkerRecord& record : saved_.workers()) {
    const auto process = processes_.find(agent::KeyOf(record.identity()));
    if (process != processes_.end() && process->second.pid == record.identity().pid()) {
      const auto order = orders_.find(process->first);
      supervisor_->Adopt(record, order == orders_.end() ? std::nullopt : std::optional(order->second));
    } else {
      supervisor_->AdoptGone(record, "ended while no agent ran", {});
    }
  }
  around_.network.Join(node(), {.on_connected = [this](Node from) { OnConnected(from); },
                                .on_disconnected = [this](Node from) { OnDisconnected(from); },
                                .on_message = [this](Node from, const Bytes& bytes) { OnMessage(from, bytes); },
                                .on_datagram = {}});
  at_ = 0;
  backoff_ = kFirstBackoff;
  Dial();
  Settle();
  Every(kCare, [this] {
    supervisor_->Tick(around_.Now());
    Settle();
  });
  Beat();
}

void SimulatedHost::KillAgent() {
  if (!agent_alive()) return;
  supervisor_.reset();
  admitted_ = false;
  contents_.clear();
  states_.clear();
  inventories_.clear();
  ++dials_;
  if (!around_.network.IsCut(node(), control().node())) around_.network.Break(node(), control().node());
  if (several()) around_.network.Unlink(node(), control().node());
  around_.network.Leave(node());
  for (auto& [key, process] : processes_) {
    process.attached_life = 0;
    process.worker->agent.send = {};
    DialAgent(key);
  }
}

// The machine's clock and its connections go with it.
void SimulatedHost::Crash() {
  KillAgent();
  for (auto& [key, process] : processes_) on_ending(*process.worker);
  processes_.clear();
  orders_.clear();
  ++boot_;
}

// While this agent lives.
void SimulatedHost::Every(Micros distance, std::function<void()> action) {
  around_.timeline.In(distance, [this, life = life_, distance, action = std::move(action)] {
    if (!agent_alive() || life != life_) return;
    around_.network.InProcess(node(), [this, life, distance, action] {
      if (!agent_alive() || life != life_) return;
      action();
      Every(distance, action);
    });
  });
}

// --- The control plane.

// The network dials again by itself; of several control planes the next one may lead.
void SimulatedHost::Dial() {
  const std::uint64_t dial = ++dials_;
  const Node there = control().node();
  around_.network.Link(node(), there);
  if (!several()) return;
  const bool refused = !around_.network.Joined(there) && !around_.network.IsCut(node(), there);
  around_.timeline.In(refused ? kRefusal : kAdmissionPatience, [this, dial] {
    if (!agent_alive() || dial != dials_ || admitted_) return;
    around_.network.InProcess(node(), [this, dial] {
      if (agent_alive() && dial == dials_ && !admitted_) LeaveControl();
    });
  });
}

void SimulatedHost::OnDisconnected(Node from) {
  if (from != control().node()) return;
  admitted_ = false;
  if (several() && agent_alive()) LeaveControl();
}

// Only when all have been tried is there a pause that grows.
void SimulatedHost::LeaveControl() {
  const std::uint64_t dial = ++dials_;
  const Node left = control().node();
  admitted_ = false;
  at_ = (at_ + 1) % controls_.size();
  around_.network.Break(node(), left);
  around_.network.Unlink(node(), left);
  const Micros pause = at_ == 0 ? std::exchange(backoff_, std::min(2 * backoff_, kLastBackoff)) : 0;
  around_.timeline.In(pause - chance_.UpTo(pause / 5), [this, dial] {
    if (!agent_alive() || dial != dials_) return;
    around_.network.InProcess(node(), [this, dial] {
      if (agent_alive() && dial == dials_) Dial();
    });
  });
}

void SimulatedHost::OnConnected(Node from) {
  if (from != control().node()) return;
  v1::AgentMessage message;
  v1::AgentHello& hello = *message.mutable_hello();
  if (host_id_.empty()) {
    hello.set_join_token(join_token_);
  } else {
    hello.set_host_id(host_id_);
    hello.set_host_secret(secret_);
  }
  hello.set_advertise_address(absl::StrCat("host-", number_));
  hello.set_metrics_port(9100);
  hello.mutable_resources()->set_region_capacity(capacity_);
  hello.set_boot_id(absl::StrCat(boot_));
  hello.set_revocations_number(KeptRevocations());
  for (const v1::WorkerReport& report : supervisor_->Reports()) *hello.add_workers() = report;
  Send(message);
}

void SimulatedHost::Send(const v1::AgentMessage& message) {
  const std::string text = message.SerializeAsString();
  (void)around_.network.Send(node(), control().node(), {text.begin(), text.end()});
}

void SimulatedHost::Beat() {
  Every(std::chrono::microseconds(control::ControlSettings().heartbeat_interval).count(), [this] {
    if (!admitted_) return;
    v1::AgentMessage message;
    message.mutable_heartbeat()->set_desired_revision(supervisor_->desired_revision());
    for (const v1::WorkerReport& report : supervisor_->Reports()) *message.mutable_heartbeat()->add_workers() = report;
    Send(message);
  });
}

void SimulatedHost::Admitted(const v1::Admitted& admitted) {
  admitted_ = true;
  backoff_ = kFirstBackoff;
  host_id_ = admitted.host_id();
  if (!admitted.host_secret().empty()) secret_ = admitted.host_secret();
  v1::AgentMessage up;
  for (const v1::WorkerExited& exited : supervisor_->Exits()) {
    *up.mutable_exited() = exited;
    Send(up);
  }
  for (const auto& [key, inventory] : inventories_) {
    *up.mutable_inventory() = inventory;
    Send(up);
  }
  if (admitted.report_revocations() && KeptRevocations() > 0) {
    *up.mutable_revocations() = revocations_;
    Send(up);
  }
  if (admitted.report_orders()) {
    *up.mutable_held_orders() = supervisor_->HeldOrders();
    Send(up);
  }
  Fetch();
}

// Nobody is revoked here, but a host without the newest list gets no leases.
std::uint64_t SimulatedHost::KeptRevocations() const {
  v1::Revocations content;
  return content.ParseFromString(revocations_.list()) ? content.number() : 0;
}

void SimulatedHost::Keep(const v1::SignedRevocations& list) {
  revocations_ = list;
  v1::AgentMessage up;
  up.set_kept_revocations(KeptRevocations());
  Send(up);
}

void SimulatedHost::OnMessage(Node from, const Bytes& bytes) {
  if (!agent_alive() || from != control().node()) return;
  v1::ControlMessage message;
  if (!message.ParseFromArray(bytes.data(), static_cast<int>(bytes.size()))) return;
  if (message.has_admitted()) {
    Admitted(message.admitted());
  } else if (message.has_desired()) {
    agent::LifeFence lives(newest_life_);
    if (several() && !lives.Admit(message.desired().revision())) return LeaveControl();
    newest_life_ = lives.newest();
    if (message.desired().has_revocations()) Keep(message.desired().revocations());
    (void)supervisor_->Desired(message.desired(), around_.Now());
  } else if (message.has_lease()) {
    const agent::WorkerKey key = agent::KeyOf(message.lease().identity());
    ToWorker(key, [renewal = message.lease()](SimulatedWorker& worker) { worker.TakeLease(renewal); });
  }
  Settle();
}

// --- What the supervisor wants.

void SimulatedHost::Settle() {
  for (auto actions = supervisor_->TakeActions(); !actions.empty(); actions = supervisor_->TakeActions()) {
    for (const agent::Action& action : actions) std::visit([this](const auto& what) { Do(what); }, action);
  }
  if (supervisor_->TakeDirty(around_.Now())) saved_ = supervisor_->State(absl::StrCat(boot_));
}

void SimulatedHost::Do(const agent::SpawnWorker& action) {
  const agent::WorkerKey key = action.key;
  Process& process = processes_[key];
  process.pid = ++pids_;
  process.agent_life = life_;
  ++starts_[key];
  v1::RegionAddress address;
  address.set_region(key.region);
  address.set_incarnation(key.incarnation);
  address.set_host(absl::StrCat("host-", number_));
  address.set_game_port(action.first_port);
  address.set_link_port(action.first_port + 1U);
  address.set_metrics_port(action.first_port + 2U);
  process.worker = std::make_unique<SimulatedWorker>(
      around_, worker::Identity{key.instance_id, RegionId(key.region), Incarnation(key.incarnation)}, process.pid,
      std::move(address), number_);
  process.worker->ended = [this, key](int code) {
    around_.timeline.In(kCall, [this, key, code] { Ended(key, {true, code, 0}); });
  };
  supervisor_->Spawned(key, static_cast<pid_t>(process.pid), static_cast<std::uint64_t>(process.pid), "log",
                       around_.Now());
  saved_ = supervisor_->State(absl::StrCat(boot_));
  DialAgent(key);
}

void SimulatedHost::Do(const agent::SignalWorker& action) {
  around_.timeline.In(kCall, [this, action] {
    const auto found = processes_.find(action.key);
    if (found == processes_.end()) return;
    if (action.signal == SIGTERM) return found->second.worker->Stop();
    Ended(action.key, {true, 0, action.signal});
  });
}

void SimulatedHost::Do(const agent::SendOrder& action) {
  if (!action.order.has_failover() || action.order.has_resolution()) inventories_.erase(action.key);
  ToWorker(action.key, [order = action.order](SimulatedWorker& worker) { worker.Take(order); });
}

void SimulatedHost::Do(const agent::FetchContent& action) {
  contents_.insert(action.content);
  Fetch();
}

void SimulatedHost::Do(const agent::FetchState& action) {
  states_.push_back(action);
  Fetch();
}

// Files come from the control plane while there is one, and are asked for again when there is one again.
void SimulatedHost::Fetch() {
  around_.timeline.In(kFetching, [this, life = life_] {
    if (!agent_alive() || life != life_ || !admitted_ || !control().alive()) return;
    for (const agent::Content& content : std::exchange(contents_, {})) {
      supervisor_->ContentReady(content, agent::NameOf(content.kind));
    }
    for (const agent::FetchState& state : std::exchange(states_, {})) {
      v1::FetchStateRequest request;
      request.set_host_id(host_id_);
      request.set_host_secret(secret_);
      request.set_instance_id(state.key.instance_id);
      request.set_region(state.key.region);
      request.set_tick(state.tick);
      const absl::StatusOr<Bytes> bytes = control().StateFile(request);
      if (bytes.ok()) {
        around_.files[state.path] = *bytes;
        supervisor_->StateReady(state.key, state.path);
      } else {
        supervisor_->StateFailed(state.key, std::string(bytes.status().message()));
      }
    }
    Settle();
  });
}

void SimulatedHost::Do(const agent::UploadState& action) {
  around_.timeline.In(kFetching, [this, action, life = life_] {
    if (!agent_alive() || life != life_ || !admitted_) return;
    const auto file = around_.files.find(action.path);
    if (file == around_.files.end()) return;
    v1::UploadCheckpointRequest request;
    request.set_host_id(host_id_);
    request.set_host_secret(secret_);
    request.mutable_identity()->set_instance_id(action.key.instance_id);
    request.mutable_identity()->set_region(action.key.region);
    request.mutable_identity()->set_incarnation(action.key.incarnation);
    request.set_tick(action.tick);
    request.set_size(file->second.size());
    request.set_hash(Sha256Hex(AsText(file->second)));
    (void)control().TakeUpload(request, file->second);
    around_.files.erase(action.path);
  });
}

void SimulatedHost::Do(const agent::ForwardReport& action) {
  if (!admitted_) return;
  v1::AgentMessage message;
  *message.mutable_report() = action.report;
  Send(message);
}

void SimulatedHost::Do(const agent::ReportExit& action) {
  if (!admitted_) return;
  v1::AgentMessage message;
  *message.mutable_exited() = action.exited;
  Send(message);
}

// --- Workers.

void SimulatedHost::ToWorker(const agent::WorkerKey& key, std::function<void(SimulatedWorker&)> action) {
  around_.timeline.In(kCall, [this, key, life = life_, action = std::move(action)] {
    const auto found = processes_.find(key);
    if (found == processes_.end() || found->second.attached_life != life) return;
    const Node node = found->second.worker->node();
    const auto act = [this, key, action] {
      if (const auto then = processes_.find(key); then != processes_.end()) action(*then->second.worker);
    };
    if (around_.network.Joined(node)) {
      around_.network.InProcess(node, act);
    } else {
      act();
    }
  });
}

// Again and again until there is one.
void SimulatedHost::DialAgent(const agent::WorkerKey& key) {
  const std::int64_t pid = processes_.at(key).pid;
  around_.timeline.In(kDial, [this, key, pid] {
    const auto found = processes_.find(key);
    if (found == processes_.end() || found->second.pid != pid || found->second.attached_life != 0) return;
    if (!agent_alive()) return DialAgent(key);
    Attach(key);
  });
}

void SimulatedHost::Attach(const agent::WorkerKey& key) {
  Process& process = processes_.at(key);
  const v1::WorkerMessage first = process.worker->agent.FirstMessage();
  const absl::StatusOr<agent::WorkerKey> attached =
      supervisor_->Attached(first.report(), static_cast<pid_t>(process.pid));
  if (!attached.ok()) {
    process.worker->Stop();  // the agent does not know this worker
    return;
  }
  process.attached_life = life_;
  process.worker->agent.send = [this, key, life = life_](const v1::WorkerMessage& message) {
    around_.timeline.In(kCall, [this, key, life, message] {
      if (!agent_alive() || life != life_ || !processes_.contains(key)) return;
      around_.network.InProcess(node(), [this, key, life, message] {
        if (agent_alive() && life == life_ && processes_.contains(key)) OnWorkerMessage(key, message);
      });
    });
  };
  OnWorkerMessage(key, first);
}

void SimulatedHost::OnWorkerMessage(const agent::WorkerKey& key, const v1::WorkerMessage& message) {
  if (message.has_report()) supervisor_->Reported(key, message.report());
  v1::AgentMessage up;
  if (message.has_lease()) {
    *up.mutable_lease() = message.lease();
    if (admitted_) Send(up);
  }
  if (message.has_inventory()) {
    inventories_[key] = message.inventory();
    *up.mutable_inventory() = message.inventory();
    if (admitted_) Send(up);
  }
  Settle();
}

void SimulatedHost::KillWorker(const agent::WorkerKey& key) { Ended(key, {true, 0, SIGKILL}); }

void SimulatedHost::Ended(const agent::WorkerKey& key, const host::ExitStatus& status) {
  const auto found = processes_.find(key);
  if (found == processes_.end()) return;
  on_ending(*found->second.worker);
  const bool known = found->second.agent_life == life_;
  processes_.erase(found);
  inventories_.erase(key);
  orders_.erase(key);
  if (!agent_alive()) return;
  const host::ExitStatus seen = known ? status : host::ExitStatus{};
  around_.timeline.In(kCall, [this, key, seen, life = life_] {
    if (!agent_alive() || life != life_) return;
    around_.network.InProcess(node(), [this, key, seen] {
      if (!agent_alive()) return;
      supervisor_->Ended(key, seen, {});
      Settle();
    });
  });
}

}  // namespace tessera::simulation
