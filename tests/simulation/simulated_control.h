// SimulatedControl: a control plane of a Deployment: control_plane's Cluster in virtual time, over a store that
// outlives it, with agents at the end of connections. What gRPC, threads and the disk do in the product is all that is
// made anew here; and of several control planes, what control_plane/candidate.h does: it follows until it is elected,
// and leads until its lease ends or a write is refused.
//
//   control.DieAfterStores(2);   // the second thing from now that it stores is the last it does: nobody is told
//   control.SetStoreFull(true);  // nothing is written until this ends
//   control.SetWriteTime(Milliseconds(2000));  // a write takes so long, and it stands still for that
//   control.MoveClock(std::chrono::hours(24));  // its wall clock, and no other
//   control.SetStopped(true);    // as by SIGSTOP
//   control.Kill();
//   control.Start();
//   control.BeginFrom(backup);   // of control.Backup(), which may be old
//
// Thread rule: one thread at a time.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "control_plane/asked_leases.h"
#include "control_plane/cluster/cluster.h"
#include "tests/simulation/simulated_store.h"
#include "tests/simulation/virtual_network.h"

namespace tessera::simulation {

// Control planes are counted from 1; one alone is the first.
constexpr Node ControlNode(std::uint32_t number) { return number * kNodesOfALife - 1; }
constexpr Node kControlNode = ControlNode(1);
constexpr Node AgentNode(std::uint32_t host) { return (host + 1) * kNodesOfALife - 2; }
constexpr Node kStoreNode = kNodesOfALife - 3;
constexpr std::uint32_t kControlPlace = 1'000'000, kStorePlace = 2'000'000;
constexpr std::uint32_t PlaceOfControl(std::uint32_t number) { return kControlPlace + number - 1; }

class SimulatedControl {
 public:
  // `several`: it follows until it is elected.
  SimulatedControl(Timeline& timeline, VirtualNetwork& network, SimulatedStore& shared, std::uint64_t seed,
                   std::uint32_t number = 1, bool several = false);

  void Start();  // with what is stored
  void Kill();
  bool alive() const { return cluster_ != nullptr; }  // it leads, as far as it knows
  bool running() const { return running_; }
  void DieAfterStores(int writes) { store_.DieAfter(writes); }
  void DieBeforeStore(int write) { store_.DieBefore(write); }  // 1: the next one
  void SetStoreFull(bool full) { shared_.SetFull(full); }
  void SetWriteTime(Micros each) { shared_.SetWriteTime(each); }
  void MoveClock(std::chrono::microseconds by) { clock_moved_ += by; }
  // It runs no code, and its lease runs on.
  void SetStopped(bool stopped);
  bool stopped() const { return stopped_; }
  // It waits for a write, so it answers nobody.
  bool writing() const { return alive() && timeline_.now() < writing_until_; }
  // Whoever asks it is answered.
  bool answers() const { return alive() && !stopped_ && !writing(); }
  // It leads by the store as well.
  bool leads() const { return alive() && (!several_ || shared_.token() == token_); }
  bool ReachesStore() const { return !several_ || network_.Passes(node(), kStoreNode); }
  // All that is stored, as an operator keeps it.
  std::string Backup() const { return shared_.Backup(); }
  // Its machine is lost with the store, and another begins from the backup. For one control plane alone.
  void BeginFrom(const std::string& backup);
  // It died of DieAfterStores or DieBeforeStore.
  std::function<void()> on_died;

  // `action(Cluster&, Now)`; what it sets off goes out, unless it dies of it. Requires alive().
  template <class Action>
  auto Call(Action&& action) {
    auto result = action(*cluster_, Now());
    Publish();
    return result;
  }
  control::Now Now() const;
  const control::Cluster& cluster() const { return *cluster_; }  // requires alive()

  std::uint32_t number() const { return number_; }
  Node node() const { return ControlNode(number_); }
  // Another number each time that it begins to lead, follows or goes on after it was stopped.
  std::uint64_t life() const { return life_ + stops_; }

  // --- Checkpoints: an agent's upload and fetch. Nothing while it is dead.
  absl::Status TakeUpload(const v1::UploadCheckpointRequest& request, const Bytes& bytes);
  absl::StatusOr<Bytes> StateFile(const v1::FetchStateRequest& request);

  const std::vector<std::string>& log() const { return log_; }

 private:
  // --- Election, in simulated_candidate.cpp.
  void Follow();
  void Campaign();
  void WatchElection();
  void LookAtElection();
  void EndReign(const std::string& why);
  void StepDown();
  bool MaySend() const { return !several_ || (!deposed_ && timeline_.now() < steps_down_at_); }
  void AskLease(control::StreamId session, const v1::LeaseRequest& request);
  void ProveLead();
  void Proved(bool answered, bool leads);

  void Lead(std::int64_t token);
  void Drop();
  void BreakAll(const std::map<Node, control::StreamId>& sessions);
  void UpdateStall() { network_.SetStalled(node(), stopped_ || writing()); }
  void Publish();
  void SetOff(const control::Effects& effects);
  void SendDesired(control::StreamId session);
  void OnMessage(Node from, const Bytes& bytes);
  void Disconnected(Node agent);
  void Tick();
  void Restore(const std::string& id);
  void SendTo(control::StreamId session, const v1::ControlMessage& message);
  std::string Random(std::size_t bytes);

  Timeline& timeline_;
  VirtualNetwork& network_;
  SimulatedStore& shared_;
  Chance chance_;
  std::uint32_t number_;
  bool several_;
  StoreClient store_;
  std::unique_ptr<control::Cluster> cluster_;
  std::uint64_t life_ = 0, stops_ = 0;  // numbers of the process and of its reigns
  std::chrono::microseconds clock_moved_{0};
  Micros writing_until_ = 0;
  bool running_ = false, stopped_ = false;
  std::vector<control::Effects> unsent_;  // a write ended while it was stopped
  std::map<Node, control::StreamId> sessions_;
  std::vector<std::string> log_;

  // --- While it leads by an election.
  std::int64_t token_ = 0;
  Micros steps_down_at_ = 0, renews_at_ = 0;
  bool deposed_ = false, look_is_due_ = false;
  control::AskedLeases asked_leases_;
};

}  // namespace tessera::simulation
