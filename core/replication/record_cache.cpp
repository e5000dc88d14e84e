#include "core/replication/record_cache.h"

#include <algorithm>

namespace tessera::replication {

void RecordCache::Begin() {
  constexpr std::size_t kFewest = 256;
  const std::size_t room = std::bit_ceil(std::max(kFewest, 2 * count_));
  if (++begun_ == 0 || table_.size() < room) {
    table_.assign(room, Entry());
    begun_ = 1;
  }
  count_ = 0;
  words_.clear();
}

RecordCache::Entry& RecordCache::Place(std::uint64_t key) {
  for (std::size_t at = Hash(key);; ++at) {
    Entry& entry = table_[at & (table_.size() - 1)];
    if (entry.begun != begun_ || entry.key == key) return entry;
  }
}

RecordCache::Entry& RecordCache::Find(const Key& key) {
  const std::uint64_t packed = key.packed();
  Entry* entry = &Place(packed);
  if (entry->begun == begun_) return *entry;
  if (3 * ++count_ > 2 * table_.size()) {
    Grow();
    entry = &Place(packed);
  }
  *entry = {.key = packed, .begun = begun_};
  return *entry;
}

void RecordCache::Grow() {
  std::vector<Entry> old(2 * table_.size());
  old.swap(table_);
  for (const Entry& entry : old) {
    if (entry.begun == begun_) Place(entry.key) = entry;
  }
}

RecordCache::Record RecordCache::Store(const PackedRecord& record) {
  const auto bits = static_cast<std::uint16_t>(record.bits);
  if (record.bits <= 64) return {record.words[0], bits};
  const auto at = words_.size();
  const auto words = static_cast<std::ptrdiff_t>((record.bits + 63) / 64);
  words_.insert(words_.end(), record.words.begin(), record.words.begin() + words);
  return {at, bits};
}

}  // namespace tessera::replication
