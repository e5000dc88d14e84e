// absl::string_view is the standard one; see README.md.
#pragma once

#include <string_view>

namespace absl {

using string_view = std::string_view;

}  // namespace absl
