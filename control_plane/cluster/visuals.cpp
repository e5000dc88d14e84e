#include "control_plane/cluster/visuals.h"

#include <set>

#include "absl/strings/str_cat.h"
#include "control_plane/control_settings.h"
#include "control_plane/one_line.h"
#include "core/world/limits.h"
#include "core/world/sha256.h"

namespace tessera::control {
namespace {

absl::Status CheckHash(const char* field, const std::string& sha256) {
  if (IsSha256Hex(sha256)) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrCat(field, ": \"", OneLine(sha256, kMaxNameBytes), "\" is not 64 lower-case hexadecimal digits"));
}

}  // namespace

absl::Status Visuals::Load() {
  const auto entries = state_.ListStored(kVisualPrefix);
  if (!entries.ok()) return entries.status();
  for (const StoreEntry& stored : *entries) {
    const std::string sha256 = stored.key.substr(sizeof kVisualPrefix - 1);
    Entry entry{.record = {}, .revision = stored.revision};
    if (!ReadRecord(stored, entry.record) || !IsSha256Hex(sha256)) {
      if (absl::Status status = state_.SetAside(stored); !status.ok()) return status;
      continue;
    }
    files_.emplace(sha256, std::move(entry));
  }
  return absl::OkStatus();
}

std::uint64_t Visuals::bytes() const {
  std::uint64_t sum = 0;
  for (const auto& [sha256, entry] : files_) sum += entry.record.size();
  return sum;
}

std::uint64_t Visuals::SizeOf(const std::string& sha256) const {
  const auto found = files_.find(sha256);
  return found == files_.end() || !found->second.record.whole() ? 0 : found->second.record.size();
}

absl::StatusOr<v1::FindMissingVisualsResponse> Visuals::FindMissing(const v1::FindMissingVisualsRequest& request) {
  if (static_cast<std::size_t>(request.sha256_size()) > kMaxVisualFiles) {
    return absl::InvalidArgumentError(
        absl::StrCat("sha256: ", request.sha256_size(), " files are more than ", kMaxVisualFiles));
  }
  v1::FindMissingVisualsResponse response;
  response.set_keeps_none(keeps_none());
  for (const std::string& sha256 : request.sha256()) {
    if (absl::Status status = CheckHash("sha256", sha256); !status.ok()) return status;
    if (keeps_none()) continue;
    if (SizeOf(sha256) == 0) {
      response.add_sha256(sha256);
    } else {
      files_.at(sha256).unneeded_since = Steady(0);
    }
  }
  return response;
}

absl::Status Visuals::CheckThere(const std::vector<std::string>& files) const {
  if (keeps_none()) return absl::OkStatus();
  const std::string* first = nullptr;
  std::size_t missing = 0;
  for (const std::string& sha256 : files) {
    if (SizeOf(sha256) > 0) continue;
    if (first == nullptr) first = &sha256;
    ++missing;
  }
  if (first == nullptr) return absl::OkStatus();
  return absl::FailedPreconditionError(absl::StrCat(
      "spec.scene: is drawn with ", *first, ".glb", missing == 1 ? "" : absl::StrCat(" and ", missing - 1, " more"),
      missing == 1 ? ", which is" : ", which are",
      " not here; `tessera instance create` sends it from the folder `visuals` beside the scene, other programs call "
      "VisualService.PutVisual first"));
}

absl::Status Visuals::CheckPut(const std::string& sha256, std::uint64_t size) {
  if (absl::Status status = CheckHash("sha256", sha256); !status.ok()) return status;
  if (keeps_none()) {
    return absl::FailedPreconditionError("this control plane keeps no files of meshes (--visual-quota-mb 0)");
  }
  if (size == 0 || size > kMaxVisualFile_bytes) {
    return absl::InvalidArgumentError(absl::StrCat("size: ", size, " is not in 1 to ", kMaxVisualFile_bytes));
  }
  const auto found = files_.find(sha256);
  if (found != files_.end() && found->second.record.whole()) {
    found->second.unneeded_since = Steady(0);
    return absl::AlreadyExistsError(absl::StrCat("sha256: ", sha256, " is there already"));
  }
  const std::uint64_t others = bytes() - (found == files_.end() ? 0 : found->second.record.size());
  if (others + size <= quota_) return absl::OkStatus();
  return absl::ResourceExhaustedError(
      absl::StrCat("size: ", size, " bytes are more than the ", quota_ - std::min(quota_, others), " of ", quota_,
                   " that --visual-quota-mb leaves; files that no world needs go after ",
                   std::chrono::duration_cast<std::chrono::minutes>(keep_).count(), " minutes"));
}

absl::Status Visuals::Store(const std::string& sha256, Entry& entry, const records::Visual& next) {
  const StoreOp op = PutOp(VisualKey(sha256), next.SerializeAsString(), entry.revision);
  const auto written = state_.WriteStored({&op, 1});
  if (!written.ok()) return written.status();
  entry.record = next;
  entry.revision = *written;
  return absl::OkStatus();
}

absl::Status Visuals::Begin(const std::string& sha256, std::uint64_t size) {
  Entry entry;
  if (const auto found = files_.find(sha256); found != files_.end()) entry = found->second;
  records::Visual next;
  next.set_size(size);
  if (absl::Status status = Store(sha256, entry, next); !status.ok()) return status;
  entry.under_way = true;
  files_[sha256] = entry;
  return absl::OkStatus();
}

absl::Status Visuals::Finish(const std::string& sha256) {
  Entry& entry = files_.at(sha256);
  records::Visual next = entry.record;
  next.set_whole(true);
  if (absl::Status status = Store(sha256, entry, next); !status.ok()) return status;
  entry.under_way = false;
  entry.unneeded_since = Steady(0);
  return absl::OkStatus();
}

void Visuals::Abandon(const std::string& sha256) { files_.at(sha256).under_way = false; }

std::uint64_t Visuals::LeftOver(const std::string& sha256) const {
  const auto found = files_.find(sha256);
  if (found == files_.end() || found->second.record.whole() || found->second.under_way) return 0;
  return found->second.record.size();
}

absl::Status Visuals::Remove(const std::string& sha256) {
  const auto found = files_.find(sha256);
  if (found == files_.end()) return absl::OkStatus();
  const StoreOp op = DeleteOp(VisualKey(sha256), found->second.revision);
  const auto written = state_.WriteStored({&op, 1});
  if (!written.ok()) return written.status();
  files_.erase(found);
  return absl::OkStatus();
}

void Visuals::Sweep(Now now) {
  if (files_.empty() || now.steady < next_sweep_) return;
  if (!state_.set_aside().empty()) return;  // a record that cannot be read may need any of them
  next_sweep_ = now.steady + kVisualSweepInterval;
  std::set<std::string> needed;
  for (const auto& [number, instance] : state_.instances()) {
    // One that has failed may be restored.
    if (instance.record.state() == v1::INSTANCE_STATE_ENDED) continue;
    needed.insert(instance.record.visuals().begin(), instance.record.visuals().end());
  }
  for (auto& [sha256, entry] : files_) {
    if (entry.under_way) continue;
    if (entry.record.whole()) {
      if (needed.contains(sha256)) {
        entry.unneeded_since = Steady(0);
        continue;
      }
      if (entry.unneeded_since == Steady(0)) entry.unneeded_since = now.steady;
      if (now.steady - entry.unneeded_since < keep_) continue;
      records::Visual next = entry.record;
      next.set_whole(false);
      if (!Store(sha256, entry, next).ok()) continue;
      state_.Log(absl::StrCat("visual removed sha256=", sha256, " bytes=", next.size(), ": no world needs it"));
    }
    state_.effects().visuals.insert(sha256);
  }
}

}  // namespace tessera::control
