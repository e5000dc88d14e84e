// SimulatedStore: the store that the control planes of a Deployment share, and the election that it holds among them:
// keys that outlive all of them, the leader's key under a lease, and writes that prove who leads.
//
// It stands for etcd as control_plane/etcd uses it, with the same terms: a lease of 4 s that is renewed at thirds, a
// token that grows with each leader, a write that names another token than the leader's is refused. One control plane
// alone leads without an election, as on SQLite.
//
//   SimulatedStore store(timeline);
//   StoreClient client(store);                       // one control plane's way to it
//   client.Begin(store.Campaign(1));                 // 0: somebody else leads
//   store.RevokeEarly();                             // etcd's fault: the leader does not know
//
// A write takes effect at once, however long its answer takes. Thread rule: one thread at a time.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "control_plane/cluster/cluster.h"
#include "control_plane/memory_store.h"
#include "tests/simulation/virtual_network.h"

namespace tessera::simulation {

constexpr Micros MicrosOf(std::chrono::microseconds span) { return static_cast<Micros>(span.count()); }

// As control_plane/etcd/etcd_election.h has them: the lease, when its holder steps down and renews it, counted from
// when the renewal was sent, and how often anybody looks.
constexpr Micros kElectionTtl = Milliseconds(4000);
constexpr Micros kStepDownAfter = kElectionTtl - kElectionTtl / 10, kRenewAfter = kElectionTtl / 3;
constexpr Micros kElectionPoll = Milliseconds(200);
// An answer to a read, and the share of a slow write by which it comes later: no write holds it up, but the disks that
// are busy with one.
constexpr Micros kReadTime = Milliseconds(2), kSlowReadShare = 8;

struct SimulatedCheckpoint {
  control::records::Manifest manifest;
  std::map<std::string, Bytes> files;
  bool whole = false;
};

class SimulatedStore {
 public:
  explicit SimulatedStore(const Timeline& timeline) : timeline_(timeline) {}

  // --- Election.
  // The token of the new leader. 0: another leads, or the store takes no writes.
  std::int64_t Campaign(std::uint32_t control);
  // False: somebody else leads, or nobody.
  bool Renew(std::int64_t held);
  void Resign(std::int64_t held);
  // The leader's by the store; 0: nobody leads.
  std::int64_t token() const { return timeline_.now() < lease_until_ ? token_ : 0; }
  std::uint32_t leader() const { return token() == 0 ? 0 : leader_; }  // its number; 0: nobody
  std::uint64_t elections() const { return elections_; }

  // --- Faults.
  void SetFull(bool full) { full_ = full; }
  void SetWriteTime(Micros each) { write_time_ = each; }
  // etcd of Debian 12 may revoke a lease before its time, and say yes to its renewal.
  void RevokeEarly() { lease_until_ = 0; }
  // The answer of the next write is lost. `carried_out`: the write is, all the same. `found_out_after`: until its
  // author knows what became of it; beyond etcd's patience it never does, and steps down.
  void LoseAnswer(bool carried_out, Micros found_out_after);
  bool full() const { return full_; }
  Micros write_time() const { return write_time_; }
  Micros read_time() const { return kReadTime + write_time_ / kSlowReadShare; }

  // --- Backups.
  std::string Backup() const;  // as an operator keeps it
  // False: it cannot be restored. Nobody leads then.
  bool BeginFrom(const std::string& backup);

  control::MemoryStore& kept() { return kept_; }
  const control::MemoryStore& kept() const { return kept_; }
  std::map<std::uint64_t, SimulatedCheckpoint>& checkpoints() {
    return checkpoints_;
  }  // by tick; in a folder beside it

 private:
  friend class StoreClient;
  struct LostAnswer {
    bool next = false, carried_out = false;
    Micros found_out_after = 0;
  };

  const Timeline& timeline_;
  control::MemoryStore kept_;
  std::uint8_t restores_ = 0;
  std::map<std::uint64_t, SimulatedCheckpoint> checkpoints_;
  std::int64_t token_ = 0;
  std::uint32_t leader_ = 0;
  Micros lease_until_ = 0;
  std::uint64_t elections_ = 0;
  bool full_ = false;
  Micros write_time_ = 0;
  LostAnswer lost_answer_;
};

// A store whose process may die right after a write or right before one, and that knows whether it leads still.
class StoreClient final : public control::Store {
 public:
  explicit StoreClient(SimulatedStore& shared) : shared_(shared) {}

  absl::StatusOr<control::StoreEntry> Get(std::string_view key) const override;
  absl::StatusOr<std::vector<control::StoreEntry>> ListWithout(std::string_view prefix,
                                                               std::string_view without) const override;
  absl::StatusOr<control::Revision> Txn(std::span<const control::StoreOp> ops) override;
  control::Revision revision() const override { return shared_.kept_.revision(); }

  // Whether anything comes through to the store.
  std::function<bool()> reaches = [] { return true; };

  // A reign begins. 0: no election is held, and every write is the leader's.
  void Begin(std::int64_t token);
  // Its writes are refused from now on, and it is to step down.
  bool lost() const { return lost_; }

  void DieAfter(int writes) { writes_left_ = writes, last_is_lost_ = false; }
  void DieBefore(int write) { writes_left_ = write, last_is_lost_ = true; }
  bool dead() const { return dead_; }
  // The time that its writes since this was last asked take.
  Micros TakeWriteTime() { return std::exchange(writing_for_, 0); }

 private:
  absl::Status Lose(absl::Status why);
  absl::StatusOr<control::Revision> WriteUnanswered(std::span<const control::StoreOp> ops);

  SimulatedStore& shared_;
  std::int64_t token_ = 0;
  bool lost_ = false;
  int writes_left_ = 0;  // 0: it does not die
  bool last_is_lost_ = false, dead_ = false;
  Micros writing_for_ = 0;
};

}  // namespace tessera::simulation
