// ControlPlane's part in files of meshes: their pieces, which are written and read without the cluster's lock.
#include <algorithm>

#include "absl/strings/str_cat.h"
#include "control_plane/cluster/queries.h"
#include "control_plane/control_plane.h"
#include "control_plane/one_line.h"
#include "control_plane/stored_records.h"
#include "core/world/sha256.h"

namespace tessera::control {
namespace {

std::uint64_t PiecesOf(std::uint64_t bytes) { return (bytes + kVisualStoredBytes - 1) / kVisualStoredBytes; }

}  // namespace

absl::Status ControlPlane::CheckPutVisual(const std::string& sha256, std::uint64_t size) {
  return Call([&](Cluster& cluster, Now) { return cluster.visuals().CheckPut(sha256, size); });
}

absl::Status ControlPlane::PutVisual(const std::string& sha256, const std::string& bytes) {
  if (Sha256Hex(bytes) != sha256) return absl::InvalidArgumentError("data: what came has another hash than was said");
  // One after the other: the second of two that put the same file finds it there.
  const std::lock_guard writing(visual_mutex_);
  absl::Status status = CheckPutVisual(sha256, bytes.size());
  if (absl::IsAlreadyExists(status)) return absl::OkStatus();
  if (status.ok()) status = RemovePieces(sha256);
  if (!status.ok()) return status;
  status = Call([&](Cluster& cluster, Now) { return cluster.visuals().Begin(sha256, bytes.size()); });
  if (!status.ok()) return status;
  status = WritePieces(sha256, bytes);
  if (status.ok()) status = Call([&](Cluster& cluster, Now) { return cluster.visuals().Finish(sha256); });
  if (status.ok()) return status;
  Call([&](Cluster& cluster, Now) {
    cluster.visuals().Abandon(sha256);
    return 0;
  });
  return status;
}

// Requires visual_mutex_.
absl::Status ControlPlane::WritePieces(const std::string& sha256, const std::string& bytes) {
  for (std::uint64_t number = 0; number < PiecesOf(bytes.size()); ++number) {
    const auto piece = std::string_view(bytes).substr(number * kVisualStoredBytes, kVisualStoredBytes);
    const std::string key = VisualPieceKey(sha256, number);
    auto written = store_.Put(key, piece, kAbsent);
    if (absl::IsAborted(written.status())) {  // it is there still of a file whose record could not be read
      if (const auto there = store_.Get(key); there.ok()) written = store_.Put(key, piece, there->revision);
    }
    if (!written.ok()) return absl::UnavailableError(written.status().message());
    Lock lock(mutex_);
    if (stop_.wait_for(lock, kVisualPause, [this] { return stopping_; })) {
      return absl::UnavailableError("the control plane is ending");
    }
  }
  return absl::OkStatus();
}

// Removes what is left of the file, if it is not whole. Requires visual_mutex_.
absl::Status ControlPlane::RemovePieces(const std::string& sha256) {
  const std::uint64_t bytes = Call([&](Cluster& cluster, Now) { return cluster.visuals().LeftOver(sha256); });
  if (bytes == 0) return absl::OkStatus();
  for (std::uint64_t number = 0; number < PiecesOf(bytes); ++number) {
    const std::string key = VisualPieceKey(sha256, number);
    const auto piece = store_.Get(key);
    if (absl::IsNotFound(piece.status())) continue;
    if (!piece.ok()) return absl::UnavailableError(piece.status().message());
    if (const auto removed = store_.Delete(key, piece->revision); !removed.ok()) {
      return absl::UnavailableError(removed.status().message());
    }
  }
  return Call([&](Cluster& cluster, Now) { return cluster.visuals().Remove(sha256); });
}

void ControlPlane::RemoveVisual(const std::string& sha256) {
  const std::lock_guard writing(visual_mutex_);
  (void)RemovePieces(sha256);  // the next sweep asks again
}

absl::StatusOr<std::uint64_t> ControlPlane::VisualSize(const std::string& sha256) {
  const std::uint64_t size = Call([&](Cluster& cluster, Now) { return cluster.visuals().SizeOf(sha256); });
  if (size > 0) return size;
  return absl::NotFoundError(
      absl::StrCat("sha256: the control plane has no file ", OneLine(sha256, kSha256Digits + 1), ".glb"));
}

absl::StatusOr<std::string> ControlPlane::VisualPiece(const std::string& sha256, std::uint64_t at) {
  const auto size = VisualSize(sha256);
  if (!size.ok()) return size.status();
  auto piece = store_.Get(VisualPieceKey(sha256, at / kVisualStoredBytes));
  if (!piece.ok()) return absl::UnavailableError(piece.status().message());
  if (piece->value.size() != std::min<std::uint64_t>(kVisualStoredBytes, *size - at)) {
    return absl::DataLossError(absl::StrCat("sha256: ", sha256, " is damaged in the store"));
  }
  return std::move(piece->value);
}

}  // namespace tessera::control
