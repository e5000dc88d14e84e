// ClusterState's part in stores that are not what they were: records that cannot be read, and backups.
#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "control_plane/backup.h"
#include "control_plane/cluster/cluster_state.h"
#include "control_plane/control_settings.h"
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
  NoteAccessChanged();  // a host that is set aside is none that was removed
  Log(absl::StrCat("record set aside key=", OneLine(entry.key, kMaxReasonBytes), " kept_as=",
                   OneLine(kept, kMaxReasonBytes), ": it cannot be read, and the cluster goes on without it"),
      Severity::kError);
  return absl::OkStatus();
}

bool ClusterState::IsSetAside(const std::string& key) const {
  return std::find(set_aside_.begin(), set_aside_.end(), key) != set_aside_.end();
}

// Workers take no order of a revision below the one that they have.
void ClusterState::NoteRevision(std::uint64_t shown) {
  if (shown <= last_revision_ || counters_.record.restored_life() == 0) return;
  const std::uint64_t life = shown >> kLifeShift;
  if (life > counters_.record.restored_life() + kMostRestores * kRestoreJump) return;
  records::Counters next = counters_.record;
  next.set_lives(life + 1);
  next.set_last_host(next.last_host() + kRestoreJump);
  next.set_last_instance(next.last_instance() + kRestoreJump);
  next.set_restored_again(next.recovering());
  const auto written = WriteOne(PutOp(kCountersKey, next.SerializeAsString(), counters_.revision));
  if (!written.ok()) return;
  counters_.record = next;
  counters_.revision = *written;
  NoteAccessChanged();  // more hosts may have been removed
  last_revision_ = next.lives() << kLifeShift;
  Log(absl::StrCat("life raised to ", next.lives(), ": a host holds orders of life ", life,
                   ", which the store that was made of a backup does not know"),
      Severity::kWarning);
  for (InstanceEntry& instance : EachInstance()) {
    for (WorkerEntry& worker : instance.workers) {
      worker.order.set_revision(0);  // made anew
      worker.ended_in = 0;
    }
    MarkOrders(instance);
  }
}

}  // namespace tessera::control
