#include "host/file_watch.h"

#include <sys/inotify.h>
#include <unistd.h>

#include <array>

#include "host/wait_readable.h"

namespace tessera::host {

FileWatch::FileWatch(const std::string& path) : events_(inotify_init1(IN_CLOEXEC | IN_NONBLOCK)) {
  inotify_add_watch(events_, path.c_str(), IN_MOVED_TO | IN_CREATE | IN_CLOSE_WRITE | IN_MODIFY);
}

FileWatch::~FileWatch() {
  if (events_ >= 0) close(events_);
}

bool FileWatch::Wait(std::chrono::milliseconds timeout, int descriptor) {
  if (!WaitReadable({events_, descriptor}, timeout)) return false;
  std::array<char, 4096> ignored;
  while (read(events_, ignored.data(), ignored.size()) > 0) {
  }
  return true;
}

}  // namespace tessera::host
