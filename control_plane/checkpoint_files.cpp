#include "control_plane/checkpoint_files.h"

#include <fcntl.h>
#include <sodium.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <set>

#include "absl/strings/str_cat.h"

namespace tessera::control {
namespace {

namespace fs = std::filesystem;

constexpr char kManifest[] = "manifest";
constexpr char kMagic[] = "TESSERA CHECKPOINT 1\n";
constexpr std::size_t kSumDigits = 2 * crypto_hash_sha256_BYTES;

absl::Status Failed(const std::string& path, const char* what) {
  return absl::UnavailableError(absl::StrCat(path, ": ", what, ": ", std::strerror(errno)));
}

absl::Status SyncFolder(const std::string& path) {
  const int fd = open(path.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (fd < 0) return Failed(path, "cannot be opened");
  const bool synced = fsync(fd) == 0;
  close(fd);
  return synced ? absl::OkStatus() : Failed(path, "cannot be synced");
}

absl::Status WriteSynced(const std::string& path, const std::string& bytes) {
  const int fd = open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600);
  if (fd < 0) return Failed(path, "cannot be made");
  std::size_t written = 0;
  while (written < bytes.size()) {
    const ssize_t n = write(fd, bytes.data() + written, bytes.size() - written);
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) break;
    written += static_cast<std::size_t>(n);
  }
  const bool whole = written == bytes.size() && fsync(fd) == 0;
  const absl::Status status = whole ? absl::OkStatus() : Failed(path, "cannot be written");
  close(fd);
  return status;
}

absl::StatusOr<std::string> ReadWhole(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  if (!in) return absl::NotFoundError("is not there");
  std::string bytes((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
  if (in.bad()) return absl::DataLossError("cannot be read");
  return bytes;
}

std::string Summed(const std::string& bytes) { return Sha256Hex(bytes) + bytes; }

// What `Summed` made; DATA_LOSS if it is not that.
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

std::string Sha256Hex(std::string_view bytes) {
  std::array<unsigned char, crypto_hash_sha256_BYTES> digest{};
  crypto_hash_sha256(digest.data(), reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size());
  std::string hex(kSumDigits + 1, '\0');
  sodium_bin2hex(hex.data(), hex.size(), digest.data(), digest.size());
  hex.pop_back();
  return hex;
}

absl::StatusOr<std::unique_ptr<CheckpointFiles>> CheckpointFiles::Open(std::string folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) return absl::UnavailableError(absl::StrCat(folder, ": ", error.message()));
  for (const fs::directory_entry& instance : fs::directory_iterator(folder, error)) {
    if (!instance.is_directory(error)) continue;
    for (const fs::directory_entry& checkpoint : fs::directory_iterator(instance.path(), error)) {
      if (checkpoint.path().filename().string().starts_with('.')) fs::remove_all(checkpoint.path(), error);
    }
  }
  return std::unique_ptr<CheckpointFiles>(new CheckpointFiles(std::move(folder)));
}

std::string CheckpointFiles::Path(const std::string& instance, std::uint64_t tick) const {
  return absl::StrCat(folder_, "/", instance, "/", tick);
}
std::string CheckpointFiles::DraftPath(const std::string& instance, std::uint64_t tick) const {
  return absl::StrCat(folder_, "/", instance, "/.", tick);
}

absl::Status CheckpointFiles::Put(const std::string& instance, std::uint64_t tick, const std::string& name,
                                  const std::string& bytes) const {
  const std::string draft = DraftPath(instance, tick);
  std::error_code error;
  fs::create_directories(draft, error);
  if (error) return absl::UnavailableError(absl::StrCat(draft, ": ", error.message()));
  return WriteSynced(draft + "/" + name, bytes);
}

absl::StatusOr<std::uint64_t> CheckpointFiles::Complete(const std::string& instance,
                                                        const records::Manifest& manifest) const {
  const std::string draft = DraftPath(instance, manifest.tick()), path = Path(instance, manifest.tick());
  const std::string bytes = Summed(manifest.SerializeAsString());
  if (absl::Status status = WriteSynced(draft + "/" + kManifest, bytes); !status.ok()) return status;
  if (absl::Status status = SyncFolder(draft); !status.ok()) return status;
  std::error_code error;
  fs::remove_all(path, error);  // one of the same tick, of before a restoration
  if (rename(draft.c_str(), path.c_str()) != 0) return Failed(path, "cannot be renamed");
  if (absl::Status status = SyncFolder(absl::StrCat(folder_, "/", instance)); !status.ok()) return status;
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

std::string Bundle(const records::Bundle& bundle) { return kMagic + Summed(bundle.SerializeAsString()); }

absl::StatusOr<records::Bundle> Unbundle(const std::string& bytes) {
  if (!bytes.starts_with(kMagic)) return absl::InvalidArgumentError("file: is no checkpoint of this version");
  const auto plain = Unsummed(bytes.substr(sizeof(kMagic) - 1));
  if (!plain.ok()) return absl::DataLossError(absl::StrCat("file: ", plain.status().message()));
  records::Bundle bundle;
  if (!bundle.ParseFromString(*plain)) return absl::DataLossError("file: is no checkpoint");
  std::set<std::string> names = {"scene"}, given;
  for (const v1::MapRegion& region : bundle.manifest().map().regions()) names.insert(RegionFileName(region.id()));
  for (const records::ManifestFile& file : bundle.manifest().files()) given.insert(file.name());
  if (given != names || bundle.manifest().files_size() != static_cast<int>(names.size())) {
    return absl::InvalidArgumentError("file: its files are not the scene and one for each region of its map");
  }
  for (const records::ManifestFile& file : bundle.manifest().files()) {
    const auto content = bundle.contents().find(file.name());
    if (content == bundle.contents().end() || Sha256Hex(content->second) != file.hash()) {
      return absl::DataLossError(absl::StrCat("file: ", file.name(), " is missing or damaged"));
    }
  }
  return bundle;
}

}  // namespace tessera::control
