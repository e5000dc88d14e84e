// Ascends: whether each of a list is above the one before it, by some key. For assertions.
#pragma once

#include <algorithm>
#include <functional>

namespace tessera::region {

template <class List, class Key = std::identity>
bool Ascends(const List& list, Key key = {}) {
  return std::ranges::adjacent_find(list, std::ranges::greater_equal(), key) == std::ranges::end(list);
}

}  // namespace tessera::region
