// SimulatedWorker: a worker process of a Deployment: the product's WorkerCore, with a virtual network, files in memory
// and virtual time around it in place of region_worker's WorkerShell.
//
// Thread rule: one thread at a time.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "region_worker/core/worker_core.h"
#include "tests/simulation/virtual_network.h"
#include "tests/simulation/virtual_time.h"

namespace tessera::simulation {

class SimulatedWorker;

// All processes of a deployment share this.
struct Surroundings {
  Timeline timeline;
  VirtualNetwork network;
  std::shared_ptr<const Scene> scene;
  region::RegionSettings settings;
  std::map<std::string, Bytes> files;  // of all hosts, by path

  // The checks: a step, a resumption included; a failover that is carried out now declares those lives dead.
  std::function<void(SimulatedWorker&, const region::StepResult&)> on_step;
  std::function<void(SimulatedWorker&, const worker::OrderedFailover&)> on_takeover;
  std::function<void(SimulatedWorker&, const std::string&)> on_failure;

  Surroundings(std::uint64_t seed, std::shared_ptr<const Scene> of) : network(timeline, seed), scene(std::move(of)) {}
  worker::TimePoint Now() const { return TimePointAt(timeline.now()); }
};

// The node of a life of a region: several lives of one may be there at once.
constexpr Node kNodesOfALife = 4096;
constexpr Node NodeOf(RegionId region, Incarnation life) {
  return static_cast<Node>(life.value()) * kNodesOfALife + region.value();
}
constexpr RegionId RegionAt(Node node) { return RegionId(node % kNodesOfALife); }
constexpr Incarnation LifeAt(Node node) { return Incarnation(node / kNodesOfALife); }

class SimulatedWorker {
 public:
  static constexpr Micros kRound = Milliseconds(10);               // of its loop, when nothing comes
  static constexpr auto kStepTime = std::chrono::milliseconds(1);  // as it is reported

  // `place`: the machine's number. `ended(exit code)` comes last; the caller then destroys this, not at once.
  SimulatedWorker(Surroundings& around, worker::Identity identity, std::int64_t pid, v1::RegionAddress address,
                  std::uint32_t place);
  ~SimulatedWorker();

  // --- Its agent. `send` is empty while no agent is there.
  std::function<void(const v1::WorkerMessage&)> send;
  std::function<void(int code)> ended;
  v1::WorkerMessage FirstMessage() const { return newest_; }  // of an attachment
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
  bool Protected() const;  // its standby has a copy, if it has a standby
  // It steps no further than this.
  void set_target(Tick target) { target_ = target; }

 private:
  void WakeAt(worker::TimePoint time);
  void GoOn();
  void CarryOut();
  void Link();
  void OnConnected(Node peer);
  void OnMessage(Node from, const Bytes& bytes);
  template <class Action>
  void Do(const Action&) {}  // of no concern here
  void Do(const worker::SendMessage& action);
  void Do(const worker::CutLink& action);
  void Do(const worker::LoadScene& action);
  void Do(const worker::LoadState& action);
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
  std::map<RegionId, Node> linked_;
  v1::WorkerMessage newest_;  // the report, and the inventory until it is settled
  std::uint64_t failovers_ = 0;
  Tick target_{~Tick::rep{0} >> 1};
  std::optional<worker::TimePoint> wake_;
  bool carrying_out_ = false, over_ = false;
  std::shared_ptr<bool> alive_ = std::make_shared<bool>(true);
};

}  // namespace tessera::simulation
