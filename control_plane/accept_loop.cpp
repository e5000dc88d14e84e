#include "control_plane/accept_loop.h"

#include <poll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <utility>

namespace tessera::control {
namespace {

// While this program has no descriptor left, it looks again so often.
constexpr int kDescriptorPause_ms = 100;
constexpr std::chrono::milliseconds kBetweenRests{1000};

}  // namespace

AcceptLoop::AcceptLoop(std::vector<int> listening, Take take, Rest rest)
    : listening_(std::move(listening)),
      take_(std::move(take)),
      rest_(std::move(rest)),
      stop_(eventfd(0, EFD_CLOEXEC)),
      thread_([this] { Run(); }) {}

AcceptLoop::~AcceptLoop() {
  stopping_ = true;
  const std::uint64_t one = 1;
  (void)!write(stop_, &one, sizeof one);
  thread_.join();
  for (const int fd : listening_) close(fd);
  if (stop_ >= 0) close(stop_);
}

void AcceptLoop::Run() {
  using Clock = std::chrono::steady_clock;
  bool has_descriptors = true;
  Clock::time_point rested = Clock::now();
  for (;;) {
    std::vector<pollfd> watched{{.fd = stop_, .events = POLLIN, .revents = 0}};
    for (const int fd : listening_)
      watched.push_back({.fd = has_descriptors ? fd : -1, .events = POLLIN, .revents = 0});
    const int patience_ms = has_descriptors ? static_cast<int>(kBetweenRests.count()) : kDescriptorPause_ms;
    const int woken = poll(watched.data(), watched.size(), patience_ms);
    if (woken < 0 && errno != EINTR) return;
    if (stopping_) return;
    has_descriptors = true;
    for (std::size_t i = 1; i < watched.size(); ++i) {
      if (watched[i].revents != 0 && !Accept(watched[i].fd)) has_descriptors = false;
    }
    if (const Clock::time_point now = Clock::now(); now - rested >= kBetweenRests) {
      rested = now;
      rest_();
    }
  }
}

// False: this program has no descriptor left.
bool AcceptLoop::Accept(int listening) {
  const int fd = accept4(listening, nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK);
  if (fd < 0) return errno != EMFILE && errno != ENFILE;
  take_(fd);
  return true;
}

}  // namespace tessera::control
