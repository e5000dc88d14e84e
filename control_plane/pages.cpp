#include "control_plane/pages.h"

#include <algorithm>

#include "absl/strings/match.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/strip.h"
#include "control_plane/control_settings.h"

namespace tessera::control {
namespace {

constexpr absl::string_view kPrefix = "after-";

}  // namespace

absl::StatusOr<Page> ReadPage(std::int32_t page_size, const std::string& page_token) {
  if (page_size < 0) return absl::InvalidArgumentError(absl::StrCat("page_size: ", page_size, " is less than 0"));
  Page page{page_size == 0 ? kDefaultPageSize : std::min(page_size, kMaxPageSize), 0};
  if (page_token.empty()) return page;
  if (!absl::StartsWith(page_token, kPrefix) ||
      !absl::SimpleAtoi(absl::StripPrefix(page_token, kPrefix), &page.after)) {
    return absl::InvalidArgumentError("page_token: is not one that an earlier page gave");
  }
  return page;
}

std::string PageToken(std::uint64_t last) { return absl::StrCat(kPrefix, last); }

}  // namespace tessera::control
