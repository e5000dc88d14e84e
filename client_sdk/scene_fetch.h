// SceneFetch: the packed scene on its way to a client: from the folder that keeps it, from its caller, or from the
// regions.
//
// Reading, checking and unpacking a large scene takes a tenth of a second, so they go on a little with each poll (Go),
// counted by a WorkBudget. Parts of the regions come in the order of their places; what overlaps is passed over, so
// that one region may go on where another stopped. The whole must have the SHA-256 that its parts named. A kept file
// begins with a sum of its own (kept_sum.h), so a damaged one is found, and the scene is fetched; whatever goes wrong
// with the folder costs no more than that.
//
// Thread rule: one thread at a time. The constructor, Go and the keeper touch files.
#pragma once

#include <cstdint>
#include <fstream>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "client_sdk/kept_sum.h"
#include "client_sdk/scene_keeper.h"
#include "client_sdk/work_budget.h"
#include "core/replication/scene_transfer.h"
#include "core/world/packed_scene.h"
#include "core/world/scene.h"
#include "core/world/sha256.h"

namespace tessera::client {

class SceneFetch {
 public:
  // `scene_hash`: 64 hexadecimal digits. `cache_dir`: empty: nothing is kept. `packed`: the caller's; empty: the folder
  // or the regions have it.
  SceneFetch(std::string scene_hash, std::string cache_dir, std::vector<std::uint8_t> packed = {});

  const replication::Digest& scene_hash() const { return digest_; }
  std::uint64_t offset() const { return bytes_.size(); }
  bool complete() const { return total_ > 0 && bytes_.size() == total_; }
  // Whether the regions are to be asked.
  bool from_regions() const { return source_of_bytes_ == From::kRegions; }
  // A part came from a region. INTERNAL: it is a part of another scene than those before it.
  absl::Status Take(const replication::SceneChunk& chunk);
  // Goes on with what is here: the scene once it is read, null until then. INTERNAL: the regions sent something else
  // than they said; INVALID_ARGUMENT: the caller's scene is damaged.
  absl::StatusOr<std::shared_ptr<const Scene>> Go(WorkBudget& budget);
  // After Go has given the scene: its tiles; null if all is in it.
  const std::shared_ptr<const LevelIndex>& index() const { return index_; }
  // After Go has given a scene of the regions, once: keeps it. Null if it is not to be kept.
  std::unique_ptr<SceneKeeper> TakeKeeper();

 private:
  enum class From : std::uint8_t { kFolder, kCaller, kRegions };

  std::string KeptFile() const;
  bool OpenKept();
  void ReadKept(WorkBudget& budget);
  void AskRegions();
  void Check(WorkBudget& budget);
  bool IsAsExpected();  // once all is summed
  absl::StatusOr<std::shared_ptr<const Scene>> Unpacked();

  std::string scene_hash_, cache_dir_;
  replication::Digest digest_{};
  From source_of_bytes_ = From::kRegions;
  std::ifstream kept_;
  std::uint64_t total_ = 0;
  replication::Digest expected_{};  // the sum of the bytes
  std::vector<std::uint8_t> bytes_;
  Sha256 sum_;        // over what regions sent
  KeptSum kept_sum_;  // over a kept file
  std::size_t summed_ = 0;
  std::unique_ptr<SceneUnpacker> unpacker_;
  std::shared_ptr<const LevelIndex> index_;
};

}  // namespace tessera::client
