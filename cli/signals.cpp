#include "cli/signals.h"

#include <poll.h>
#include <sys/signalfd.h>
#include <unistd.h>

#include "host/end_signals.h"

namespace tessera::cli {

StopSignal::StopSignal() {
  const sigset_t set = host::BlockSignals({SIGINT, SIGTERM});
  fd_ = signalfd(-1, &set, SFD_CLOEXEC | SFD_NONBLOCK);
}

StopSignal::~StopSignal() { close(fd_); }

bool StopSignal::Wait(std::chrono::milliseconds timeout) {
  if (stopped_) return true;
  pollfd watch{fd_, POLLIN, 0};
  if (poll(&watch, 1, static_cast<int>(timeout.count())) > 0) {
    signalfd_siginfo info;
    stopped_ = read(fd_, &info, sizeof info) == sizeof info;
  }
  return stopped_;
}

}  // namespace tessera::cli
