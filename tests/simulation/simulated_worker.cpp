#include "tests/simulation/simulated_worker.h"

#include <algorithm>
#include <utility>

namespace tessera::simulation {

SimulatedWorker::SimulatedWorker(Surroundings& around, worker::Identity identity, std::int64_t pid,
                                 v1::RegionAddress address, std::uint32_t place)
    : around_(around),
      pid_(pid),
      place_(place),
      core_({identity, pid, std::move(address), around.settings, {}}),
      links_(around.network, node(), place) {
  WakeAt(around_.Now());
}

void SimulatedWorker::Take(const v1::WorkerOrder& order) { core_.TakeOrder(order, around_.Now()), GoOn(); }
void SimulatedWorker::TakeLease(const v1::LeaseRenewal& renewal) { core_.TakeLease(renewal), GoOn(); }
void SimulatedWorker::Stop() { core_.Stop("its agent ends it"), GoOn(); }

void SimulatedWorker::WakeAt(worker::TimePoint time) {
  if (wake_ && *wake_ <= time) return;
  wake_ = time;
  const auto wake = [this, alive = alive_, time] {
    if (!*alive || wake_ != time) return;
    wake_.reset();
    GoOn();
  };
  around_.timeline.At(MicrosAt(time), [this, alive = alive_, wake] {
    if (*alive) links_.InProcess(wake);
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
  links_.Dial(core_.links());
  WakeAt(std::min(core_.wake_at(now).value_or(now + std::chrono::hours(1)), now + std::chrono::microseconds(kRound)));
  over_ = core_.stopping();
  if (!over_) return;
  links_.Close();
  ended(core_.failure().empty() ? 0 : 1);
}

void SimulatedWorker::CarryOut() {
  carrying_out_ = true;
  for (worker::Actions* actions = &core_.TakeActions(); !actions->empty(); actions = &core_.TakeActions()) {
    for (const worker::Action& action : *actions) std::visit([this](const auto& what) { Do(what); }, action);
  }
  carrying_out_ = false;
}

// --- Links.

void SimulatedWorker::Do(const worker::OpenPorts&) {
  const auto up = [this](RegionId region, Incarnation life) { core_.LinkUp(region, life, around_.Now()), GoOn(); };
  const auto down = [this](RegionId region) { core_.LinkDown(region); };
  const auto message = [this](RegionId from, const Bytes& bytes) { OnMessage(from, bytes); };
  links_.Open(core_.links(), {.up = up, .down = down, .message = message});
}

void SimulatedWorker::OnMessage(RegionId from, const Bytes& bytes) {
  const auto message = worker::ReadLinkMessage(bytes);
  if (!message) return around_.on_failure(*this, "a message of no known form");
  core_.Receive(from, *message, around_.Now());
  GoOn();
}

void SimulatedWorker::Do(const worker::SendMessage& action) { links_.Send(action.to, *action.message); }
void SimulatedWorker::Do(const worker::CutLink& action) { links_.Cut(action.region); }

// --- Files, the agent and the checks.

void SimulatedWorker::Do(const worker::RequestScene&) { core_.SceneLoaded(around_.scene, around_.Now()); }

void SimulatedWorker::Do(const worker::RequestModule& action) {
  core_.ModuleLoaded(absl::UnimplementedError(action.name + ": the simulator loads no libraries"), around_.Now());
}

void SimulatedWorker::Do(const worker::RequestMovement& action) {
  core_.MovementLoaded(absl::UnimplementedError(action.name + ": the simulator loads no libraries"), around_.Now());
}

void SimulatedWorker::Do(const worker::RequestGame& action) {
  core_.GameLoaded(around_.GameOnHostOf(identity().region, action.hash), around_.Now());
}

void SimulatedWorker::Do(const worker::RequestState& action) {
  core_.StateLoaded(around_.FileAt(action.path), around_.Now());
}

void SimulatedWorker::Do(const worker::WriteCheckpoint& action) {
  around_.files[action.path] = action.state;
  core_.CheckpointWritten(action.tick, absl::OkStatus());
}

void SimulatedWorker::Do(const worker::SendReport& action) { agent.Report(action.report); }
void SimulatedWorker::Do(const worker::SendInventory& action) { agent.SetInventory(action.inventory); }
void SimulatedWorker::Do(const worker::AskForLease& action) { agent.AskLease(action.request); }
void SimulatedWorker::Do(const worker::PrintFailure& action) { around_.on_failure(*this, action.reason); }
void SimulatedWorker::Do(const worker::Log& action) {
  if (action.severity == worker::Severity::kError) around_.on_failure(*this, action.line);
}

void SimulatedWorker::Do(const worker::PublishStep& action) {
  const std::uint64_t before = std::exchange(failovers_, core_.run()->failover_figures().failovers);
  if (failovers_ != before && order().failover) around_.on_takeover(*this, *order().failover);
  around_.on_step(*this, action.result);
}

}  // namespace tessera::simulation
