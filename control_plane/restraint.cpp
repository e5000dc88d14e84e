#include "control_plane/restraint.h"

#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <optional>
#include <string>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "host/files.h"

namespace tessera::control {
namespace {

constexpr std::size_t kMaxStatusBytes = 64 * 1024;  // the kernel's has some 1500

// The number of the line that begins with `name` and a colon; nothing: there is no such line.
std::optional<int> NumberAt(std::string_view status, std::string_view name) {
  for (std::size_t begin = 0; begin < status.size();) {
    const std::size_t end = std::min(status.find('\n', begin), status.size());
    const std::string_view line = status.substr(begin, end - begin);
    begin = end + 1;
    if (!line.starts_with(name) || line.substr(name.size(), 1) != ":") continue;
    int number = 0;
    if (absl::SimpleAtoi(std::string(line.substr(name.size() + 1)), &number)) return number;
  }
  return std::nullopt;
}

}  // namespace

absl::StatusOr<Restraint> ParseRestraint(std::string_view status) {
  const auto no_new_privileges = NumberAt(status, "NoNewPrivs");
  auto filters = NumberAt(status, "Seccomp_filters");
  if (!filters) filters = NumberAt(status, "Seccomp");
  if (!no_new_privileges || !filters) {
    return absl::UnimplementedError("the kernel does not say what the process has given up");
  }
  return Restraint{.no_new_privileges = *no_new_privileges != 0, .filters = *filters};
}

absl::StatusOr<Restraint> RestraintOf(pid_t pid) {
  // A process of another namespace has number 0 here.
  if (pid <= 0) return absl::UnavailableError("the process is not in this one's namespace");
  const auto status = host::ReadFile(absl::StrCat("/proc/", pid, "/status"), kMaxStatusBytes);
  if (!status.ok()) return absl::UnavailableError(status.status().message());
  return ParseRestraint(*status);
}

absl::Status CheckPeer(int connected) {
  ucred peer{};
  socklen_t size = sizeof peer;
  if (getsockopt(connected, SOL_SOCKET, SO_PEERCRED, &peer, &size) != 0) {
    return absl::PermissionDeniedError(absl::StrCat("no peer credentials: ", std::strerror(errno)));
  }
  const auto denied = [&](const std::string& why) {
    return absl::PermissionDeniedError(absl::StrCat("process ", peer.pid, " of user ", peer.uid, ": ", why));
  };
  const bool is_root_alone = peer.uid == 0 && geteuid() != 0;
  if (peer.uid != geteuid() && !is_root_alone) return denied("is another user's");
  const auto own = RestraintOf(getpid()), its = RestraintOf(peer.pid);
  if (absl::IsUnimplemented(own.status())) return absl::OkStatus();
  if (!own.ok()) return denied(std::string(own.status().message()));
  if (!its.ok()) return is_root_alone ? absl::OkStatus() : denied(std::string(its.status().message()));
  if ((its->no_new_privileges && !own->no_new_privileges) || its->filters > own->filters) {
    return denied("has given up rights that this control plane has, as workers do");
  }
  return absl::OkStatus();
}

}  // namespace tessera::control
