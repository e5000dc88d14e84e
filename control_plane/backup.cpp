#include "control_plane/backup.h"

#include <algorithm>
#include <cstring>
#include <limits>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "control_plane/life.h"
#include "control_plane/memory_store.h"
#include "control_plane/stored_records.h"
#include "core/world/sha256.h"

namespace tessera::control {
namespace {

constexpr std::string_view kBackupMagic = "tessera backup ";
constexpr std::string_view kBackupHead = "tessera backup 1\n";
constexpr std::size_t kBackupDigest = 64;
constexpr std::uint32_t kBackupEnd = std::numeric_limits<std::uint32_t>::max();

void PutLength(std::uint32_t length, std::string& out) {
  for (int shift = 0; shift < 32; shift += 8) out.push_back(static_cast<char>(length >> shift));
}

// The lengths are checked by the caller.
std::uint32_t LengthAt(std::string_view bytes, std::size_t at) {
  std::uint32_t length = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    length |= static_cast<std::uint32_t>(static_cast<unsigned char>(bytes[at + i])) << (8 * i);
  }
  return length;
}

absl::Status CutShort() { return absl::DataLossError("backup: is cut short or damaged"); }

absl::StatusOr<std::vector<StoreOp>> ReadBackup(std::string_view file) {
  if (!file.starts_with(kBackupMagic)) return absl::InvalidArgumentError("backup: is no backup of a cluster");
  if (!file.starts_with(kBackupHead)) return absl::InvalidArgumentError("backup: is of a newer version");
  if (file.size() < kBackupHead.size() + 8 + kBackupDigest) return CutShort();
  const std::string_view body = file.substr(0, file.size() - kBackupDigest);
  if (Sha256Hex(body) != file.substr(body.size())) return CutShort();
  std::vector<StoreOp> puts;
  std::size_t at = kBackupHead.size();
  while (true) {
    if (body.size() - at < 8) return CutShort();
    const std::size_t key = LengthAt(body, at), value = LengthAt(body, at + 4);
    at += 8;
    if (key == kBackupEnd && value == kBackupEnd) break;
    if (key > body.size() - at || value > body.size() - at - key) return CutShort();
    puts.push_back(PutOp(std::string(body.substr(at, key)), std::string(body.substr(at + key, value)), kAbsent));
    at += key + value;
  }
  if (at != body.size()) return CutShort();
  return puts;
}

// 32 bits hold it, and it stays below the numbers of viewers.
void RaisePlayers(records::Instance& record) {
  constexpr std::uint32_t kMost = std::numeric_limits<std::uint32_t>::max() / 4;
  record.set_last_player(
      std::min<std::uint32_t>(record.last_player() + static_cast<std::uint32_t>(kRestoreJump), kMost));
}

}  // namespace

absl::Status WriteBackup(const Store& store, const std::function<absl::Status(std::string_view)>& sink) {
  const auto entries = store.ListWithout("", kVisualKeys);
  if (!entries.ok()) return entries.status();
  std::string file(kBackupHead);
  for (const StoreEntry& entry : *entries) {
    if (entry.damaged) return absl::DataLossError(absl::StrCat("store: ", entry.key, ": is not whole"));
    PutLength(static_cast<std::uint32_t>(entry.key.size()), file);
    PutLength(static_cast<std::uint32_t>(entry.value.size()), file);
    file += entry.key;
    file += entry.value;
  }
  PutLength(kBackupEnd, file);
  PutLength(kBackupEnd, file);
  file += Sha256Hex(file);
  return sink(file);
}

void Raise(records::Counters& counters, const RandomBytes& random) {
  const auto above = [&random](std::uint64_t number) {
    std::uint64_t drawn = 0;
    const std::string bytes = random(sizeof drawn);
    std::memcpy(&drawn, bytes.data(), sizeof drawn);
    return number + kRestoreJump + drawn % kRestoreSpread;
  };
  counters.set_last_host(above(counters.last_host()));
  counters.set_last_instance(above(counters.last_instance()));
  counters.set_lives(counters.lives() + kRestoreJump);
  counters.set_recovering(true);
  counters.set_restored_life(counters.lives());
}

void Raise(records::Instance& record) {
  record.set_last_incarnation(record.last_incarnation() + kRestoreJump);
  record.set_last_map_version(std::max(record.last_map_version(), record.map().version()) + kRestoreJump);
  RaisePlayers(record);
}

void Raise(records::Revocations& record) {
  record.set_lost_after(record.number());
  record.set_number(record.number() + kRestoreJump);
  record.set_lost_up_to(record.number());
}

absl::StatusOr<RestoreReport> RestoreBackup(std::string_view file, Store& store, const RandomBytes& random) {
  auto puts = ReadBackup(file);
  if (!puts.ok()) return puts.status();
  const auto there = store.List("");
  if (!there.ok()) return there.status();
  if (!there->empty()) {
    return absl::FailedPreconditionError("backup: the store holds a cluster already; a backup goes into an empty one");
  }
  // A record that cannot be read is found before anything is written.
  MemoryStore trial;
  if (const auto written = trial.Txn(*puts); !written.ok()) return absl::DataLossError(written.status().message());
  auto records = ReadRecords(trial);
  if (!records.ok()) return records.status();
  if (!records->unreadable.empty()) {
    return absl::DataLossError(absl::StrCat("store: ", records->unreadable.front().key, ": cannot be read"));
  }
  for (StoreOp& put : *puts) {
    if (put.key == kCountersKey) {
      Raise(records->counters.record, random);
      put.value = records->counters.record.SerializeAsString();
    }
    if (put.key == kRevocationsKey) {
      records::Revocations revocations;
      if (!revocations.ParseFromString(put.value)) {
        return absl::DataLossError(absl::StrCat("store: ", put.key, ": cannot be read"));
      }
      Raise(revocations);
      put.value = revocations.SerializeAsString();
    }
    for (StoredRecord<records::Instance>& instance : records->instances) {
      if (put.key != InstanceKey(instance.number)) continue;
      Raise(instance.record);
      put.value = instance.record.SerializeAsString();
    }
  }
  if (records->counters.revision == kAbsent) return absl::DataLossError("backup: has no counters");
  if (const auto written = store.Txn(*puts); !written.ok()) return written.status();
  return RestoreReport{.hosts = records->hosts.size(), .instances = records->instances.size()};
}

}  // namespace tessera::control
