// EtcdValues: values of any size in etcd, which takes 1.5 MiB a request.
//
// A small value lies under its key. A large one, a scene, is cut into chunks that are written first, under a version
// that no other value ever has, and never change; the key then holds the version, so one small transaction makes the
// value another, whole. Chunks of older versions are removed in that transaction; those that no key ever pointed to are
// removed by `Collect`, when the next leader begins.
//
// Thread rule: `Read` and `Decode` from any thread; all else is the writer's, one at a time.
#pragma once

#include <map>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"
#include "control_plane/etcd/etcd_client.h"
#include "control_plane/etcd/etcd_fence.h"
#include "control_plane/store.h"

namespace tessera::control {

// Bytes of values that lie under their keys, of all writes of one transaction, and bytes of a chunk. Together with keys
// and compares each stays below etcd's 1.5 MiB.
inline constexpr std::size_t kEtcdInlineBytes = 512 << 10, kEtcdChunkBytes = 1 << 20;

class EtcdValues {
 public:
  EtcdValues(const EtcdClient& client, std::string prefix, EtcdFence fence);

  // The value that `stored` stands for, as far as it is there. Errors: those of reading.
  struct Found {
    std::string bytes;
    absl::Status fault;  // as the errors of Decode; OK: it is whole
  };
  absl::StatusOr<Found> Read(std::string_view key, const std::string& stored) const;
  // The same, whole. NOT_FOUND: its chunks are gone, for another value took its place; DATA_LOSS: it
  // is damaged.
  absl::StatusOr<std::string> Decode(std::string_view key, const std::string& stored) const;

  // The form in etcd of each value, in order; chunks are written on return. Errors: those of writing.
  absl::StatusOr<std::vector<std::string>> Encode(std::span<const StoreOp> ops);
  // To the transaction that writes `key` (`stored` empty: deletes it): the removal of the chunks that it leaves.
  void AddRemovals(const std::string& key, const std::string& stored,
                   std::vector<etcdserverpb::RequestOp>& operations) const;
  // The transaction took effect.
  void NoteWritten(const std::string& key, const std::string& stored);

  // Reads which chunks there are, and removes those that no key points to.
  absl::Status Collect();

 private:
  std::string Folder(std::string_view key) const;  // holds all versions of its chunks
  absl::StatusOr<std::string> PutChunks(const StoreOp& op);
  absl::Status PutChunk(const std::string& key, std::string_view bytes) const;
  absl::Status RemoveOrphans(const std::string& key, const std::set<std::string>& versions);

  const EtcdClient& client_;
  const std::string prefix_;
  const EtcdFence fence_;
  std::uint64_t made_ = 0;         // versions, by this leader
  std::set<std::string> chunked_;  // keys of which chunks may lie in etcd
};

// "PREFIX/data/<key>"
std::string EtcdDataKey(std::string_view prefix, std::string_view key);

}  // namespace tessera::control
