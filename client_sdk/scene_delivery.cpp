#include "client_sdk/scene_delivery.h"

#include <utility>

namespace tessera::client {

void SceneDelivery::Begin(std::string scene_hash, std::string cache_dir, std::vector<std::uint8_t> packed) {
  fetch_.emplace(std::move(scene_hash), std::move(cache_dir), std::move(packed));
}

void SceneDelivery::Choose(TimePoint now, std::span<const RegionId> welcomed) {
  if (fetch_ && fetch_->from_regions()) (void)source_.Choose(now, welcomed);
}

replication::SceneRequest SceneDelivery::RequestTo(RegionId region) const {
  using Want = replication::SceneRequest::Want;
  if (!fetch_) return {.want = Want::kHave};
  return {.want = source_.is(region) ? Want::kSend : Want::kHold,
          .scene_hash = fetch_->scene_hash(),
          .offset = fetch_->offset()};
}

absl::StatusOr<bool> SceneDelivery::Take(TimePoint now, RegionId from, const replication::SceneChunk& chunk) {
  if (!fetch_) return false;  // the rest of what was on its way
  const std::uint64_t before = fetch_->offset();
  if (absl::Status status = fetch_->Take(chunk); !status.ok()) return status;
  if (fetch_->offset() == before) return false;
  if (source_.is(from)) source_.Heard(now);
  return true;
}

absl::StatusOr<SceneDelivery::Read> SceneDelivery::Work(WorkBudget& budget) {
  if (keeper_ && keeper_->Go(budget)) keeper_.reset();
  if (!fetch_) return Read{};
  absl::StatusOr<std::shared_ptr<const Scene>> scene = fetch_->Go(budget);
  if (!scene.ok()) return scene.status();
  if (*scene == nullptr) return Read{};
  Read read{.scene = *std::move(scene), .index = fetch_->index()};
  keeper_ = fetch_->TakeKeeper();
  fetch_.reset();
  return read;
}

}  // namespace tessera::client
