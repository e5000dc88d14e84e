#include "gateway/recording_folder.h"

#include <unistd.h>

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <utility>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"
#include "client_sdk/recording.h"

namespace tessera::gateway {
namespace {

namespace fs = std::filesystem;

constexpr absl::string_view kEnding = ".rec";
constexpr std::size_t kMaxName = 128, kMaxListed = 1000;
constexpr int kMaxInASecond = 100;
// Less than this holds no world.
constexpr std::uint64_t kLeast_bytes = 100'000;

bool IsRecordingName(std::string_view name) {
  if (name.size() > kMaxName || name.empty() || name.front() == '.') return false;
  if (!absl::EndsWith({name.data(), name.size()}, kEnding)) return false;
  return std::all_of(name.begin(), name.end(), [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-' || c == '_' ||
           c == '.';
  });
}

struct File {
  std::string name;
  std::uint64_t bytes = 0;
  fs::file_time_type written;
};

std::vector<File> FilesIn(const std::string& folder) {
  std::vector<File> files;
  std::error_code error;
  for (fs::directory_iterator at(folder, error), end; !error && at != end; at.increment(error)) {
    std::error_code gone;
    const std::string name = at->path().filename().string();
    if (!IsRecordingName(name) || !at->is_regular_file(gone)) continue;
    const std::uint64_t bytes = at->file_size(gone);
    const fs::file_time_type written = at->last_write_time(gone);
    if (!gone) files.push_back({name, bytes, written});
  }
  return files;
}

}  // namespace

absl::Status RecordingFolder::Open() const {
  if (path_.empty()) return absl::OkStatus();
  std::error_code error;
  fs::create_directories(path_, error);
  if (!error && access(path_.c_str(), W_OK | X_OK) == 0) return absl::OkStatus();
  const std::string why = error ? error.message() : std::strerror(errno);
  return absl::UnavailableError(absl::StrCat("--recordings-dir ", path_, ": ", why));
}

absl::StatusOr<RecordingFolder::Place> RecordingFolder::Make(const std::string& instance,
                                                             std::chrono::system_clock::time_point now) const {
  if (path_.empty()) {
    return absl::FailedPreconditionError("this gateway makes no recordings; --recordings-dir names a folder for them");
  }
  std::uint64_t used = 0;
  for (const File& file : FilesIn(path_)) used += file.bytes;
  if (used + kLeast_bytes > limits_.folder_bytes) {
    return absl::ResourceExhaustedError(absl::StrCat("the gateway's recordings have ", used / 1'000'000, " MB, of ",
                                                     limits_.folder_bytes / 1'000'000,
                                                     "; remove some, or see --recordings-mb"));
  }
  const std::string name =
      absl::StrCat(instance, "-", absl::FormatTime("%Y%m%dT%H%M%SZ", absl::FromChrono(now), absl::UTCTimeZone()));
  for (int count = 1; count <= kMaxInASecond; ++count) {
    const std::string file = absl::StrCat(name, count == 1 ? "" : absl::StrCat("-", count), kEnding);
    const std::string path = (fs::path(path_) / file).string();
    std::error_code error;
    if (fs::exists(path, error)) continue;
    return Place{file, path, std::min(limits_.file_bytes, limits_.folder_bytes - used)};
  }
  return absl::ResourceExhaustedError(absl::StrCat("there are ", kMaxInASecond, " recordings of this second"));
}

absl::StatusOr<std::string> RecordingFolder::PathOf(std::string_view file) const {
  std::error_code error;
  if (!path_.empty() && IsRecordingName(file)) {
    const fs::path path = fs::path(path_) / fs::path(std::string(file));
    if (fs::is_regular_file(path, error)) return path.string();
  }
  return absl::NotFoundError("the gateway has no recording of that name; see the list of recordings");
}

std::vector<ListedRecording> RecordingFolder::List() const {
  if (path_.empty()) return {};
  std::vector<File> files = FilesIn(path_);
  std::sort(files.begin(), files.end(),
            [](const File& a, const File& b) { return std::pair(b.written, b.name) < std::pair(a.written, a.name); });
  if (files.size() > kMaxListed) files.resize(kMaxListed);
  std::vector<ListedRecording> listed;
  listed.reserve(files.size());
  for (const File& file : files) {
    ListedRecording entry{.file = file.name, .instance = "", .bytes = file.bytes};
    if (const auto summary = client::SummaryOf((fs::path(path_) / file.name).string()); summary.ok()) {
      entry.instance = summary->instance_id;
      if (summary->length) entry.seconds = std::chrono::duration<double>(*summary->length).count();
    }
    listed.push_back(std::move(entry));
  }
  return listed;
}

}  // namespace tessera::gateway
