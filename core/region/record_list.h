// RecordList: the records of the bodies that a region owns, ascending by body.
//
// A record is large, so each stands by itself: where bodies come and go all the time, the list moves ids and pointers,
// and whoever looks for a body reads nothing else.
//
//   for (const KeptRecord& record : table.all()) ...
//
// Thread rule: one thread at a time.
#pragma once

#include <compare>
#include <cstddef>
#include <iterator>
#include <memory>
#include <span>
#include <utility>

#include "core/world/ids.h"

namespace tessera::region {

struct KeptRecord;

struct RecordPlace {
  BodyId body;
  std::unique_ptr<KeptRecord> record;
};

// Looks at records where they are. Valid until one comes or goes.
class RecordIterator {
 public:
  using iterator_category = std::random_access_iterator_tag;
  using value_type = KeptRecord;
  using difference_type = std::ptrdiff_t;
  using pointer = const KeptRecord*;
  using reference = const KeptRecord&;

  RecordIterator() = default;
  explicit RecordIterator(const RecordPlace* at) : at_(at) {}

  reference operator*() const { return *at_->record; }
  pointer operator->() const { return at_->record.get(); }
  reference operator[](difference_type n) const { return *at_[n].record; }
  RecordIterator& operator++() { return *this += 1; }
  RecordIterator& operator--() { return *this += -1; }
  RecordIterator operator++(int) { return RecordIterator(std::exchange(at_, at_ + 1)); }
  RecordIterator operator--(int) { return RecordIterator(std::exchange(at_, at_ - 1)); }
  RecordIterator& operator+=(difference_type n) {
    at_ += n;
    return *this;
  }
  RecordIterator& operator-=(difference_type n) { return *this += -n; }
  friend RecordIterator operator+(RecordIterator a, difference_type n) { return a += n; }
  friend RecordIterator operator+(difference_type n, RecordIterator a) { return a += n; }
  friend RecordIterator operator-(RecordIterator a, difference_type n) { return a -= n; }
  friend difference_type operator-(RecordIterator a, RecordIterator b) { return a.at_ - b.at_; }
  friend auto operator<=>(RecordIterator a, RecordIterator b) = default;

 private:
  const RecordPlace* at_ = nullptr;
};

class RecordList {
 public:
  using value_type = KeptRecord;
  using const_iterator = RecordIterator;

  explicit RecordList(std::span<const RecordPlace> places) : places_(places) {}
  RecordIterator begin() const { return RecordIterator(places_.data()); }
  RecordIterator end() const { return RecordIterator(places_.data() + places_.size()); }
  std::size_t size() const { return places_.size(); }
  bool empty() const { return places_.empty(); }
  const KeptRecord& operator[](std::size_t index) const { return *places_[index].record; }

 private:
  std::span<const RecordPlace> places_;
};

}  // namespace tessera::region
