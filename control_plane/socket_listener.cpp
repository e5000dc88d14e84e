#include "control_plane/socket_listener.h"

#include <poll.h>
#include <spdlog/spdlog.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdint>
#include <cstring>
#include <utility>

#include "absl/strings/str_cat.h"
#include "control_plane/restraint.h"
#include "host/unix_socket.h"
#include "telemetry/log_value.h"

namespace tessera::control {
namespace {

// While this program has no descriptor left, it looks again so often.
constexpr int kDescriptorPause_ms = 100;

}  // namespace

absl::StatusOr<std::unique_ptr<SocketListener>> SocketListener::Listen(const std::string& path, Take take) {
  const absl::StatusOr<int> listening = host::ListenOnUnixSocket(path);
  if (!listening.ok()) return listening.status();
  const int stop = eventfd(0, EFD_CLOEXEC);
  if (stop < 0) {
    const int error = errno;
    close(*listening);
    return absl::UnavailableError(absl::StrCat("socket ", path, ": ", std::strerror(error)));
  }
  if (const auto own = RestraintOf(getpid()); !own.ok()) {
    spdlog::warn("at the socket workers are not told from their user reason={}",
                 telemetry::LogValue(std::string(own.status().message())));
  }
  std::unique_ptr<SocketListener> listener(new SocketListener(path, *listening, stop, std::move(take)));
  listener->thread_ = std::thread([raw = listener.get()] { raw->Run(); });
  return listener;
}

SocketListener::SocketListener(std::string path, int listening, int stop, Take take)
    : path_(std::move(path)), listening_(listening), stop_(stop), take_(std::move(take)) {}

SocketListener::~SocketListener() {
  const std::uint64_t one = 1;
  (void)!write(stop_, &one, sizeof one);
  thread_.join();
  unlink(path_.c_str());
  close(listening_);
  close(stop_);
}

void SocketListener::Run() {
  bool has_descriptors = true;
  for (;;) {
    std::array<pollfd, 2> watched{{{.fd = stop_, .events = POLLIN, .revents = 0},
                                   {.fd = has_descriptors ? listening_ : -1, .events = POLLIN, .revents = 0}}};
    const int woken = poll(watched.data(), watched.size(), has_descriptors ? -1 : kDescriptorPause_ms);
    if (woken < 0 && errno != EINTR) return;
    if (watched[0].revents != 0) return;
    has_descriptors = !has_descriptors || watched[1].revents == 0 || Accept();
  }
}

// False: this program has no descriptor left.
bool SocketListener::Accept() {
  const int fd = accept4(listening_, nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK);
  if (fd < 0) return errno != EMFILE && errno != ENFILE;
  if (const absl::Status status = CheckPeer(fd); status.ok()) {
    take_(fd);
  } else {
    close(fd);
    if (const auto left_out = refusals_.Take(telemetry::LogThrottle::Clock::now())) {
      spdlog::warn("refused at the socket reason={} more={}", telemetry::LogValue(std::string(status.message())),
                   *left_out);
    }
  }
  return true;
}

}  // namespace tessera::control
