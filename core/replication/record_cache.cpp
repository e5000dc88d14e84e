#include "core/replication/record_cache.h"

#include <algorithm>

namespace tessera::replication {

void RecordCache::Begin() {
  constexpr std::size_t kFewest = 256;
  const std::size_t room = std::bit_ceil(std::max(kFewest, 3 * count_));
  if (++begun_ == 0 || table_.size() < room) {
    table_.assign(room, Entry());
    begun_ = 1;
  }
  count_ = 0;
  words_.clear();
}

RecordCache::Entry& RecordCache::Place(const Key& key) {
  for (std::size_t at = Hash(key);; ++at) {
    Entry& entry = table_[at & (table_.size() - 1)];
    if (entry.begun != begun_ || entry.key == key) return entry;
  }
}

RecordCache::Entry& RecordCache::Find(const Key& key) {
  Entry* entry = &Place(key);
  if (entry->begun == begun_) return *entry;
  if (2 * ++count_ > table_.size()) {
    Grow();
    entry = &Place(key);
  }
  *entry = {.key = key, .begun = begun_};
  return *entry;
}

void RecordCache::Grow() {
  std::vector<Entry> old(2 * table_.size());
  old.swap(table_);
  for (const Entry& entry : old) {
    if (entry.begun == begun_) Place(entry.key) = entry;
  }
}

std::uint32_t RecordCache::Store(const PackedRecord& record) {
  const auto at = static_cast<std::uint32_t>(words_.size());
  // One at least, so that what has no bits still lies somewhere.
  const auto words = static_cast<std::size_t>(std::max(1, (record.bits + 63) / 64));
  words_.insert(words_.end(), record.words.begin(), record.words.begin() + static_cast<std::ptrdiff_t>(words));
  return at;
}

}  // namespace tessera::replication
