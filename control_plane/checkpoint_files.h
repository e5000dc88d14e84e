// CheckpointFiles: checkpoints of worlds, in a folder or a bucket (checkpoint_target.h).
//
// Each checkpoint has the files "scene", "game" where it runs one, "region-<n>" for each region, and "manifest", which
// has their sizes and SHA-256 and its own. It is published when all are kept, so one that is there is whole, or was
// damaged since, which its sums show.
//
//   files.Put("inst-7", 1200, "region-1", bytes);       // as they come
//   files.Complete("inst-7", manifest);
//   files.Check("inst-7", 1200);                         // DATA_LOSS names the file
//
// Errors are those of the target, with the checkpoint and the file in front. Thread rule: as CheckpointTarget.
#pragma once

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "control_plane/checkpoint_target.h"
#include "control_plane/control_records.pb.h"
#include "control_plane/draft_file.h"

namespace tessera::control {

class CheckpointFiles {
 public:
  explicit CheckpointFiles(std::unique_ptr<CheckpointTarget> target) : target_(std::move(target)) {}
  // In a folder: see FolderTarget::Open.
  static absl::StatusOr<std::unique_ptr<CheckpointFiles>> Open(std::string folder, std::uint64_t reserve = 0);

  // As an operator wrote it.
  const std::string& name() const { return target_->name(); }
  // OK: a checkpoint of so many bytes can be made now; else why not.
  absl::Status CheckRoom(std::uint64_t bytes) const { return target_->CheckRoom(bytes); }

  // For a file that comes in pieces, and is put when it is whole.
  absl::StatusOr<DraftFile> NewDraft() const { return DraftFile::Create(target_->DraftFolder()); }

  // Adds a file to a checkpoint that is being made; it is kept on return. Putting it again replaces it.
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
  // Ends what waits for the target: see CheckpointTarget::Stop.
  void Stop() const { target_->Stop(); }
  // The instances that anything is kept of, ascending.
  absl::StatusOr<std::vector<std::string>> Instances() const;

  // One line beside all checkpoints. NOT_FOUND: there is none. The target keeps it where a world "cluster" would be.
  absl::StatusOr<std::string> ReadMark() const;
  absl::Status WriteMark(const std::string& mark) const;

 private:
  const std::unique_ptr<CheckpointTarget> target_;
};

inline constexpr char kSceneFile[] = "scene", kGameFile[] = "game";
std::string RegionFileName(std::uint32_t region);  // "region-3"

// A native game has none: it lies with the hosts.
bool HasGameFile(const records::Manifest& manifest);

}  // namespace tessera::control
