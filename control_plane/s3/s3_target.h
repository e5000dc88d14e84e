// S3Target: checkpoints in a bucket, as objects <prefix><instance>/<tick>/<file>.
//
// A checkpoint is published by its manifest, which is put last; there is nothing to rename. Several control planes may
// share a bucket: they need no folder that all of them reach. What was left half made stays until its world is removed.
//
// A store that does not answer stops checkpoints: CheckRoom says why until a request succeeds, and asks anew every
// kS3ProbeInterval. Errors as S3Client; DATA_LOSS of what is read is left to the sums.
//
// Thread rule: as CheckpointTarget.
#pragma once

#include <chrono>
#include <memory>
#include <mutex>

#include "control_plane/checkpoint_target.h"
#include "control_plane/s3/s3_client.h"

namespace tessera::control {

inline constexpr std::chrono::seconds kS3ProbeInterval{5};
inline constexpr char kS3DraftFolder[] = "/var/tmp";  // on a disk, where /tmp may be memory

class S3Target final : public CheckpointTarget {
 public:
  // Asks the store once. PERMISSION_DENIED or NOT_FOUND: it refuses us, or has no such bucket; a store that does not
  // answer now is taken for one that will.
  static absl::StatusOr<std::unique_ptr<S3Target>> Open(S3Settings settings, S3Patience patience = {});

  const std::string& name() const override { return client_.name(); }
  absl::Status CheckRoom(std::uint64_t bytes) override;
  absl::Status Put(const std::string& instance, std::uint64_t tick, const std::string& file,
                   const std::string& bytes) override;
  absl::Status Publish(const std::string& instance, std::uint64_t tick, const std::string& manifest) override;
  void Abandon(const std::string& instance, std::uint64_t tick) override;
  absl::StatusOr<std::string> Read(const std::string& instance, std::uint64_t tick, const std::string& file) override;
  void Remove(const std::string& instance, std::uint64_t tick) override;
  void RemoveAll(const std::string& instance) override;
  absl::StatusOr<std::vector<std::string>> Instances() override;
  std::string DraftFolder() const override { return kS3DraftFolder; }
  void Stop() override { client_.Stop(); }

 private:
  using Clock = std::chrono::steady_clock;
  S3Target(S3Settings settings, S3Patience patience) : client_(std::move(settings), patience) {}
  absl::Status Probe();
  // Notes whether writing works.
  absl::Status Note(absl::Status status);
  void RemoveUnder(const std::string& prefix);

  S3Client client_;
  std::mutex mutex_;
  absl::Status trouble_;
  Clock::time_point probe_at_{};
};

}  // namespace tessera::control
