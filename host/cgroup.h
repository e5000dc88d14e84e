// DelegatedCgroup: the part of the kernel's tree of control groups (cgroup v2) that this program may divide itself, as
// systemd gives it to a unit with `Delegate=memory pids`: each of its children gets a group with limits.
//
//   auto groups = DelegatedCgroup::Open();
//   if (!groups.ok()) spdlog::warn("no groups: {}", ...);   // and limit by other means
//   auto group = groups->Make("worker-7", {.memory_bytes = 8 << 30, .tasks = 512});
//   Process::Spawn({.argv = ..., .cgroup = *group});
//   ...
//   groups->Remove("worker-7");                             // after its end
//
// A group's memory is what its processes really use, of which the kernel ends the whole group when it is more; its
// tasks are processes and threads. Thread rule: one owner.
#pragma once

#include <cstdint>
#include <string>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace tessera::host {

struct CgroupLimits {
  std::uint64_t memory_bytes = 0;  // 0: no limit
  std::uint32_t tasks = 0;         // likewise
};

class DelegatedCgroup {
 public:
  // Moves this process into a group `agent` of its own, as the kernel demands of one that has others beside it, and
  // removes groups of earlier lives that are empty. `root` is where cgroup v2 is mounted, `membership` says in which
  // group this process is. FAILED_PRECONDITION says what is missing: the mount, the controllers, or the right to write.
  static absl::StatusOr<DelegatedCgroup> Open(const std::string& root = "/sys/fs/cgroup",
                                              const std::string& membership = "/proc/self/cgroup");

  // The folder of a group of that name, with these limits; one that is there already gets them anew. `name` is a file
  // name. UNAVAILABLE says what could not be written.
  absl::StatusOr<std::string> Make(const std::string& name, const CgroupLimits& limits) const;
  // Repeating it is fine, and so is a group that is not empty yet: the next life's Open removes it.
  void Remove(const std::string& name) const;

  // For tests: one whose folder is there, and has been prepared.
  static DelegatedCgroup At(std::string path) { return DelegatedCgroup(std::move(path)); }

  const std::string& path() const { return path_; }

 private:
  explicit DelegatedCgroup(std::string path) : path_(std::move(path)) {}

  std::string path_;
};

}  // namespace tessera::host
