#include "control_plane/release.h"

#include <algorithm>
#include <optional>
#include <string>
#include <tuple>
#include <vector>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "control_plane/one_line.h"

namespace tessera::control {
namespace {

constexpr std::size_t kShownBytes = 40;

struct Release {
  int first = 0, second = 0, third = 0;  // third: 0 where it is no number
};

std::optional<Release> ReadRelease(std::string_view text) {
  const std::vector<std::string> parts = absl::StrSplit(std::string(text), '.');
  Release release;
  if (parts.size() != 3 || !absl::SimpleAtoi(parts[0], &release.first) ||
      !absl::SimpleAtoi(parts[1], &release.second) || release.first < 0 || release.second < 0) {
    return std::nullopt;
  }
  if (!absl::SimpleAtoi(parts[2], &release.third)) release.third = 0;
  return release;
}

// How many releases lie between them; 2 stands for more than one.
int Distance(const Release& a, const Release& b) {
  if (a.first == 0 && b.first == 0) return std::max(a.second - b.second, b.second - a.second);
  const int apart = std::max(a.first - b.first, b.first - a.first);
  return apart == 0 ? 0 : std::min(apart, 2);
}

}  // namespace

absl::Status CheckRelease(std::string_view agents, std::string_view own) {
  const auto ours = ReadRelease(own);
  if (!ours) return absl::OkStatus();
  const auto theirs = ReadRelease(agents);
  const std::string shown = OneLine(std::string(agents), kShownBytes);
  if (!theirs) return absl::InvalidArgumentError(absl::StrCat("hello.version: \"", shown, "\" is no release"));
  if (Distance(*theirs, *ours) <= 1) return absl::OkStatus();
  return absl::FailedPreconditionError(absl::StrCat("hello.version: an agent of release ", shown,
                                                    " does not work with this control plane, ", std::string(own),
                                                    "; they may be one release apart: upgrade in steps"));
}

bool IsOlderRelease(std::string_view a, std::string_view b) {
  const auto key = [](std::string_view text) {
    const std::optional<Release> read = ReadRelease(text);
    const Release release = read.value_or(Release{});
    return std::tuple(read.has_value(), release.first, release.second, release.third, text);
  };
  return key(a) < key(b);
}

absl::Status CheckReleases(const google::protobuf::RepeatedPtrField<std::string>& releases) {
  if (releases.size() > kMaxReleases) {
    return absl::InvalidArgumentError(
        absl::StrCat("hello.releases: has ", releases.size(), " entries, at most ", kMaxReleases));
  }
  for (const std::string& release : releases) {
    if (release.size() <= kShownBytes && ReadRelease(release)) continue;
    return absl::InvalidArgumentError(
        absl::StrCat("hello.releases: \"", OneLine(release, kShownBytes), "\" is no release"));
  }
  return absl::OkStatus();
}

}  // namespace tessera::control
