// Assembly: the ids of bodies that joints connect, ascending. Those of a scene are a list; those that a game makes
// follow each other, and need none. A body without joints is an assembly of itself.
//
// A view: valid as long as the catalog that gave it. Thread rule: plain value.
#pragma once

#include <algorithm>
#include <cstddef>
#include <iterator>
#include <span>

#include "core/world/ids.h"

namespace tessera::region {

class Assembly {
 public:
  class Iterator {
   public:
    using iterator_category = std::forward_iterator_tag;
    using iterator_concept = std::forward_iterator_tag;
    using value_type = BodyId;
    using difference_type = std::ptrdiff_t;
    using pointer = const BodyId*;
    using reference = BodyId;

    Iterator() = default;
    Iterator(const Assembly* assembly, std::size_t index) : assembly_(assembly), index_(index) {}
    BodyId operator*() const { return (*assembly_)[index_]; }
    Iterator& operator++() {
      ++index_;
      return *this;
    }
    Iterator operator++(int) {
      const Iterator before = *this;
      ++index_;
      return before;
    }
    friend bool operator==(const Iterator& a, const Iterator& b) { return a.index_ == b.index_; }

   private:
    const Assembly* assembly_ = nullptr;
    std::size_t index_ = 0;
  };
  using value_type = BodyId;
  using const_iterator = Iterator;

  explicit Assembly(std::span<const BodyId> listed) : list_(listed.data()), size_(listed.size()) {}
  // `first` and those after it.
  Assembly(BodyId first, std::size_t size) : first_(first), size_(size) {}

  std::size_t size() const { return size_; }
  BodyId operator[](std::size_t index) const {
    return list_ != nullptr ? list_[index] : BodyId(first_.value() + index);
  }
  BodyId front() const { return (*this)[0]; }
  Iterator begin() const { return {this, 0}; }
  Iterator end() const { return {this, size_}; }
  bool Contains(BodyId id) const {
    if (list_ != nullptr) return std::binary_search(list_, list_ + size_, id);
    return id >= first_ && id.value() - first_.value() < size_;
  }

 private:
  const BodyId* list_ = nullptr;
  BodyId first_;
  std::size_t size_;
};

}  // namespace tessera::region
