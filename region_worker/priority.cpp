#include "region_worker/priority.h"

#include <sched.h>
#include <sys/resource.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <fstream>

#include "absl/strings/str_cat.h"

namespace tessera::worker {
namespace {

// sched(7): where the kernel shares processors among sessions, and no cgroup does, nice values count within a session
// alone. Not there at all if the kernel was built without it; then there is nothing to do.
void LiftSession() {
  if (getsid(0) != getpid()) return;  // others are in it
  std::ofstream("/proc/self/autogroup") << kFirst;
}

}  // namespace

absl::Status GoFirst() {
  if (setpriority(PRIO_PROCESS, 0, kFirst) != 0) {
    return absl::PermissionDeniedError(absl::StrCat("priority ", kFirst, ": ", std::strerror(errno)));
  }
  // Not for what this thread starts: a checkpoint's writer can wait.
  const sched_param none{};
  (void)sched_setscheduler(0, SCHED_OTHER | SCHED_RESET_ON_FORK, &none);
  LiftSession();
  return absl::OkStatus();
}

}  // namespace tessera::worker
