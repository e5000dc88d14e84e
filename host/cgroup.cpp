#include "host/cgroup.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <optional>
#include <system_error>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "host/files.h"

namespace tessera::host {
namespace {

constexpr std::size_t kMaxCgroupFileBytes = 1 << 16;
constexpr char kOwnGroup[] = "agent", kUnifiedLine[] = "0::", kNoLimit[] = "max";

// The kernel takes each write as one command, so there is no temporary file and no newline in between.
absl::Status WriteCommand(const std::string& path, const std::string& value) {
  const int fd = open(path.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0600);
  const bool written = fd >= 0 && write(fd, value.data(), value.size()) == static_cast<ssize_t>(value.size());
  const int error = errno;
  if (fd >= 0) close(fd);
  return written ? absl::OkStatus() : absl::UnavailableError(absl::StrCat(path, ": ", std::strerror(error)));
}

absl::Status MakeGroup(const std::string& path) {
  if (mkdir(path.c_str(), 0755) == 0 || errno == EEXIST) return absl::OkStatus();
  return absl::UnavailableError(absl::StrCat(path, ": ", std::strerror(errno)));
}

std::optional<std::string> UnifiedGroup(const std::string& membership) {
  const auto text = ReadFile(membership, kMaxCgroupFileBytes);
  if (!text.ok()) return std::nullopt;
  for (const std::string& line : std::vector<std::string>(absl::StrSplit(*text, '\n'))) {
    if (line.starts_with(kUnifiedLine)) return line.substr(sizeof kUnifiedLine - 1);
  }
  return std::nullopt;
}

bool HasController(const std::string& path, const std::string& controller) {
  const auto text = ReadFile(path + "/cgroup.controllers", kMaxCgroupFileBytes);
  if (!text.ok()) return false;
  for (const std::string& name : std::vector<std::string>(absl::StrSplit(*text, absl::ByAnyChar(" \n")))) {
    if (name == controller) return true;
  }
  return false;
}

void RemoveEmptyGroups(const std::string& path) {
  std::error_code ignored;
  for (const auto& entry : std::filesystem::directory_iterator(path, ignored)) {
    // The kernel keeps one that still has processes.
    if (entry.is_directory(ignored) && entry.path().filename() != kOwnGroup) rmdir(entry.path().c_str());
  }
}

std::string LimitText(std::uint64_t limit) { return limit == 0 ? kNoLimit : std::to_string(limit); }

}  // namespace

absl::StatusOr<DelegatedCgroup> DelegatedCgroup::Open(const std::string& root, const std::string& membership) {
  const auto group = UnifiedGroup(membership);
  if (!group) return absl::FailedPreconditionError("cgroup v2: this process is in none of its groups");
  const std::string path = *group == "/" ? root : root + *group;
  for (const char* controller : {"memory", "pids"}) {
    if (HasController(path, controller)) continue;
    return absl::FailedPreconditionError(absl::StrCat("cgroup v2: ", path, " has no controller `", controller,
                                                      "`; its unit needs Delegate=memory pids"));
  }
  const auto refused = [](const absl::Status& status) {
    return absl::FailedPreconditionError(absl::StrCat("cgroup v2: ", status.message()));
  };
  if (absl::Status status = MakeGroup(absl::StrCat(path, "/", kOwnGroup)); !status.ok()) return refused(status);
  if (absl::Status status = WriteCommand(absl::StrCat(path, "/", kOwnGroup, "/cgroup.procs"), "0"); !status.ok()) {
    return refused(status);
  }
  if (absl::Status status = WriteCommand(path + "/cgroup.subtree_control", "+memory +pids"); !status.ok()) {
    return refused(status);
  }
  RemoveEmptyGroups(path);
  return DelegatedCgroup(path);
}

absl::StatusOr<std::string> DelegatedCgroup::Make(const std::string& name, const CgroupLimits& limits) const {
  const std::string path = absl::StrCat(path_, "/", name);
  if (absl::Status status = MakeGroup(path); !status.ok()) return status;
  for (const auto& [file, value] : {std::pair<const char*, std::string>("memory.max", LimitText(limits.memory_bytes)),
                                    std::pair<const char*, std::string>("pids.max", LimitText(limits.tasks)),
                                    std::pair<const char*, std::string>("memory.oom.group", "1")}) {
    if (absl::Status status = WriteCommand(absl::StrCat(path, "/", file), value); !status.ok()) return status;
  }
  return path;
}

void DelegatedCgroup::Remove(const std::string& name) const { rmdir(absl::StrCat(path_, "/", name).c_str()); }

}  // namespace tessera::host
