// ClusterState's part in records that cannot be read.
#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "control_plane/cluster/cluster_state.h"
#include "control_plane/one_line.h"

namespace tessera::control {
namespace {

// "unreadable/<life>/<key>": the key that the record had.
std::string KeyBefore(const std::string& key) {
  const std::size_t slash = key.find('/', sizeof kSetAside - 1);
  return slash == std::string::npos ? "" : key.substr(slash + 1);
}

}  // namespace

absl::Status ClusterState::LoadSetAside(const std::vector<StoreEntry>& unreadable, bool drop_old) {
  const auto before = store_.List(kSetAside);
  if (!before.ok()) return before.status();
  for (const StoreEntry& entry : *before) {
    if (!drop_old) {
      set_aside_.push_back(KeyBefore(entry.key));
      Log(absl::StrCat("record still set aside key=", OneLine(set_aside_.back(), kMaxReasonBytes)), Severity::kError);
      continue;
    }
    if (const auto dropped = WriteOne(DeleteOp(entry.key, entry.revision)); !dropped.ok()) return dropped.status();
    Log(absl::StrCat("record dropped that was set aside key=", OneLine(KeyBefore(entry.key), kMaxReasonBytes)),
        Severity::kWarning);
  }
  for (const StoreEntry& entry : unreadable) {
    if (absl::Status status = SetAside(entry); !status.ok()) return status;
    if (const std::uint64_t number = InstanceOfPlayersKey(entry.key); number != 0) lack_players_.insert(number);
  }
  return absl::OkStatus();
}

absl::Status ClusterState::SetAside(const StoreEntry& entry) {
  const std::string kept = absl::StrCat(kSetAside, counters_.record.lives(), "/", entry.key);
  const StoreOp ops[] = {PutOp(kept, entry.value, kAbsent), DeleteOp(entry.key, entry.revision)};
  if (const auto written = Write(ops); !written.ok()) return written.status();
  set_aside_.push_back(entry.key);
  Log(absl::StrCat("record set aside key=", OneLine(entry.key, kMaxReasonBytes), " kept_as=",
                   OneLine(kept, kMaxReasonBytes), ": it cannot be read, and the cluster goes on without it"),
      Severity::kError);
  return absl::OkStatus();
}

bool ClusterState::IsSetAside(const std::string& key) const {
  return std::find(set_aside_.begin(), set_aside_.end(), key) != set_aside_.end();
}

}  // namespace tessera::control
