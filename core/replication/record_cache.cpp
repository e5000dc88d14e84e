#include "core/replication/record_cache.h"

namespace tessera::replication {

void RecordCache::Begin(std::size_t slots) {
  if (++begun_ == 0) {
    rows_.assign(rows_.size(), Row());
    begun_ = 1;
  }
  if (rows_.size() < slots) rows_.resize(slots);
  blocks_.clear();
  words_.clear();
}

RecordCache::Place RecordCache::Add(const Key& key) {
  const auto fresh = [&] {
    blocks_.emplace_back();
    if (pairs_.size() < kInBlock * blocks_.size()) pairs_.resize(2 * kInBlock * blocks_.size());
    return static_cast<Place>(blocks_.size() - 1);
  };
  Row& row = rows_[key.slot];
  if (row.begun != begun_) row = {.begun = begun_, .first = fresh()};
  Place at = row.first;
  while (blocks_[at].next != kNowhere) at = blocks_[at].next;
  if (blocks_[at].count == kInBlock) {
    const Place next = fresh();
    blocks_[at].next = next;
    at = next;
  }
  Block& block = blocks_[at];
  block.keys[block.count] = key.packed();
  const Place place = kInBlock * at + block.count++;
  pairs_[place].bits = {Record::kNone, Record::kNone};
  return place;
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
