// WakeEvent: one thread wakes another that waits in poll(2). An eventfd, closed at the end of its life.
//
// Thread rule: `Set` from any thread; `Clear` by the one that waits.
#pragma once

#include <sys/eventfd.h>
#include <unistd.h>

#include <cstdint>

namespace tessera::worker {

class WakeEvent {
 public:
  WakeEvent() : fd_(eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC)) {}
  ~WakeEvent() {
    if (fd_ >= 0) close(fd_);
  }
  WakeEvent(const WakeEvent&) = delete;
  WakeEvent& operator=(const WakeEvent&) = delete;

  int fd() const { return fd_; }
  void Set() const {
    const std::uint64_t one = 1;
    [[maybe_unused]] const ssize_t written = write(fd_, &one, sizeof one);  // fails only when it is set already
  }
  void Clear() const {
    std::uint64_t count = 0;
    [[maybe_unused]] const ssize_t got = read(fd_, &count, sizeof count);
  }

 private:
  int fd_;
};

}  // namespace tessera::worker
