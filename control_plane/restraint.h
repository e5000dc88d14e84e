// Restraint: what a process has given up for good, as the kernel keeps it.
//
// A process sets no_new_privs and adds filters of system calls (seccomp); none of both is ever taken back, and children
// inherit them. Every worker has both before anybody has sent it a byte (region_worker/sandbox.h). So whoever has more
// of them than this process is kept from things that this process may do, and should not have them done from here.
//
// Thread rule: any thread.
#pragma once

#include <sys/types.h>

#include <string_view>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace tessera::control {

struct Restraint {
  bool no_new_privileges = false;
  int filters = 0;  // their number; before Linux 5.9, 2 if there is any
};

// From the text of /proc/PID/status. UNIMPLEMENTED: it lacks a line, as that of gVisor does.
absl::StatusOr<Restraint> ParseRestraint(std::string_view status);
// UNAVAILABLE: the process is gone, is not in this process's namespace, or /proc hides it.
absl::StatusOr<Restraint> RestraintOf(pid_t pid);
// The process that is behind a connected Unix socket may have done from here whatever this one may. PERMISSION_DENIED
// says why not: it is another user's, cannot be looked at, or is more restrained than this process. Root's may where
// /proc hides them, and everyone of this user where the kernel says nothing about this process itself.
absl::Status CheckPeer(int connected);

}  // namespace tessera::control
