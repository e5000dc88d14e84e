#include "host/landlock.h"

#include <sys/syscall.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"

namespace tessera::host {

absl::StatusOr<int> LandlockVersion() {
  constexpr unsigned kAskVersion = 1;
  const long version = syscall(SYS_landlock_create_ruleset, nullptr, 0, kAskVersion);
  if (version >= 1) return static_cast<int>(version);
  return absl::UnavailableError(absl::StrCat("Landlock: ", std::strerror(version < 0 ? errno : ENOSYS)));
}

}  // namespace tessera::host
