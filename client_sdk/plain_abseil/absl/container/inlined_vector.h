// absl::InlinedVector is the standard vector; see README.md.
#pragma once

// NOLINTBEGIN(readability-identifier-naming): names are those of Abseil

#include <cstddef>
#include <vector>

namespace absl {

template <class T, std::size_t kInlined>
using InlinedVector = std::vector<T>;

}  // namespace absl
// NOLINTEND(readability-identifier-naming)
