// SceneFetch: the packed scene on its way from the regions to a client, and the folder that keeps it for the next time.
//
// Parts come in the order of their places; what overlaps is passed over, so that one region may go on where another
// stopped. The whole must have the SHA-256 that its parts named. A kept file begins with that digest, so a damaged one
// is found, and fetched anew; whatever goes wrong with the folder costs no more than that.
//
// Thread rule: one thread at a time. Files are touched when it is made, by TakeKept and by Finish.
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/replication/scene_transfer.h"
#include "core/world/ids.h"
#include "core/world/scene.h"

namespace tessera::client {

class SceneFetch {
 public:
  using TimePoint = std::chrono::steady_clock::time_point;

  // A region that has sent nothing for so long is asked no more while there is another.
  static constexpr std::chrono::milliseconds kPatience{2000};

  // `scene_hash`: 64 hexadecimal digits. `cache_dir`: empty: nothing is kept.
  SceneFetch(std::string scene_hash, std::string cache_dir);

  // The scene of an earlier time; null if there is none that is whole.
  std::shared_ptr<const Scene> TakeKept() const;

  const replication::Digest& scene_hash() const { return digest_; }
  std::uint64_t offset() const { return bytes_.size(); }
  bool complete() const { return total_ > 0 && bytes_.size() == total_; }
  // INTERNAL: it is a part of another scene than those before it.
  absl::Status Take(const replication::SceneChunk& chunk);
  // Checks the scene, reads and keeps it. Requires complete(). INTERNAL: the regions sent another one than they said.
  absl::StatusOr<std::shared_ptr<const Scene>> Finish() const;

  // The region that sends it, and since when nothing has come from there.
  std::optional<RegionId> source{};
  TimePoint heard_at{};

 private:
  std::string KeptFile() const;
  void Keep() const;

  std::string scene_hash_, cache_dir_;
  replication::Digest digest_{};
  std::uint64_t total_ = 0;
  replication::Digest sha256_{};
  std::vector<std::uint8_t> bytes_;
};

}  // namespace tessera::client
