#include "control_plane/checkpoint_files.h"

#include <utility>

#include "absl/strings/str_cat.h"
#include "control_plane/folder_target.h"
#include "core/world/sha256.h"

namespace tessera::control {
namespace {

constexpr std::size_t kSumDigits = 64;
// Where the mark lies: no world has such a name.
constexpr char kMarkFolder[] = "cluster";

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
  auto target = FolderTarget::Open(std::move(folder), reserve);
  if (!target.ok()) return target.status();
  return std::make_unique<CheckpointFiles>(*std::move(target));
}

absl::Status CheckpointFiles::Put(const std::string& instance, std::uint64_t tick, const std::string& name,
                                  const std::string& bytes) const {
  if (absl::Status room = CheckRoom(bytes.size()); !room.ok()) return room;
  return target_->Put(instance, tick, name, bytes);
}

absl::StatusOr<std::uint64_t> CheckpointFiles::Complete(const std::string& instance,
                                                        const records::Manifest& manifest) const {
  const std::string bytes = Summed(manifest.SerializeAsString());
  if (absl::Status status = target_->Publish(instance, manifest.tick(), bytes); !status.ok()) return status;
  std::uint64_t size = bytes.size();
  for (const records::ManifestFile& file : manifest.files()) size += file.size();
  return size;
}

void CheckpointFiles::Abandon(const std::string& instance, std::uint64_t tick) const {
  target_->Abandon(instance, tick);
}

absl::StatusOr<records::Manifest> CheckpointFiles::ReadManifest(const std::string& instance, std::uint64_t tick) const {
  const auto bytes = target_->Read(instance, tick, kManifestFile);
  if (!bytes.ok()) return Named(bytes.status(), instance, tick, kManifestFile);
  const auto plain = Unsummed(*bytes);
  if (!plain.ok()) return Named(plain.status(), instance, tick, kManifestFile);
  records::Manifest manifest;
  if (!manifest.ParseFromString(*plain) || manifest.tick() != tick) {
    return Named(absl::DataLossError("is none"), instance, tick, kManifestFile);
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
    auto bytes = target_->Read(instance, tick, name);
    if (!bytes.ok()) return Named(bytes.status(), instance, tick, name);
    if (bytes->size() != file.size() || Sha256Hex(*bytes) != file.hash()) {
      return Named(absl::DataLossError("has another checksum"), instance, tick, name);
    }
    return bytes;
  }
  return Named(absl::NotFoundError("is not part of it"), instance, tick, name);
}

void CheckpointFiles::Remove(const std::string& instance, std::uint64_t tick) const { target_->Remove(instance, tick); }

void CheckpointFiles::RemoveAll(const std::string& instance) const { target_->RemoveAll(instance); }

absl::StatusOr<std::vector<std::string>> CheckpointFiles::Instances() const {
  auto kept = target_->Instances();
  if (kept.ok()) std::erase(*kept, kMarkFolder);
  return kept;
}

absl::StatusOr<std::string> CheckpointFiles::ReadMark() const {
  const auto bytes = target_->Read(kMarkFolder, 0, kManifestFile);
  if (!bytes.ok()) return bytes.status();
  auto mark = Unsummed(*bytes);
  if (!mark.ok()) return absl::DataLossError(absl::StrCat(name(), "/", kMarkFolder, ": ", mark.status().message()));
  return mark;
}

absl::Status CheckpointFiles::WriteMark(const std::string& mark) const {
  return target_->Publish(kMarkFolder, 0, Summed(mark));
}

bool HasGameFile(const records::Manifest& manifest) { return !manifest.game_hash().empty() && !manifest.game_native(); }

}  // namespace tessera::control
