// SimulatedWorker: a worker process of a Deployment: the product's WorkerCore, with a virtual network, files in memory
// and virtual time around it in place of region_worker's WorkerShell.
//
// Thread rule: one thread at a time.
#pragma once

#include <functional>
#include <memory>
#include <optional>

#include "region_worker/core/worker_core.h"
#include "tests/simulation/simulated_agent_link.h"
#include "tests/simulation/simulated_links.h"
#include "tests/simulation/surroundings.h"

namespace tessera::simulation {

class SimulatedWorker {
 public:
  static constexpr Micros kRound = Milliseconds(10);               // between rounds of its loop when nothing comes
  static constexpr auto kStepTime = std::chrono::milliseconds(1);  // as it is reported

  // `place`: the machine's number. `ended(exit code)` comes last; the caller then destroys this, not at once.
  SimulatedWorker(Surroundings& around, worker::Identity identity, std::int64_t pid, v1::RegionAddress address,
                  std::uint32_t place);
  ~SimulatedWorker() { *alive_ = false; }

  // --- Its agent.
  SimulatedAgentLink agent;
  std::function<void(int code)> ended;
  void Take(const v1::WorkerOrder& order);
  void TakeLease(const v1::LeaseRenewal& renewal);
  void Stop();  // in order

  const worker::WorkerCore& core() const { return core_; }
  const worker::Identity& identity() const { return core_.identity(); }
  const worker::Order& order() const { return core_.order(); }
  std::int64_t pid() const { return pid_; }
  std::uint32_t place() const { return place_; }
  Node node() const { return NodeOf(identity().region, identity().incarnation); }
  // Null before the world is built.
  const region::Region* region() const { return core_.run() != nullptr ? &core_.run()->region() : nullptr; }
  bool running() const { return core_.phase() == v1::WORKER_PHASE_RUNNING; }
  // It steps, as far as it knows.
  bool Moves() const { return region() != nullptr && running() && core_.run()->Moves(around_.Now()); }
  bool HoldsLease() const { return core_.run()->standby_log().LeaseHeld(around_.Now()); }
  bool paused() const { return running() && !HoldsLease(); }
  // Its standby has a copy, if it has a standby.
  bool Protected() const { return region() != nullptr && !core_.run()->standby_log().unprotected() && HoldsLease(); }
  // It steps no further than this.
  void set_target(Tick target) { target_ = target; }

 private:
  void WakeAt(worker::TimePoint time);
  void GoOn();
  void CarryOut();
  void OnMessage(RegionId from, const Bytes& bytes);
  template <class Action>
  void Do(const Action&) {}  // no concern of the simulator's
  void Do(const worker::SendMessage& action);
  void Do(const worker::CutLink& action);
  void Do(const worker::RequestScene& action);
  void Do(const worker::RequestGame& action);
  void Do(const worker::RequestModule& action);
  void Do(const worker::RequestMovement& action);
  void Do(const worker::RequestState& action);
  void Do(const worker::WriteCheckpoint& action);
  void Do(const worker::OpenPorts& action);
  void Do(const worker::PublishStep& action);
  void Do(const worker::SendReport& action);
  void Do(const worker::SendInventory& action);
  void Do(const worker::AskForLease& action);
  void Do(const worker::Log& action);
  void Do(const worker::PrintFailure& action);

  Surroundings& around_;
  std::int64_t pid_;
  std::uint32_t place_;
  worker::WorkerCore core_;
  SimulatedLinks links_;
  std::uint64_t failovers_ = 0;
  Tick target_{~Tick::rep{0} >> 1};
  std::optional<worker::TimePoint> wake_;
  bool carrying_out_ = false, over_ = false;
  std::shared_ptr<bool> alive_ = std::make_shared<bool>(true);
};

}  // namespace tessera::simulation
