#include "client_sdk/scene_fetch.h"

#include <algorithm>
#include <filesystem>
#include <utility>

#include "absl/strings/str_cat.h"
#include "client_sdk/file_path.h"
#include "core/world/byte_view.h"

namespace tessera::client {
namespace {

constexpr std::size_t kDigestBytes = sizeof(replication::Digest);
// One go at a file and at its sum, before the budget is asked again.
constexpr std::size_t kAtOnce_bytes = std::size_t{32} * 1024;
// Bytes that a unit reads from a file, sums, there and here, and unpacks.
constexpr std::int64_t kReadAUnit_bytes = 32, kKeptSummedAUnit_bytes = 9, kSummedAUnit_bytes = 3,
                       kUnpackedAUnit_bytes = 6;

}  // namespace

SceneFetch::SceneFetch(std::string scene_hash, std::string cache_dir, std::vector<std::uint8_t> packed)
    : scene_hash_(std::move(scene_hash)), cache_dir_(std::move(cache_dir)) {
  if (auto digest = replication::DigestFrom(scene_hash_); digest.ok()) digest_ = *digest;
  if (!packed.empty()) {
    source_of_bytes_ = From::kCaller;
    bytes_ = std::move(packed);
    total_ = summed_ = bytes_.size();
  } else if (!cache_dir_.empty() && OpenKept()) {
    source_of_bytes_ = From::kFolder;
  }
}

// The version of the packed form is in the name: another library's files are not in its way.
std::string SceneFetch::KeptFile() const {
  return TextOf(FilePath(cache_dir_) / absl::StrCat(scene_hash_, ".", kPackedSceneVersion, ".tsrs"));
}

bool SceneFetch::OpenKept() {
  kept_.open(FilePath(KeptFile()), std::ios::binary | std::ios::ate);
  const std::int64_t size = kept_ ? static_cast<std::int64_t>(kept_.tellg()) : 0;
  if (size <= static_cast<std::int64_t>(kDigestBytes)) return false;
  if (static_cast<std::uint64_t>(size) > kMaxPackedSceneBytes + kDigestBytes) return false;
  kept_.seekg(0);
  kept_.read(reinterpret_cast<char*>(expected_.data()), static_cast<std::streamsize>(kDigestBytes));
  total_ = static_cast<std::uint64_t>(size) - kDigestBytes;
  bytes_.reserve(static_cast<std::size_t>(total_));
  return static_cast<bool>(kept_);
}

void SceneFetch::ReadKept(WorkBudget& budget) {
  while (source_of_bytes_ == From::kFolder && !complete() && budget.left()) {
    const std::size_t begin = bytes_.size();
    const auto size = static_cast<std::size_t>(std::min<std::uint64_t>(kAtOnce_bytes, total_ - begin));
    bytes_.resize(begin + size);
    kept_.read(reinterpret_cast<char*>(bytes_.data() + begin), static_cast<std::streamsize>(size));
    budget.Spend(static_cast<std::int64_t>(size) / kReadAUnit_bytes);
    if (!kept_) AskRegions();
  }
}

// The folder's file is none.
void SceneFetch::AskRegions() {
  source_of_bytes_ = From::kRegions;
  kept_.close();
  bytes_.clear();
  unpacker_.reset();
  (void)sum_.Finish();
  (void)kept_sum_.Finish();
  summed_ = 0;
  total_ = 0;
}

absl::Status SceneFetch::Take(const replication::SceneChunk& chunk) {
  if (!from_regions()) return absl::OkStatus();
  if (total_ == 0) {
    total_ = chunk.total_bytes;
    expected_ = chunk.sha256;
    bytes_.reserve(static_cast<std::size_t>(std::min<std::uint64_t>(total_, kMaxPackedSceneBytes)));
  }
  if (chunk.total_bytes != total_ || chunk.sha256 != expected_) {
    return absl::InternalError("the regions send different scenes");
  }
  // A chunk that is there already, or would leave a gap, is nothing new.
  if (chunk.offset > bytes_.size() || chunk.offset + chunk.bytes.size() <= bytes_.size()) return absl::OkStatus();
  const auto fresh = chunk.bytes.subspan(static_cast<std::size_t>(bytes_.size() - chunk.offset));
  bytes_.insert(bytes_.end(), fresh.begin(), fresh.end());
  return absl::OkStatus();
}

void SceneFetch::Check(WorkBudget& budget) {
  while (summed_ < bytes_.size() && budget.left()) {
    const std::size_t size = std::min(kAtOnce_bytes, bytes_.size() - summed_);
    const std::span part = std::span(bytes_).subspan(summed_, size);
    const bool kept = source_of_bytes_ == From::kFolder;
    if (kept) {
      kept_sum_.Add(part);
    } else {
      sum_.Add(part);
    }
    summed_ += size;
    budget.Spend(static_cast<std::int64_t>(size) / (kept ? kKeptSummedAUnit_bytes : kSummedAUnit_bytes));
  }
}

bool SceneFetch::IsAsExpected() {
  switch (source_of_bytes_) {
    case From::kFolder:
      return kept_sum_.Finish() == expected_;
    case From::kRegions:
      return sum_.Finish() == expected_;
    case From::kCaller:
      break;
  }
  return true;
}

absl::StatusOr<std::shared_ptr<const Scene>> SceneFetch::Go(WorkBudget& budget) {
  const std::shared_ptr<const Scene> not_yet;
  ReadKept(budget);
  Check(budget);
  if (!complete() || summed_ < bytes_.size() || !budget.left()) return not_yet;
  if (unpacker_ == nullptr) {
    if (!IsAsExpected()) {
      if (from_regions()) return absl::InternalError("the regions' scene is not the one that they named");
      AskRegions();
      return not_yet;
    }
    unpacker_ = std::make_unique<SceneUnpacker>(bytes_);
  }
  const std::int64_t units = budget.units_left();
  if (!unpacker_->Go(static_cast<std::size_t>(units * kUnpackedAUnit_bytes))) {
    budget.Spend(units);
    return not_yet;
  }
  return Unpacked();
}

absl::StatusOr<std::shared_ptr<const Scene>> SceneFetch::Unpacked() {
  auto scene = unpacker_->Take();
  index_ = unpacker_->index();
  if (scene.ok() || source_of_bytes_ == From::kCaller) return scene;
  if (from_regions()) return absl::InternalError(absl::StrCat("the regions' scene: ", scene.status().message()));
  AskRegions();
  return std::shared_ptr<const Scene>();
}

std::unique_ptr<SceneKeeper> SceneFetch::TakeKeeper() {
  if (!from_regions() || cache_dir_.empty()) return nullptr;
  unpacker_.reset();  // it reads the bytes
  return std::make_unique<SceneKeeper>(KeptFile(), std::move(bytes_));
}

}  // namespace tessera::client
