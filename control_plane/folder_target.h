// FolderTarget: checkpoints in a folder of a disk.
//
// Each is a folder, <folder>/<instance>/<tick>/. It is made under another name and renamed when all is on the disk.
// `Open` removes those that were left half made.
//
// The store may lie on the same disk, and without a write to it nothing that dies is replaced: so a reserve is left to
// it. Checkpoints stop first, with RESOURCE_EXHAUSTED.
#pragma once

#include <memory>
#include <utility>

#include "control_plane/checkpoint_target.h"

namespace tessera::control {

class FolderTarget final : public CheckpointTarget {
 public:
  // UNAVAILABLE if the folder cannot be made. `reserve`: bytes of its disk that checkpoints leave to others.
  static absl::StatusOr<std::unique_ptr<FolderTarget>> Open(std::string folder, std::uint64_t reserve);

  const std::string& name() const override { return folder_; }
  absl::Status CheckRoom(std::uint64_t bytes) override;
  absl::Status Put(const std::string& instance, std::uint64_t tick, const std::string& file,
                   const std::string& bytes) override;
  absl::Status Publish(const std::string& instance, std::uint64_t tick, const std::string& manifest) override;
  void Abandon(const std::string& instance, std::uint64_t tick) override;
  absl::StatusOr<std::string> Read(const std::string& instance, std::uint64_t tick, const std::string& file) override;
  void Remove(const std::string& instance, std::uint64_t tick) override;
  void RemoveAll(const std::string& instance) override;
  std::string DraftFolder() const override { return folder_; }
  absl::StatusOr<std::vector<std::string>> Instances() override;

 private:
  FolderTarget(std::string folder, std::uint64_t reserve) : folder_(std::move(folder)), reserve_(reserve) {}
  std::string Path(const std::string& instance, std::uint64_t tick) const;
  std::string DraftPath(const std::string& instance, std::uint64_t tick) const;

  const std::string folder_;
  const std::uint64_t reserve_;
};

}  // namespace tessera::control
