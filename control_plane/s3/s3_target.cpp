#include "control_plane/s3/s3_target.h"

#include <spdlog/spdlog.h>

#include <utility>

#include "absl/strings/str_cat.h"

namespace tessera::control {
namespace {

std::string FolderKey(const std::string& instance, std::uint64_t tick) {
  return absl::StrCat(instance, "/", tick, "/");
}

}  // namespace

absl::StatusOr<std::unique_ptr<S3Target>> S3Target::Open(S3Settings settings, S3Patience patience) {
  std::unique_ptr<S3Target> target(new S3Target(std::move(settings), patience));
  const absl::Status status = target->Probe();
  if (!status.ok() && !absl::IsUnavailable(status) && !absl::IsResourceExhausted(status)) return status;
  return target;
}

absl::Status S3Target::Probe() { return Note(client_.List("", true, 1).status()); }

absl::Status S3Target::Note(absl::Status status) {
  const std::lock_guard lock(mutex_);
  trouble_ = status;
  if (!status.ok()) probe_at_ = Clock::now() + kS3ProbeInterval;
  return status;
}

// A store has as much room as it says when it is written.
absl::Status S3Target::CheckRoom(std::uint64_t /*bytes*/) {
  {
    const std::lock_guard lock(mutex_);
    if (trouble_.ok() || Clock::now() < probe_at_) return trouble_;
    probe_at_ = Clock::now() + kS3ProbeInterval;
  }
  return Probe();
}

// A manifest of this tick from before a restoration would name other files.
absl::Status S3Target::Put(const std::string& instance, std::uint64_t tick, const std::string& file,
                           const std::string& bytes) {
  const std::string folder = FolderKey(instance, tick);
  if (absl::Status status = client_.Delete(folder + kManifestFile); !status.ok()) return Note(status);
  return Note(client_.Put(folder + file, bytes));
}

absl::Status S3Target::Publish(const std::string& instance, std::uint64_t tick, const std::string& manifest) {
  return Note(client_.Put(FolderKey(instance, tick) + kManifestFile, manifest));
}

void S3Target::Abandon(const std::string& instance, std::uint64_t tick) {
  const std::string folder = FolderKey(instance, tick);
  const auto listing = client_.List(folder, false);
  if (!listing.ok()) return;
  for (const std::string& key : listing->keys) {
    if (key == folder + kManifestFile) return;  // it was published
  }
  RemoveUnder(folder);
}

absl::StatusOr<std::string> S3Target::Read(const std::string& instance, std::uint64_t tick, const std::string& file) {
  return client_.Get(FolderKey(instance, tick) + file, kMaxCheckpointFileBytes);
}

// The manifest goes first: what is left of one that is removed in part is not taken for a checkpoint.
void S3Target::Remove(const std::string& instance, std::uint64_t tick) {
  const std::string folder = FolderKey(instance, tick);
  if (client_.Delete(folder + kManifestFile).ok()) RemoveUnder(folder);
}

void S3Target::RemoveAll(const std::string& instance) { RemoveUnder(instance + "/"); }

void S3Target::RemoveUnder(const std::string& prefix) {
  const auto listing = client_.List(prefix, false);
  absl::Status status = listing.status();
  for (std::size_t i = 0; status.ok() && i < listing->keys.size(); ++i) status = client_.Delete(listing->keys[i]);
  if (!status.ok()) spdlog::warn("not removed: {}: {}", prefix, std::string(status.message()));
}

absl::StatusOr<std::vector<std::string>> S3Target::Instances() {
  auto listing = client_.List("", true);
  if (!listing.ok()) return listing.status();
  for (std::string& folder : listing->folders) folder.pop_back();
  return std::move(listing->folders);
}

}  // namespace tessera::control
