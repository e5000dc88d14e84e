// SimulatedControl: the control plane of a Deployment: control_plane's Cluster in virtual time, over a store that
// outlives it, with agents at the end of connections. What gRPC, threads and the disk do in the product is all that is
// made anew here.
//
//   control.DieAfterStores(2);   // the second thing from now that it stores is the last it does: nobody is told
//   control.SetStoreFull(true);  // nothing is written until this ends
//   control.SetWriteTime(Milliseconds(2000));  // a write takes so long, and it stands still for that
//   control.MoveClock(std::chrono::hours(24));  // its wall clock, and no other
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

#include "control_plane/cluster/cluster.h"
#include "control_plane/memory_store.h"
#include "tests/simulation/virtual_network.h"

namespace tessera::simulation {

constexpr Node kControlNode = 4095;
constexpr Node AgentNode(std::uint32_t host) { return host * 4096 + 4094; }
constexpr std::uint32_t kControlPlace = 1'000'000;

// A store whose process may die right after a write or right before one, and whose disk may be full.
class FragileStore final : public control::Store {
 public:
  absl::StatusOr<control::StoreEntry> Get(std::string_view key) const override { return kept_.Get(key); }
  absl::StatusOr<std::vector<control::StoreEntry>> ListWithout(std::string_view prefix,
                                                               std::string_view without) const override {
    return kept_.ListWithout(prefix, without);
  }
  absl::StatusOr<control::Revision> Txn(std::span<const control::StoreOp> ops) override {
    if (dead_) return absl::UnavailableError("dead");
    ++tried_;
    if (full_) return absl::UnavailableError("the disk is full");
    if (writes_left_ > 0) dead_ = --writes_left_ == 0;
    if (dead_ && last_is_lost_) return absl::UnavailableError("dead");
    return kept_.Txn(ops);
  }
  control::Revision revision() const override { return kept_.revision(); }

  void DieAfter(int writes) {
    writes_left_ = writes;
    last_is_lost_ = false;
  }
  void DieBefore(int write) {
    writes_left_ = write;
    last_is_lost_ = true;
  }
  bool dead() const { return dead_; }
  void SetFull(bool full) { full_ = full; }
  // Writes that were tried since this was last asked.
  Micros TakeTried() { return std::exchange(tried_, 0); }
  void Promote() {
    dead_ = false;
    writes_left_ = 0;
  }

 private:
  control::MemoryStore kept_;
  int writes_left_ = 0;  // 0: it does not die
  bool last_is_lost_ = false, dead_ = false, full_ = false;
  Micros tried_ = 0;
};

class SimulatedControl {
 public:
  SimulatedControl(Timeline& timeline, VirtualNetwork& network, std::uint64_t seed);

  void Start();  // with what is stored
  void Kill();
  bool alive() const { return cluster_ != nullptr; }
  void DieAfterStores(int writes) { store_.DieAfter(writes); }
  void DieBeforeStore(int write) { store_.DieBefore(write); }  // 1: the next one
  void SetStoreFull(bool full) { store_.SetFull(full); }
  void SetWriteTime(Micros each) { write_time_ = each; }
  void MoveClock(std::chrono::microseconds by) { clock_moved_ += by; }
  // It waits for a write, so it answers nobody.
  bool writing() const { return alive() && timeline_.now() < writing_until_; }
  // All that is stored, as an operator keeps it.
  std::string Backup() const;
  // Its machine is lost with the store, and another begins from the backup.
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

  // --- Checkpoints: an agent's upload and fetch. Nothing while it is dead.
  absl::Status TakeUpload(const v1::UploadCheckpointRequest& request, const Bytes& bytes);
  absl::StatusOr<Bytes> StateFile(const v1::FetchStateRequest& request);

  const std::vector<std::string>& log() const { return log_; }

 private:
  void Publish();
  void SetOff(const control::Effects& effects);
  void SendDesired(control::StreamId session);
  void OnMessage(Node from, const Bytes& bytes);
  void Disconnected(Node agent);
  void Tick();
  void Restore(const std::string& id);
  void SendTo(control::StreamId session, const v1::ControlMessage& message);
  std::string Random(std::size_t bytes);

  struct Checkpoint {
    control::records::Manifest manifest;
    std::map<std::string, Bytes> files;
    bool whole = false;
  };

  Timeline& timeline_;
  VirtualNetwork& network_;
  Chance chance_;
  FragileStore store_;
  std::unique_ptr<control::Cluster> cluster_;
  std::uint64_t life_ = 0;
  std::chrono::microseconds clock_moved_{0};
  Micros write_time_ = 0, writing_until_ = 0;
  std::map<Node, control::StreamId> sessions_;
  std::map<std::uint64_t, Checkpoint> checkpoints_;  // by tick; on its disk
  std::vector<std::string> log_;
};

}  // namespace tessera::simulation
