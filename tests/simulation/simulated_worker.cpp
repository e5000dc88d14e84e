#include "tests/simulation/simulated_worker.h"

#include <algorithm>
#include <utility>

namespace tessera::simulation {

SimulatedWorker::SimulatedWorker(Surroundings& around, worker::Identity identity, std::int64_t pid,
                                 v1::RegionAddress address, std::uint32_t place)
    : around_(around), pid_(pid), place_(place), core_({identity, pid, std::move(address), around.settings, {}}) {
  around_.network.SetPlace(node(), place_);
  WakeAt(around_.Now());
}

SimulatedWorker::~SimulatedWorker() {
  *alive_ = false;
  around_.network.Leave(node());
}

void SimulatedWorker::Take(const v1::WorkerOrder& order) { core_.TakeOrder(order, around_.Now()), GoOn(); }
void SimulatedWorker::TakeLease(const v1::LeaseRenewal& renewal) { core_.TakeLease(renewal), GoOn(); }
void SimulatedWorker::Stop() { core_.Stop("its agent ends it"), GoOn(); }

bool SimulatedWorker::Protected() const {
  if (region() == nullptr) return false;
  const worker::StandbyLog& log = core_.run()->standby_log();
  return !log.unprotected() && (log.standby() == RegionId() || HoldsLease());
}

// --- Time.

void SimulatedWorker::WakeAt(worker::TimePoint time) {
  if (wake_ && *wake_ <= time) return;
  wake_ = time;
  const auto wake = [this, alive = alive_, time] {
    if (!*alive || wake_ != time) return;
    wake_.reset();
    GoOn();
  };
  around_.timeline.At(MicrosAt(time), [this, alive = alive_, wake] {
    if (!*alive) return;
    around_.network.Joined(node()) ? around_.network.InProcess(node(), wake) : wake();
  });
}

void SimulatedWorker::GoOn() {
  if (carrying_out_ || over_) return;
  CarryOut();
  const worker::TimePoint now = around_.Now();
  while (core_.Advance(now) && region()->tick() < target_) {
    core_.Step(now);
    CarryOut();
    core_.StepEnded(now, kStepTime);
  }
  CarryOut();
  Link();
  WakeAt(std::min(core_.wake_at(now).value_or(now + std::chrono::hours(1)), now + std::chrono::microseconds(kRound)));
  over_ = core_.stopping();
  if (over_) ended(core_.failure().empty() ? 0 : 1);
}

void SimulatedWorker::CarryOut() {
  carrying_out_ = true;
  for (worker::Actions* actions = &core_.TakeActions(); !actions->empty(); actions = &core_.TakeActions()) {
    for (const worker::Action& action : *actions) std::visit([this](const auto& what) { Do(what); }, action);
  }
  carrying_out_ = false;
}

// --- Links.

void SimulatedWorker::Link() {
  for (const RegionId partner : core_.links().partners()) {
    if (!core_.links().Dials(partner)) continue;
    around_.network.Link(node(), NodeOf(partner, core_.links().AddressOf(partner)->incarnation));
  }
}

void SimulatedWorker::OnConnected(Node peer) {
  const RegionId region = RegionAt(peer);
  if (over_ || !core_.links().Admit(region, LifeAt(peer)).ok()) return around_.network.Break(node(), peer);
  if (const auto older = linked_.find(region); older != linked_.end()) around_.network.Break(node(), older->second);
  linked_[region] = peer;
  core_.LinkUp(region, LifeAt(peer), around_.Now());
  GoOn();
}

void SimulatedWorker::OnMessage(Node from, const Bytes& bytes) {
  const auto message = worker::ReadLinkMessage(bytes);
  if (!message) return around_.on_failure(*this, "a message of no known form");
  core_.Receive(RegionAt(from), *message, around_.Now());
  GoOn();
}

void SimulatedWorker::Do(const worker::OpenPorts&) {
  around_.network.Join(node(), {.on_connected = [this](Node peer) { OnConnected(peer); },
                                .on_disconnected =
                                    [this](Node peer) {
                                      const auto linked = linked_.find(RegionAt(peer));
                                      if (linked == linked_.end() || linked->second != peer) return;
                                      linked_.erase(linked);
                                      core_.LinkDown(RegionAt(peer));
                                    },
                                .on_message = [this](Node from, const Bytes& bytes) { OnMessage(from, bytes); },
                                .on_datagram = {}});
}

void SimulatedWorker::Do(const worker::SendMessage& action) {
  const auto linked = linked_.find(action.to);
  if (linked != linked_.end()) (void)around_.network.Send(node(), linked->second, *action.message);
}

void SimulatedWorker::Do(const worker::CutLink& action) {
  const auto linked = linked_.find(action.region);
  if (linked == linked_.end()) return;
  const Node peer = linked->second;
  linked_.erase(linked);
  around_.network.Break(node(), peer);
  around_.network.Unlink(node(), peer);
}

// --- Files, the agent and the checks.

void SimulatedWorker::Do(const worker::LoadScene&) { core_.SceneLoaded(around_.scene, around_.Now()); }

void SimulatedWorker::Do(const worker::LoadState& action) {
  const auto file = around_.files.find(action.path);
  if (file == around_.files.end()) return core_.StateLoaded(absl::NotFoundError(action.path), around_.Now());
  core_.StateLoaded(file->second, around_.Now());
}

void SimulatedWorker::Do(const worker::WriteCheckpoint& action) {
  around_.files[action.path] = action.state;
  core_.CheckpointWritten(action.tick, absl::OkStatus());
}

void SimulatedWorker::Do(const worker::PublishStep& action) {
  const std::uint64_t before = std::exchange(failovers_, core_.run()->failover_figures().failovers);
  if (failovers_ != before && order().failover) around_.on_takeover(*this, *order().failover);
  around_.on_step(*this, action.result);
}

void SimulatedWorker::Do(const worker::SendReport& action) {
  *newest_.mutable_report() = action.report;
  v1::WorkerMessage message;
  *message.mutable_report() = action.report;
  if (send) send(message);
}

void SimulatedWorker::Do(const worker::SendInventory& action) {
  newest_.clear_inventory();
  if (!action.inventory) return;
  *newest_.mutable_inventory() = *action.inventory;
  v1::WorkerMessage message;
  *message.mutable_inventory() = *action.inventory;
  if (send) send(message);
}

void SimulatedWorker::Do(const worker::AskForLease& action) {
  v1::WorkerMessage message;
  *message.mutable_lease() = action.request;
  if (send) send(message);
}

void SimulatedWorker::Do(const worker::Log& action) {
  if (action.severity == worker::Severity::kError) around_.on_failure(*this, action.line);
}

void SimulatedWorker::Do(const worker::PrintFailure& action) { around_.on_failure(*this, action.reason); }

}  // namespace tessera::simulation
