// SimulatedHost: a machine of a Deployment: an agent that may die and come back, and the worker processes that outlive
// it. What the agent decides is agent's Supervisor; what it keeps on the disk, its sockets and its processes are made
// anew here.
//
//   host.KillAgent();        // its workers run on
//   host.StartAgent();       // adopts them
//   host.KillWorker(key);    // SIGKILL; the agent sees it at once, or finds it gone when it comes back
//   host.Crash();            // the machine
//
// Thread rule: one thread at a time.
#pragma once

#include <map>
#include <memory>
#include <set>
#include <string>

#include "agent/life_fence.h"
#include "agent/supervisor.h"
#include "tests/simulation/simulated_control.h"
#include "tests/simulation/simulated_worker.h"

namespace tessera::simulation {

class SimulatedHost {
 public:
  static constexpr Micros kCall = 200;                // over the Unix socket, one way
  static constexpr Micros kDial = Milliseconds(100);  // between a worker's dials while its agent is away

  using Controls = std::vector<std::unique_ptr<SimulatedControl>>;

  // The agent dials several control planes one after the other until it is admitted by the one that leads.
  SimulatedHost(Surroundings& around, const Controls& controls, std::uint32_t number, std::uint32_t capacity,
                std::string join_token);

  void StartAgent();
  void KillAgent();
  bool agent_alive() const { return supervisor_ != nullptr; }
  void KillWorker(const agent::WorkerKey& key);
  // All that runs here ends. Its disk stays; StartAgent is its next boot.
  void Crash();

  std::uint32_t number() const { return number_; }
  bool admitted() const { return admitted_; }
  // The control plane that it was admitted by; 0: it is away.
  std::uint32_t attached_to() const { return admitted_ ? control().number() : 0; }
  std::vector<SimulatedWorker*> workers() const;
  // How often each life was started.
  const std::map<agent::WorkerKey, int>& starts() const { return starts_; }
  // Before a worker ends, whatever it ends of.
  std::function<void(SimulatedWorker&)> on_ending;

 private:
  struct Process {
    std::unique_ptr<SimulatedWorker> worker;
    std::int64_t pid = 0;
    std::uint64_t agent_life = 0;     // that started it; another does not learn how it ends
    std::uint64_t attached_life = 0;  // to which it talks; 0: to none
  };

  Node node() const { return AgentNode(number_); }
  bool several() const { return controls_.size() > 1; }
  SimulatedControl& control() const { return *controls_[at_]; }
  void Dial();
  void OnConnected(Node from);
  void OnDisconnected(Node from);
  void LeaveControl();
  void OnMessage(Node from, const Bytes& bytes);
  void Send(const v1::AgentMessage& message);
  void Admitted(const v1::Admitted& admitted);
  std::uint64_t KeptRevocations() const;  // the number of the list; 0: none
  void Keep(const v1::SignedRevocations& list);
  void Beat();
  void Every(Micros distance, std::function<void()> action);
  void Settle();
  void Do(const agent::SpawnWorker& action);
  void Do(const agent::SignalWorker& action);
  void Do(const agent::SendOrder& action);
  void Do(const agent::KeepOrder& action) { orders_[action.key] = action.order; }
  void Do(const agent::FetchContent& action);
  void Do(const agent::FetchState& action);
  void Do(const agent::UploadState& action);
  void Do(const agent::ForwardReport& action);
  void Do(const agent::ReportExit& action);
  void Fetch();
  void DialAgent(const agent::WorkerKey& key);
  void Attach(const agent::WorkerKey& key);
  void OnWorkerMessage(const agent::WorkerKey& key, const v1::WorkerMessage& message);
  void Ended(const agent::WorkerKey& key, const host::ExitStatus& status);
  void ToWorker(const agent::WorkerKey& key, std::function<void(SimulatedWorker&)> action);

  Surroundings& around_;
  const Controls& controls_;
  std::uint32_t number_, capacity_;
  std::string join_token_, host_id_, secret_;
  v1::SignedRevocations revocations_;              // on its disk
  std::unique_ptr<agent::Supervisor> supervisor_;  // null: no agent
  std::uint64_t life_ = 0;                         // counts the agent's starts
  std::uint64_t boot_ = 1;
  bool admitted_ = false;
  std::size_t at_ = 0;       // the control plane that it dials
  std::uint64_t dials_ = 0;  // a later one voids what an earlier one waits for
  Micros backoff_ = 0;
  Chance chance_;
  std::uint64_t newest_life_ = 0;  // the newest control plane's, on its disk
  agent::WorkersFile saved_;
  std::map<agent::WorkerKey, v1::WorkerOrder> orders_;  // likewise, as files
  std::set<agent::Content> contents_;
  std::vector<agent::FetchState> states_;
  std::map<agent::WorkerKey, v1::InventoryReport> inventories_;
  std::map<agent::WorkerKey, Process> processes_;
  std::map<agent::WorkerKey, int> starts_;
  std::int64_t pids_ = 0;
};

}  // namespace tessera::simulation
