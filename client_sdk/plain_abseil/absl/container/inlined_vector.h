// absl::InlinedVector is the standard vector; see README.md.
#pragma once

#include <cstddef>
#include <vector>

namespace absl {

template <class T, std::size_t kInlined>
using InlinedVector = std::vector<T>;

}  // namespace absl
