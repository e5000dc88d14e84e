#include "gateway/visual_cache.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <filesystem>
#include <tuple>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/world/limits.h"
#include "core/world/sha256.h"
#include "host/files.h"

namespace tessera::gateway {
namespace {

namespace fs = std::filesystem;

constexpr char kEnding[] = ".glb";

struct CachedFile {
  fs::file_time_type used;
  std::uint64_t bytes = 0;
  fs::path path;
};

// Those whose names are hashes; others are none of ours. Another gateway may remove some meanwhile.
std::vector<CachedFile> FilesIn(const std::string& folder) {
  std::vector<CachedFile> files;
  std::error_code error;
  for (fs::directory_iterator at(folder, error), end; !error && at != end; at.increment(error)) {
    const fs::path& path = at->path();
    if (path.extension() != kEnding || !IsSha256Hex(path.stem().string())) continue;
    std::error_code gone;
    CachedFile file{.used = at->last_write_time(gone), .bytes = 0, .path = path};
    if (!gone) file.bytes = at->file_size(gone);
    if (!gone) files.push_back(std::move(file));
  }
  return files;
}

}  // namespace

std::string VisualCache::PathOf(const std::string& sha256) const { return absl::StrCat(folder_, "/", sha256, kEnding); }

absl::Status VisualCache::Open() const {
  if (folder_.empty()) return absl::OkStatus();
  if (absl::Status status = host::MakePrivateFolder(folder_); !status.ok()) {
    return absl::UnavailableError(absl::StrCat("--visual-cache ", status.message()));
  }
  MakeRoom(0);
  return absl::OkStatus();
}

absl::StatusOr<std::string> VisualCache::Get(const std::string& sha256) const {
  if (folder_.empty()) return absl::NotFoundError("there is no cache");
  const std::string path = PathOf(sha256);
  auto bytes = host::ReadFile(path, kMaxVisualFile_bytes);
  std::error_code error;
  if (bytes.ok() && Sha256Hex(*bytes) == sha256) {
    fs::last_write_time(path, fs::file_time_type::clock::now(), error);  // it goes last
    return bytes;
  }
  if (absl::IsNotFound(bytes.status())) return absl::NotFoundError(absl::StrCat(path, " is not there"));
  spdlog::warn("visual cache file={} problem={}", path,
               bytes.ok() ? "it has another hash" : std::string(bytes.status().message()));
  fs::remove(path, error);
  return absl::NotFoundError(absl::StrCat(path, " is damaged"));
}

void VisualCache::Put(const std::string& sha256, std::string_view bytes) const {
  if (folder_.empty() || bytes.size() > max_bytes_) return;
  MakeRoom(bytes.size());
  const absl::Status written = host::WriteFile(PathOf(sha256), bytes, host::Durability::kSurvivesProcess);
  if (!written.ok()) spdlog::warn("visual cache problem={}", std::string(written.message()));
}

void VisualCache::MakeRoom(std::uint64_t bytes) const {
  std::vector<CachedFile> files = FilesIn(folder_);
  std::sort(files.begin(), files.end(), [](const CachedFile& a, const CachedFile& b) {
    return std::tie(a.used, a.path) < std::tie(b.used, b.path);
  });
  std::uint64_t sum = bytes;
  for (const CachedFile& file : files) sum += file.bytes;
  for (const CachedFile& file : files) {
    if (sum <= max_bytes_) return;
    std::error_code error;
    fs::remove(file.path, error);
    sum -= file.bytes;
  }
}

}  // namespace tessera::gateway
