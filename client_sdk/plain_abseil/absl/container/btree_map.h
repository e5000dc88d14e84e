// absl::btree_map is the standard map; see README.md.
#pragma once

// NOLINTBEGIN(readability-identifier-naming): names are those of Abseil

#include <map>

namespace absl {

template <class Key, class Value>
using btree_map = std::map<Key, Value>;

}  // namespace absl
// NOLINTEND(readability-identifier-naming)
