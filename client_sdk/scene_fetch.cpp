#include "client_sdk/scene_fetch.h"

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/world/byte_view.h"
#include "core/world/packed_scene.h"
#include "core/world/sha256.h"

namespace tessera::client {
namespace {

replication::Digest DigestOf(std::span<const std::uint8_t> bytes) {
  return *replication::DigestFrom(Sha256Hex(AsText(bytes)));
}

std::vector<std::uint8_t> ReadWhole(const std::string& file) {
  std::ifstream in(file, std::ios::binary | std::ios::ate);
  const auto size = in ? static_cast<std::int64_t>(in.tellg()) : 0;
  if (size <= 0 || static_cast<std::uint64_t>(size) > kMaxPackedSceneBytes + sizeof(replication::Digest)) return {};
  std::vector<std::uint8_t> bytes(static_cast<std::size_t>(size));
  in.seekg(0);
  in.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  return in ? bytes : std::vector<std::uint8_t>();
}

}  // namespace

SceneFetch::SceneFetch(std::string scene_hash, std::string cache_dir)
    : scene_hash_(std::move(scene_hash)), cache_dir_(std::move(cache_dir)) {
  if (auto digest = replication::DigestFrom(scene_hash_); digest.ok()) digest_ = *digest;
}

// The version of the packed form is in the name: another library's files are not in its way.
std::string SceneFetch::KeptFile() const {
  return (std::filesystem::path(cache_dir_) / absl::StrCat(scene_hash_, ".", kPackedSceneVersion, ".tsrs")).string();
}

std::shared_ptr<const Scene> SceneFetch::TakeKept() const {
  if (cache_dir_.empty()) return nullptr;
  const std::vector<std::uint8_t> bytes = ReadWhole(KeptFile());
  constexpr std::size_t kDigestBytes = sizeof(replication::Digest);
  if (bytes.size() <= kDigestBytes) return nullptr;
  const std::span<const std::uint8_t> stated = std::span(bytes).first(kDigestBytes);
  const std::span<const std::uint8_t> packed = std::span(bytes).subspan(kDigestBytes);
  const replication::Digest digest = DigestOf(packed);
  if (!std::equal(stated.begin(), stated.end(), digest.begin())) return nullptr;
  auto scene = UnpackScene(packed);
  return scene.ok() ? *std::move(scene) : nullptr;
}

absl::Status SceneFetch::Take(const replication::SceneChunk& chunk) {
  if (total_ == 0) {
    total_ = chunk.total_bytes;
    sha256_ = chunk.sha256;
  }
  if (chunk.total_bytes != total_ || chunk.sha256 != sha256_) {
    return absl::InternalError("the regions send different scenes");
  }
  // A chunk that is there already, or would leave a gap, is nothing new.
  if (chunk.offset > bytes_.size() || chunk.offset + chunk.bytes.size() <= bytes_.size()) return absl::OkStatus();
  const auto fresh = chunk.bytes.subspan(static_cast<std::size_t>(bytes_.size() - chunk.offset));
  bytes_.insert(bytes_.end(), fresh.begin(), fresh.end());
  return absl::OkStatus();
}

absl::StatusOr<std::shared_ptr<const Scene>> SceneFetch::Finish() const {
  if (DigestOf(bytes_) != sha256_) return absl::InternalError("the regions' scene is not the one that they named");
  auto scene = UnpackScene(bytes_);
  if (!scene.ok()) return absl::InternalError(absl::StrCat("the regions' scene: ", scene.status().message()));
  if (!cache_dir_.empty()) Keep();
  return *std::move(scene);
}

// Under another name first, so that a file of the right name is a whole one.
void SceneFetch::Keep() const {
  std::error_code error;
  std::filesystem::create_directories(cache_dir_, error);
  const std::string file = KeptFile();
  const std::string part =
      absl::StrCat(file, ".", std::chrono::steady_clock::now().time_since_epoch().count(), ".part");
  {
    std::ofstream out(part, std::ios::binary | std::ios::trunc);
    out.write(reinterpret_cast<const char*>(sha256_.data()), static_cast<std::streamsize>(sha256_.size()));
    out.write(reinterpret_cast<const char*>(bytes_.data()), static_cast<std::streamsize>(bytes_.size()));
    if (!out.flush()) error = std::make_error_code(std::errc::io_error);
  }
  if (!error) std::filesystem::rename(part, file, error);
  if (error) std::filesystem::remove(part, error);
}

}  // namespace tessera::client
