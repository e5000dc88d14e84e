// Store: the revisioned key-value map with compare-and-swap in which the control plane keeps what must outlive it.
//
// Promises. A transaction takes effect whole or not at all, and once it returns OK it survives the loss of the process
// and of the machine's power (as far as the implementation is durable). Each transaction has a revision, higher than
// the last; a key's revision is that of the transaction which wrote it last. Revisions never go back, also over deletes
// and restarts.
//
// A write states the revision at which its author last saw the key, so two authors can never overwrite each other
// unseen:
//
//   absl::StatusOr<StoreEntry> seen = store.Get("hosts/host-1");
//   absl::StatusOr<Revision> written = store.Put("hosts/host-1", bytes, seen->revision);  // kAborted if changed since
//
// Thread rule: any thread; calls are atomic and happen in one order. Implementations: MemoryStore, SqliteStore and
// etcd/etcd_store.h; all pass the suite in store_test.cpp.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace tessera::control {

using Revision = std::int64_t;

// An expected revision that says that the key does not exist.
inline constexpr Revision kAbsent = 0;

struct StoreEntry {
  std::string key;
  std::string value;
  Revision revision = kAbsent;
  bool damaged = false;  // only in a list: the value is not whole in the store, and this is what is left of it
};

// One write of a transaction.
struct StoreOp {
  enum class Kind { kPut, kDelete };
  Kind kind = Kind::kPut;
  std::string key;
  std::string value;            // only for a put
  Revision expected = kAbsent;  // the key's before the transaction; a delete needs one that exists
};

inline StoreOp PutOp(std::string key, std::string value, Revision expected) {
  return {StoreOp::Kind::kPut, std::move(key), std::move(value), expected};
}
inline StoreOp DeleteOp(std::string key, Revision expected) {
  return {StoreOp::Kind::kDelete, std::move(key), {}, expected};
}

class Store {
 public:
  virtual ~Store() = default;

  // kNotFound names the key; kDataLoss: its value is not whole any more.
  virtual absl::StatusOr<StoreEntry> Get(std::string_view key) const = 0;
  // All keys that start with `prefix` and not with `without`, which is not read; ascending by byte value. Empty
  // `without`: none is left out. A value that is damaged is marked, and the rest of the list is there.
  virtual absl::StatusOr<std::vector<StoreEntry>> ListWithout(std::string_view prefix,
                                                              std::string_view without) const = 0;
  absl::StatusOr<std::vector<StoreEntry>> List(std::string_view prefix) const { return ListWithout(prefix, {}); }
  // Writes all of `ops` or none, and returns the revision of the whole. Errors: kAborted when a key is not at its
  // expected revision, naming it; kInvalidArgument for no op, an empty key, a key named twice or a delete that expects
  // kAbsent; kUnavailable when it could not be written; kFailedPrecondition when this process may write no more.
  virtual absl::StatusOr<Revision> Txn(std::span<const StoreOp> ops) = 0;
  // The last transaction's; 0 before the first.
  virtual Revision revision() const = 0;

  absl::StatusOr<Revision> Put(std::string_view key, std::string_view value, Revision expected);
  absl::StatusOr<Revision> Delete(std::string_view key, Revision expected);

 protected:
  // Every implementation checks this first.
  static absl::Status CheckOps(std::span<const StoreOp> ops);
  static absl::Status Conflict(const StoreOp& op, Revision found);
};

}  // namespace tessera::control
