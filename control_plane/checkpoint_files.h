// CheckpointFiles: checkpoints on the control plane's disk.
//
// Each checkpoint is a folder, <folder>/<instance>/<tick>/: "scene", "game" where it runs one, "region-<n>" for each
// region, and "manifest", which has their sizes and SHA-256 and its own. It is made under another name and renamed when
// all is on the disk, so one that is there is whole, or was damaged since, which its sums show. `Open` removes those
// that were left half made.
//
//   files.Put("inst-7", 1200, "region-1", bytes);       // as they come
//   files.Complete("inst-7", manifest);
//   files.Check("inst-7", 1200);                         // DATA_LOSS names the file
//
// The store may lie on the same disk, and without a write to it nothing that dies is replaced: so a reserve is left to
// it. Checkpoints stop first, with RESOURCE_EXHAUSTED.
//
// Thread rule: any thread; two callers of one checkpoint must not complete or remove it at once.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "control_plane/control_records.pb.h"

namespace tessera::control {

class CheckpointFiles {
 public:
  // UNAVAILABLE if the folder cannot be made. `reserve`: bytes of its disk that checkpoints leave to others.
  static absl::StatusOr<std::unique_ptr<CheckpointFiles>> Open(std::string folder, std::uint64_t reserve = 0);

  // Bytes of the disk that checkpoints may take still: what is free less the reserve. UNAVAILABLE: the disk does not
  // say.
  absl::StatusOr<std::uint64_t> Room() const;
  // RESOURCE_EXHAUSTED, with what is free and what is kept, where there is no room for so many.
  absl::Status CheckRoom(std::uint64_t bytes) const;

  // Adds a file to a checkpoint that is being made; it is on the disk on return. Putting it again replaces it.
  absl::Status Put(const std::string& instance, std::uint64_t tick, const std::string& name,
                   const std::string& bytes) const;
  // Completes it and returns its size in bytes. The manifest must name every file that was put.
  absl::StatusOr<std::uint64_t> Complete(const std::string& instance, const records::Manifest& manifest) const;
  // Removes one that is being made.
  void Abandon(const std::string& instance, std::uint64_t tick) const;

  absl::StatusOr<records::Manifest> ReadManifest(const std::string& instance, std::uint64_t tick) const;
  // Reads all files. DATA_LOSS or NOT_FOUND: "checkpoint 1200 of inst-7: region-2: has another checksum".
  absl::Status Check(const std::string& instance, std::uint64_t tick) const;
  absl::StatusOr<std::string> Read(const std::string& instance, std::uint64_t tick, const std::string& name) const;
  void Remove(const std::string& instance, std::uint64_t tick) const;
  void RemoveAll(const std::string& instance) const;
  // The instances that have a folder here, ascending.
  std::vector<std::string> Instances() const;

 private:
  CheckpointFiles(std::string folder, std::uint64_t reserve) : folder_(std::move(folder)), reserve_(reserve) {}
  std::string Path(const std::string& instance, std::uint64_t tick) const;
  std::string DraftPath(const std::string& instance, std::uint64_t tick) const;

  std::string folder_;
  std::uint64_t reserve_;
};

inline constexpr char kSceneFile[] = "scene", kGameFile[] = "game";
std::string RegionFileName(std::uint32_t region);  // "region-3"

// A native game has none: it lies with the hosts.
bool HasGameFile(const records::Manifest& manifest);

// One checkpoint as one file, for another cluster, and back. DATA_LOSS or INVALID_ARGUMENT: "file: ...".
std::string Bundle(const records::Bundle& bundle);
absl::StatusOr<records::Bundle> Unbundle(const std::string& bytes);
void AddContent(records::Bundle& bundle, const std::string& name, std::string bytes);
// Null without a file of that name.
const std::string* FindContent(const records::Bundle& bundle, const std::string& name);

}  // namespace tessera::control
