// Pages of a listing, as in AIP-158: a size, and a token that says where the last page ended.
#pragma once

#include <cstdint>
#include <string>

#include "absl/status/statusor.h"

namespace tessera::control {

struct Page {
  int size = 0;
  std::uint64_t after = 0;  // the number of the last item seen; 0 at the start
};

// Errors are kInvalidArgument: "page_size: ..." below 0, "page_token: ..." if it was not made by PageToken. Sizes above
// the largest are cut.
absl::StatusOr<Page> ReadPage(std::int32_t page_size, const std::string& page_token);
std::string PageToken(std::uint64_t last);

}  // namespace tessera::control
