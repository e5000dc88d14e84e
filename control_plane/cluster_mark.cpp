#include "control_plane/cluster_mark.h"

#include <spdlog/spdlog.h>

#include <utility>

#include "absl/strings/escaping.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"

namespace tessera::control {
namespace {

constexpr std::size_t kClusterIdBytes = 8;

// "<id>", or "<id> <bucket>" once that is known to be this cluster's.
struct StoredMark {
  std::string id, bucket;
  Revision revision = kAbsent;
};

absl::StatusOr<StoredMark> ReadStoredMark(const Store& store) {
  StoredMark mark;
  const auto entry = store.Get(kClusterKey);
  if (absl::IsNotFound(entry.status())) return mark;
  if (!entry.ok()) return entry.status();
  const std::pair<std::string, std::string> parts = absl::StrSplit(entry->value, absl::MaxSplits(' ', 1));
  return StoredMark{.id = parts.first, .bucket = parts.second, .revision = entry->revision};
}

absl::Status NotTogether(const CheckpointFiles& files, const std::string& theirs, const std::string& store_name,
                         const std::string& ours) {
  return absl::FailedPreconditionError(
      absl::StrCat(files.name(), " holds checkpoints of ", theirs, ", but ", store_name, " is ", ours));
}

absl::Status CheckNotEmptied(const CheckpointFiles& files, const std::string& store_name) {
  const auto kept = files.Instances();
  if (!kept.ok()) return kept.status();
  const std::vector<std::string>& instances = *kept;
  if (instances.empty()) return absl::OkStatus();
  return NotTogether(files, absl::StrCat(instances.size() == 1 ? "" : "worlds, the first of them ", instances.front()),
                     store_name, "empty: put the store back, or, for a new cluster, move the checkpoints away");
}

}  // namespace

absl::Status CheckBelongTogether(Store& store, const CheckpointFiles& files, const std::string& store_name,
                                 const RandomBytes& random) {
  const bool is_new = store.revision() == 0;
  if (is_new) {
    if (absl::Status status = CheckNotEmptied(files, store_name); !status.ok()) return status;
  }
  const auto stored = ReadStoredMark(store);
  if (!stored.ok()) return stored.status();
  const bool bucket = absl::StartsWith(files.name(), "s3://");
  if (bucket && stored->bucket == files.name()) return absl::OkStatus();

  auto beside = files.ReadMark();
  if (!beside.ok() && !absl::IsNotFound(beside.status())) {
    spdlog::warn("checkpoints not known to be this cluster's error=\"{}\"", std::string(beside.status().message()));
    return absl::OkStatus();
  }
  if (is_new) beside = absl::NotFoundError("a new cluster begins there");
  if (beside.ok() && !stored->id.empty() && *beside != stored->id) {
    const auto kept = files.Instances();
    if (!kept.ok()) return kept.status();
    const std::vector<std::string>& instances = *kept;
    if (!instances.empty()) {
      return NotTogether(files, absl::StrCat("cluster ", *beside, ", ", instances.front(), " among them"), store_name,
                         absl::StrCat("that of cluster ", stored->id,
                                      ": put the store of those checkpoints there, or name another place for this "
                                      "cluster's by --checkpoints"));
    }
    beside = absl::NotFoundError("nothing of that cluster is left");
  }
  const std::string id = !stored->id.empty() ? stored->id
                         : beside.ok()       ? *beside
                                             : absl::BytesToHexString(random(kClusterIdBytes));
  absl::Status marked = beside.ok() ? absl::OkStatus() : files.WriteMark(id);
  const std::string value = marked.ok() && bucket ? absl::StrCat(id, " ", files.name()) : id;
  if (marked.ok() && (stored->id.empty() || bucket)) {
    marked = store.Put(kClusterKey, value, stored->revision).status();
  }
  if (!marked.ok()) {
    spdlog::warn("checkpoints not marked as this cluster's error=\"{}\"", std::string(marked.message()));
  }
  return absl::OkStatus();
}

}  // namespace tessera::control
