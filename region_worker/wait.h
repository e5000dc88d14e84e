// The means by which the loop waits: signals as something to poll, and a wait for many descriptors that ends to the
// microsecond.
#pragma once

#include <poll.h>
#include <sys/signalfd.h>
#include <unistd.h>

#include <algorithm>
#include <span>

#include "host/end_signals.h"
#include "region_worker/core/time.h"

namespace tessera::worker {

// SIGTERM and SIGINT, taken from their usual way. Make it before any thread: threads inherit what is blocked.
class SignalWatch {
 public:
  SignalWatch() {
    const sigset_t set = host::BlockSignals({SIGTERM, SIGINT});
    fd_ = signalfd(-1, &set, SFD_NONBLOCK | SFD_CLOEXEC);
  }
  ~SignalWatch() {
    if (fd_ >= 0) close(fd_);
  }
  SignalWatch(const SignalWatch&) = delete;
  SignalWatch& operator=(const SignalWatch&) = delete;

  int fd() const { return fd_; }
  // The signal that came; 0: none.
  int Take() const {
    signalfd_siginfo info{};
    return read(fd_, &info, sizeof info) == sizeof info ? static_cast<int>(info.ssi_signo) : 0;
  }

 private:
  int fd_ = -1;
};

// Until one of `fds` is readable or `deadline` has come. A negative descriptor is left out.
inline void WaitReadable(std::span<pollfd> fds, TimePoint now, TimePoint deadline) {
  const auto left =
      std::max(std::chrono::duration_cast<std::chrono::nanoseconds>(deadline - now).count(), std::int64_t{0});
  const timespec timeout{.tv_sec = left / 1'000'000'000, .tv_nsec = left % 1'000'000'000};
  (void)ppoll(fds.data(), fds.size(), &timeout, nullptr);
}

}  // namespace tessera::worker
