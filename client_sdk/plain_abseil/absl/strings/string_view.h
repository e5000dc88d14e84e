// absl::string_view is the standard one; see README.md.
#pragma once

// NOLINTBEGIN(readability-identifier-naming): names are those of Abseil

#include <string_view>

namespace absl {

using string_view = std::string_view;

}  // namespace absl
// NOLINTEND(readability-identifier-naming)
