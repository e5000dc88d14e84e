// EtcdStore: the Store of a cluster with several control planes, in etcd. Only the leader has one.
//
// Revisions are etcd's: a key's is its mod_revision. Every transaction compares three things: the fence, so that no
// write of a deposed leader counts; the revisions that the caller expects; and PREFIX/head, which each transaction
// writes. The last makes the outcome of a write that was not answered certain: a barrier, a transaction that does no
// more than write PREFIX/head, either succeeds, and then the write can never take effect any more, or finds the write's
// mark there. Where neither can be learned in kEtcdSettlePatience the store is lost: it writes nothing more, and its
// owner has to step down.
//
//   PREFIX/leader         the election's: etcd_election.h
//   PREFIX/head           "tessera 1 <mark>": the form's version, the mark of the last transaction
//   PREFIX/data/<key>     values, or pointers to
//   PREFIX/chunk/...      large values: etcd_values.h
//
// Thread rule: any thread. Writes and lists wait for each other; `Get` waits for nobody.
#pragma once

#include <functional>
#include <memory>
#include <mutex>

#include "control_plane/etcd/etcd_client.h"
#include "control_plane/etcd/etcd_fence.h"
#include "control_plane/etcd/etcd_values.h"
#include "control_plane/store.h"

namespace tessera::control {

// Reads one value without being the leader. NOT_FOUND names the key.
absl::StatusOr<std::string> ReadEtcdValue(const EtcdClient& client, const std::string& prefix, std::string_view key);

class EtcdStore final : public Store {
 public:
  // `on_lost` is called once, from within a write, when the store is lost. `client` outlives it. FAILED_PRECONDITION:
  // what lies under the prefix is no store, or of a newer version; UNAVAILABLE: etcd does not answer.
  static absl::StatusOr<std::unique_ptr<EtcdStore>> Open(const EtcdClient& client, const std::string& prefix,
                                                         const EtcdFence& fence, std::function<void()> on_lost);

  absl::StatusOr<StoreEntry> Get(std::string_view key) const override;
  absl::StatusOr<std::vector<StoreEntry>> ListWithout(std::string_view prefix, std::string_view without) const override;
  // FAILED_PRECONDITION: this control plane no longer leads.
  absl::StatusOr<Revision> Txn(std::span<const StoreOp> ops) override;
  Revision revision() const override;

 private:
  EtcdStore(const EtcdClient& client, const std::string& prefix, const EtcdFence& fence, std::function<void()> on_lost);
  absl::Status ReadHead();
  absl::Status ListRange(const std::string& first, const std::string& end, std::vector<StoreEntry>& entries) const;
  // With the lock held, all that follow.
  absl::StatusOr<Revision> Write(std::span<const StoreOp> ops);
  absl::Status CheckExpected(std::span<const StoreOp> ops) const;
  void AddGuards(etcdserverpb::TxnRequest& request, const std::string& mark) const;
  absl::StatusOr<Revision> Commit(const std::vector<etcdserverpb::RequestOp>& operations,
                                  std::span<const StoreOp> compared);
  std::vector<etcdserverpb::RequestOp> Operations(std::span<const StoreOp> ops,
                                                  const std::vector<std::string>& stored) const;
  absl::StatusOr<Revision> AfterNoSpace(const std::string& mark, const absl::Status& why);
  absl::Status Refusal(const etcdserverpb::TxnResponse& response, std::span<const StoreOp> compared);
  absl::StatusOr<Revision> Settle(const std::string& mark, const absl::Status& why);
  absl::Status Lose(absl::Status why);
  void CompactNowAndThen();
  std::string NextMark();

  const EtcdClient& client_;
  const std::string prefix_;
  const EtcdFence fence_;
  const std::function<void()> on_lost_;
  mutable std::mutex mutex_;
  EtcdValues values_;
  Revision head_ = kAbsent;  // mod_revision of PREFIX/head
  std::uint64_t marks_ = 0;
  absl::Status lost_;
  // Transactions since the last compaction, and the revision that it will go up to.
  int since_compaction_ = 0;
  Revision compact_to_ = kAbsent;
};

}  // namespace tessera::control
