#include "control_plane/folder_target.h"

#include <algorithm>
#include <filesystem>

#include "absl/strings/str_cat.h"
#include "host/files.h"

namespace tessera::control {
namespace {

namespace fs = std::filesystem;

}  // namespace

absl::StatusOr<std::unique_ptr<FolderTarget>> FolderTarget::Open(std::string folder, std::uint64_t reserve) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) return absl::UnavailableError(absl::StrCat(folder, ": ", error.message()));
  for (const fs::directory_entry& instance : fs::directory_iterator(folder, error)) {
    if (!instance.is_directory(error)) continue;
    for (const fs::directory_entry& checkpoint : fs::directory_iterator(instance.path(), error)) {
      if (checkpoint.path().filename().string().starts_with('.')) fs::remove_all(checkpoint.path(), error);
    }
  }
  return std::unique_ptr<FolderTarget>(new FolderTarget(std::move(folder), reserve));
}

absl::Status FolderTarget::CheckRoom(std::uint64_t bytes) {
  std::error_code error;
  const fs::space_info space = fs::space(folder_, error);
  if (error) return absl::UnavailableError(absl::StrCat(folder_, ": ", error.message()));
  const std::uint64_t room = space.available - std::min<std::uintmax_t>(space.available, reserve_);
  if (room >= std::max<std::uint64_t>(bytes, 1)) return absl::OkStatus();
  constexpr std::uint64_t kMegabyte = 1'000'000;
  return absl::ResourceExhaustedError(absl::StrCat("no checkpoint is made: the disk of ", folder_, " has less than ",
                                                   (reserve_ + bytes) / kMegabyte, " MB left, of which ",
                                                   reserve_ / kMegabyte, " are kept for the store"));
}

std::string FolderTarget::Path(const std::string& instance, std::uint64_t tick) const {
  return absl::StrCat(folder_, "/", instance, "/", tick);
}
std::string FolderTarget::DraftPath(const std::string& instance, std::uint64_t tick) const {
  return absl::StrCat(folder_, "/", instance, "/.", tick);
}

absl::Status FolderTarget::Put(const std::string& instance, std::uint64_t tick, const std::string& file,
                               const std::string& bytes) {
  const std::string draft = DraftPath(instance, tick);
  std::error_code error;
  fs::create_directories(draft, error);
  if (error) return absl::UnavailableError(absl::StrCat(draft, ": ", error.message()));
  return host::WriteFile(draft + "/" + file, bytes, host::Durability::kSurvivesMachine);
}

absl::Status FolderTarget::Publish(const std::string& instance, std::uint64_t tick, const std::string& manifest) {
  if (absl::Status written = Put(instance, tick, kManifestFile, manifest); !written.ok()) return written;
  const std::string path = Path(instance, tick);
  std::error_code error;
  fs::remove_all(path, error);  // a checkpoint of the same tick from before a restoration
  fs::rename(DraftPath(instance, tick), path, error);
  if (error) return absl::UnavailableError(absl::StrCat(path, ": ", error.message()));
  if (absl::Status synced = host::SyncFolder(absl::StrCat(folder_, "/", instance)); !synced.ok()) return synced;
  return host::SyncFolder(folder_);  // the instance's own may be new
}

void FolderTarget::Abandon(const std::string& instance, std::uint64_t tick) {
  std::error_code ignored;
  fs::remove_all(DraftPath(instance, tick), ignored);
}

// A file that is there but cannot be read, or is larger than any that was put, counts as damaged.
absl::StatusOr<std::string> FolderTarget::Read(const std::string& instance, std::uint64_t tick,
                                               const std::string& file) {
  auto bytes = host::ReadFile(Path(instance, tick) + "/" + file, kMaxCheckpointFileBytes);
  if (bytes.ok() || absl::IsNotFound(bytes.status())) return bytes;
  return absl::DataLossError(bytes.status().message());
}

void FolderTarget::Remove(const std::string& instance, std::uint64_t tick) {
  std::error_code ignored;
  fs::remove_all(Path(instance, tick), ignored);
}

void FolderTarget::RemoveAll(const std::string& instance) {
  std::error_code ignored;
  fs::remove_all(folder_ + "/" + instance, ignored);
}

absl::StatusOr<std::vector<std::string>> FolderTarget::Instances() {
  std::vector<std::string> instances;
  std::error_code error;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder_, error)) {
    std::error_code ignored;
    if (entry.is_directory(ignored)) instances.push_back(entry.path().filename().string());
  }
  if (error) return absl::UnavailableError(absl::StrCat(folder_, ": ", error.message()));
  std::ranges::sort(instances);
  return instances;
}

}  // namespace tessera::control
