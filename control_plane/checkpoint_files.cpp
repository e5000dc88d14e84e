#include "control_plane/checkpoint_files.h"

#include <algorithm>
#include <filesystem>
#include <set>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/world/sha256.h"
#include "host/files.h"

namespace tessera::control {
namespace {

namespace fs = std::filesystem;

constexpr char kManifest[] = "manifest";
constexpr char kMagic[] = "TESSERA CHECKPOINT 1\n";
constexpr std::size_t kSumDigits = 64;
// More than the largest file, the state of a region with a million bodies.
constexpr std::size_t kMaxFileBytes = std::size_t{1} << 30;

// A file that is there but cannot be read, or is larger than any that was put, counts as damaged.
absl::StatusOr<std::string> ReadWhole(const std::string& path) {
  auto bytes = host::ReadFile(path, kMaxFileBytes);
  if (bytes.ok() || absl::IsNotFound(bytes.status())) return bytes;
  return absl::DataLossError(bytes.status().message());
}

std::string Summed(const std::string& bytes) { return Sha256Hex(bytes) + bytes; }

// Undoes `Summed`. DATA_LOSS if the text is not one that it made.
absl::StatusOr<std::string> Unsummed(const std::string& bytes) {
  if (bytes.size() < kSumDigits ||
      Sha256Hex(std::string_view(bytes).substr(kSumDigits)) != bytes.substr(0, kSumDigits)) {
    return absl::DataLossError("has another checksum");
  }
  return bytes.substr(kSumDigits);
}

absl::Status Named(const absl::Status& status, const std::string& instance, std::uint64_t tick,
                   const std::string& name) {
  return {status.code(), absl::StrCat("checkpoint ", tick, " of ", instance, ": ", name, ": ", status.message())};
}

}  // namespace

std::string RegionFileName(std::uint32_t region) { return absl::StrCat("region-", region); }

absl::StatusOr<std::unique_ptr<CheckpointFiles>> CheckpointFiles::Open(std::string folder, std::uint64_t reserve) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) return absl::UnavailableError(absl::StrCat(folder, ": ", error.message()));
  for (const fs::directory_entry& instance : fs::directory_iterator(folder, error)) {
    if (!instance.is_directory(error)) continue;
    for (const fs::directory_entry& checkpoint : fs::directory_iterator(instance.path(), error)) {
      if (checkpoint.path().filename().string().starts_with('.')) fs::remove_all(checkpoint.path(), error);
    }
  }
  return std::unique_ptr<CheckpointFiles>(new CheckpointFiles(std::move(folder), reserve));
}

absl::StatusOr<std::uint64_t> CheckpointFiles::Room() const {
  std::error_code error;
  const fs::space_info space = fs::space(folder_, error);
  if (error) return absl::UnavailableError(absl::StrCat(folder_, ": ", error.message()));
  return space.available - std::min<std::uintmax_t>(space.available, reserve_);
}

absl::Status CheckpointFiles::CheckRoom(std::uint64_t bytes) const {
  const auto room = Room();
  if (!room.ok()) return room.status();
  if (*room >= std::max<std::uint64_t>(bytes, 1)) return absl::OkStatus();
  constexpr std::uint64_t kMegabyte = 1'000'000;
  return absl::ResourceExhaustedError(absl::StrCat("no checkpoint is made: the disk of ", folder_, " has less than ",
                                                   (reserve_ + bytes) / kMegabyte, " MB left, of which ",
                                                   reserve_ / kMegabyte, " are kept for the store"));
}

std::string CheckpointFiles::Path(const std::string& instance, std::uint64_t tick) const {
  return absl::StrCat(folder_, "/", instance, "/", tick);
}
std::string CheckpointFiles::DraftPath(const std::string& instance, std::uint64_t tick) const {
  return absl::StrCat(folder_, "/", instance, "/.", tick);
}

absl::Status CheckpointFiles::Put(const std::string& instance, std::uint64_t tick, const std::string& name,
                                  const std::string& bytes) const {
  if (absl::Status room = CheckRoom(bytes.size()); !room.ok()) return room;
  const std::string draft = DraftPath(instance, tick);
  std::error_code error;
  fs::create_directories(draft, error);
  if (error) return absl::UnavailableError(absl::StrCat(draft, ": ", error.message()));
  return host::WriteFile(draft + "/" + name, bytes, host::Durability::kSurvivesMachine);
}

absl::StatusOr<std::uint64_t> CheckpointFiles::Complete(const std::string& instance,
                                                        const records::Manifest& manifest) const {
  const std::string draft = DraftPath(instance, manifest.tick()), path = Path(instance, manifest.tick());
  const std::string bytes = Summed(manifest.SerializeAsString());
  const absl::Status written = host::WriteFile(draft + "/" + kManifest, bytes, host::Durability::kSurvivesMachine);
  if (!written.ok()) return written;
  std::error_code error;
  fs::remove_all(path, error);  // a checkpoint of the same tick from before a restoration
  fs::rename(draft, path, error);
  if (error) return absl::UnavailableError(absl::StrCat(path, ": ", error.message()));
  if (absl::Status status = host::SyncFolder(absl::StrCat(folder_, "/", instance)); !status.ok()) return status;
  std::uint64_t size = bytes.size();
  for (const records::ManifestFile& file : manifest.files()) size += file.size();
  return size;
}

void CheckpointFiles::Abandon(const std::string& instance, std::uint64_t tick) const {
  std::error_code ignored;
  fs::remove_all(DraftPath(instance, tick), ignored);
}

absl::StatusOr<records::Manifest> CheckpointFiles::ReadManifest(const std::string& instance, std::uint64_t tick) const {
  const auto bytes = ReadWhole(Path(instance, tick) + "/" + kManifest);
  if (!bytes.ok()) return Named(bytes.status(), instance, tick, kManifest);
  const auto plain = Unsummed(*bytes);
  if (!plain.ok()) return Named(plain.status(), instance, tick, kManifest);
  records::Manifest manifest;
  if (!manifest.ParseFromString(*plain) || manifest.tick() != tick) {
    return Named(absl::DataLossError("is none"), instance, tick, kManifest);
  }
  return manifest;
}

absl::Status CheckpointFiles::Check(const std::string& instance, std::uint64_t tick) const {
  const auto manifest = ReadManifest(instance, tick);
  if (!manifest.ok()) return manifest.status();
  for (const records::ManifestFile& file : manifest->files()) {
    if (const auto bytes = Read(instance, tick, file.name()); !bytes.ok()) return bytes.status();
  }
  return absl::OkStatus();
}

absl::StatusOr<std::string> CheckpointFiles::Read(const std::string& instance, std::uint64_t tick,
                                                  const std::string& name) const {
  const auto manifest = ReadManifest(instance, tick);
  if (!manifest.ok()) return manifest.status();
  for (const records::ManifestFile& file : manifest->files()) {
    if (file.name() != name) continue;
    auto bytes = ReadWhole(Path(instance, tick) + "/" + name);
    if (!bytes.ok()) return Named(bytes.status(), instance, tick, name);
    if (bytes->size() != file.size() || Sha256Hex(*bytes) != file.hash()) {
      return Named(absl::DataLossError("has another checksum"), instance, tick, name);
    }
    return bytes;
  }
  return Named(absl::NotFoundError("is not part of it"), instance, tick, name);
}

void CheckpointFiles::Remove(const std::string& instance, std::uint64_t tick) const {
  std::error_code ignored;
  fs::remove_all(Path(instance, tick), ignored);
}

void CheckpointFiles::RemoveAll(const std::string& instance) const {
  std::error_code ignored;
  fs::remove_all(folder_ + "/" + instance, ignored);
}

std::vector<std::string> CheckpointFiles::Instances() const {
  std::vector<std::string> instances;
  std::error_code ignored;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder_, ignored)) {
    if (entry.is_directory(ignored)) instances.push_back(entry.path().filename().string());
  }
  std::ranges::sort(instances);
  return instances;
}

bool HasGameFile(const records::Manifest& manifest) { return !manifest.game_hash().empty() && !manifest.game_native(); }

std::string Bundle(const records::Bundle& bundle) { return kMagic + Summed(bundle.SerializeAsString()); }

absl::StatusOr<records::Bundle> Unbundle(const std::string& bytes) {
  if (!bytes.starts_with(kMagic)) return absl::InvalidArgumentError("file: is no checkpoint of this version");
  const auto plain = Unsummed(bytes.substr(sizeof(kMagic) - 1));
  if (!plain.ok()) return absl::DataLossError(absl::StrCat("file: ", plain.status().message()));
  records::Bundle bundle;
  if (!bundle.ParseFromString(*plain)) return absl::DataLossError("file: is no checkpoint");
  std::set<std::string> names = {kSceneFile}, given;
  if (HasGameFile(bundle.manifest())) names.insert(kGameFile);
  for (const v1::MapRegion& region : bundle.manifest().map().regions()) names.insert(RegionFileName(region.id()));
  for (const records::ManifestFile& file : bundle.manifest().files()) given.insert(file.name());
  if (given != names || bundle.manifest().files_size() != static_cast<int>(names.size())) {
    return absl::InvalidArgumentError("file: its files are not the scene, the game and one for each region of its map");
  }
  for (const records::ManifestFile& file : bundle.manifest().files()) {
    const std::string* content = FindContent(bundle, file.name());
    if (content == nullptr || Sha256Hex(*content) != file.hash()) {
      return absl::DataLossError(absl::StrCat("file: ", file.name(), " is missing or damaged"));
    }
  }
  return bundle;
}

void AddContent(records::Bundle& bundle, const std::string& name, std::string bytes) {
  records::Bundle::Content& content = *bundle.add_contents();
  content.set_name(name);
  content.set_bytes(std::move(bytes));
}

const std::string* FindContent(const records::Bundle& bundle, const std::string& name) {
  const auto found = std::ranges::find(bundle.contents(), name, &records::Bundle::Content::name);
  return found == bundle.contents().end() ? nullptr : &found->bytes();
}

}  // namespace tessera::control
