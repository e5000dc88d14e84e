// CheckpointTarget: where checkpoints lie: a folder, or a bucket of an object store.
//
// A checkpoint is files under (instance, tick). It is there once it is published: until then nobody finds it, and it
// can be abandoned. Names of files are [a-z0-9-]. What is read may have been damaged since: the caller compares sums.
//
// Errors: UNAVAILABLE, the target does not answer or cannot be written now; PERMISSION_DENIED, it refuses who asks;
// RESOURCE_EXHAUSTED, it is full; NOT_FOUND, there is no such file; DATA_LOSS, a file cannot be read or is larger than
// any that was put.
//
// Thread rule: any thread; two callers of one checkpoint must not publish or remove it at once. Calls block for as long
// as the target takes.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace tessera::control {

class CheckpointTarget {
 public:
  virtual ~CheckpointTarget() = default;

  // As an operator wrote it: "/var/lib/tessera/checkpoints", "s3://bucket/prefix".
  virtual const std::string& name() const = 0;
  // OK: a checkpoint of so many bytes can be made now; else why not.
  virtual absl::Status CheckRoom(std::uint64_t bytes) = 0;

  // The file is kept on return. Putting it again replaces it.
  virtual absl::Status Put(const std::string& instance, std::uint64_t tick, const std::string& file,
                           const std::string& bytes) = 0;
  // Puts `manifest` as the last file. It takes the place of a published checkpoint of the same tick.
  virtual absl::Status Publish(const std::string& instance, std::uint64_t tick, const std::string& manifest) = 0;
  // Removes what was put and not published.
  virtual void Abandon(const std::string& instance, std::uint64_t tick) = 0;

  virtual absl::StatusOr<std::string> Read(const std::string& instance, std::uint64_t tick,
                                           const std::string& file) = 0;
  virtual void Remove(const std::string& instance, std::uint64_t tick) = 0;
  virtual void RemoveAll(const std::string& instance) = 0;
  // A folder of this machine for files that are not whole yet.
  virtual std::string DraftFolder() const = 0;
  // Calls that wait for the target end soon, with an error, and so do later ones.
  virtual void Stop() {}

  // The instances that anything is kept of, ascending.
  virtual absl::StatusOr<std::vector<std::string>> Instances() = 0;
};

// The name of the file that says what belongs to a checkpoint, and the most bytes that are read of one: more than the
// state of a region with a million bodies.
inline constexpr char kManifestFile[] = "manifest";
inline constexpr std::size_t kMaxCheckpointFileBytes = std::size_t{1} << 30;

}  // namespace tessera::control
