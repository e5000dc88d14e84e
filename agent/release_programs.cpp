#include "agent/release_programs.h"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <system_error>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"

namespace tessera::agent {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMostReleases = 16;  // that the control plane takes of a host
constexpr std::size_t kMaxReleaseBytes = 32;
constexpr const char* kRegionProgram = "tessera-region";

using ReleaseNumbers = std::array<std::uint32_t, 3>;

std::optional<ReleaseNumbers> ReadRelease(const std::string& text) {
  const std::vector<std::string> parts = absl::StrSplit(text, '.');
  ReleaseNumbers numbers{};
  if (text.size() > kMaxReleaseBytes || parts.size() != numbers.size()) return std::nullopt;
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    const bool digits = !parts[i].empty() && std::ranges::all_of(parts[i], [](char c) { return c >= '0' && c <= '9'; });
    if (!digits || !absl::SimpleAtoi(parts[i], &numbers[i])) return std::nullopt;
  }
  return numbers;
}

bool IsProgram(const fs::path& path) {
  std::error_code error;
  return fs::is_regular_file(path, error) && access(path.c_str(), X_OK) == 0;
}

}  // namespace

bool IsReleaseName(const std::string& text) { return ReadRelease(text).has_value(); }

ReleasePrograms::ReleasePrograms(const ReleaseProgramsOptions& options) : own_release_(options.own_release) {
  std::error_code error;
  for (const fs::directory_entry& entry : fs::directory_iterator(options.folder, error)) {
    const std::string release = entry.path().filename().string();
    const fs::path program = entry.path() / kRegionProgram;
    if (IsReleaseName(release) && IsProgram(program)) programs_[release] = program.string();
  }
  if (options.own_program_given || !programs_.contains(own_release_)) programs_[own_release_] = options.own_program;
}

std::vector<std::string> ReleasePrograms::releases() const {
  std::vector<std::string> all;
  all.reserve(programs_.size());
  for (const auto& [release, program] : programs_) all.push_back(release);
  std::ranges::sort(all, {}, [](const std::string& release) { return ReadRelease(release); });
  if (all.size() <= kMostReleases) return all;
  // The own one stays, though it were among the oldest.
  std::erase(all, own_release_);
  all.erase(all.begin(), all.end() - static_cast<std::ptrdiff_t>(kMostReleases - 1));
  all.push_back(own_release_);
  std::ranges::sort(all, {}, [](const std::string& release) { return ReadRelease(release); });
  return all;
}

std::string ReleasePrograms::ProgramOf(const std::string& release) const {
  const auto found = programs_.find(release.empty() ? own_release_ : release);
  return found == programs_.end() ? "" : found->second;
}

}  // namespace tessera::agent
