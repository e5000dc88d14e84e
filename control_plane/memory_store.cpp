#include "control_plane/memory_store.h"

#include "absl/strings/str_cat.h"

namespace tessera::control {

absl::StatusOr<StoreEntry> MemoryStore::Get(std::string_view key) const {
  const std::lock_guard lock(mutex_);
  const auto found = entries_.find(key);
  if (found == entries_.end()) return absl::NotFoundError(absl::StrCat("store: no key ", std::string(key)));
  return StoreEntry{found->first, found->second.value, found->second.revision};
}

absl::StatusOr<std::vector<StoreEntry>> MemoryStore::ListWithout(std::string_view prefix,
                                                                 std::string_view without) const {
  const std::lock_guard lock(mutex_);
  std::vector<StoreEntry> result;
  for (auto it = entries_.lower_bound(prefix); it != entries_.end() && it->first.starts_with(prefix); ++it) {
    if (!without.empty() && it->first.starts_with(without)) continue;
    result.push_back({it->first, it->second.value, it->second.revision});
  }
  return result;
}

absl::StatusOr<Revision> MemoryStore::Txn(std::span<const StoreOp> ops) {
  if (absl::Status status = CheckOps(ops); !status.ok()) return status;
  const std::lock_guard lock(mutex_);
  if (failures_ > 0 && passes_-- <= 0) {
    --failures_;
    passes_ = 0;
    return absl::UnavailableError("store: no space left");
  }
  for (const StoreOp& op : ops) {
    const auto found = entries_.find(op.key);
    const Revision at = found == entries_.end() ? kAbsent : found->second.revision;
    if (at != op.expected) return Conflict(op, at);
  }
  ++revision_;
  for (const StoreOp& op : ops) {
    if (op.kind == StoreOp::Kind::kDelete) {
      entries_.erase(op.key);
    } else {
      entries_[op.key] = {op.value, revision_};
      bytes_written_ += op.value.size();
    }
  }
  return revision_;
}

Revision MemoryStore::revision() const {
  const std::lock_guard lock(mutex_);
  return revision_;
}

void MemoryStore::FailNext(int count, int passes) {
  const std::lock_guard lock(mutex_);
  failures_ = count;
  passes_ = passes;
}

int MemoryStore::failures() const {
  const std::lock_guard lock(mutex_);
  return failures_;
}

std::size_t MemoryStore::bytes_written() const {
  const std::lock_guard lock(mutex_);
  return bytes_written_;
}

}  // namespace tessera::control
