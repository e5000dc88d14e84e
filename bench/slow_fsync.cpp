#include "bench/slow_fsync.h"

#include <linux/filter.h>
#include <linux/seccomp.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/ioctl.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstddef>
#include <cstring>
#include <future>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"

namespace tessera::bench {
namespace {

using AnswerClock = std::chrono::steady_clock;

// The calling thread, and all that it starts, asks before each fsync. The descriptor by which it asks; -1: see errno.
int AskBeforeFsync() {
  std::array<sock_filter, 5> code{
      {BPF_STMT(BPF_LD | BPF_W | BPF_ABS, static_cast<unsigned>(offsetof(seccomp_data, nr))),
       BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, static_cast<unsigned>(SYS_fsync), 1, 0),
       BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, static_cast<unsigned>(SYS_fdatasync), 0, 1),
       BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_USER_NOTIF), BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ALLOW)}};
  sock_fprog program{.len = code.size(), .filter = code.data()};
  if (prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) != 0) return -1;
  return static_cast<int>(syscall(SYS_seccomp, SECCOMP_SET_MODE_FILTER, SECCOMP_FILTER_FLAG_NEW_LISTENER, &program));
}

struct Asked {
  std::uint64_t id = 0;
  AnswerClock::time_point due;
};

void LetGoOn(int listener, std::uint64_t id) {
  seccomp_notif_resp answer{.id = id, .val = 0, .error = 0, .flags = SECCOMP_USER_NOTIF_FLAG_CONTINUE};
  // One that has ended meanwhile hears nothing, which is as well.
  (void)ioctl(listener, SECCOMP_IOCTL_NOTIF_SEND, &answer);
}

}  // namespace

absl::StatusOr<std::unique_ptr<SlowFsync>> SlowFsync::Begin() {
  std::unique_ptr<SlowFsync> result(new SlowFsync());
  SlowFsync& self = *result;
  std::promise<std::pair<int, int>> told;  // the descriptor, errno
  self.starter_ = std::thread([&] { self.StartPrograms([&](int listener) { told.set_value({listener, errno}); }); });
  const auto [listener, error] = told.get_future().get();
  self.listener_ = listener;
  if (listener < 0) return absl::UnavailableError(absl::StrCat("the kernel does not ask: ", std::strerror(error)));
  self.end_ = eventfd(0, EFD_CLOEXEC);
  if (self.end_ < 0) return absl::UnavailableError(absl::StrCat("eventfd: ", std::strerror(errno)));
  self.answerer_ = std::thread([&self] { self.Answer(); });
  return result;
}

SlowFsync::~SlowFsync() {
  {
    const std::lock_guard lock(mutex_);
    ended_ = true;
  }
  changed_.notify_all();
  starter_.join();
  if (answerer_.joinable()) {
    const std::uint64_t one = 1;
    (void)!write(end_, &one, sizeof one);
    answerer_.join();
  }
  for (const int descriptor : {listener_, end_}) {
    if (descriptor >= 0) close(descriptor);
  }
}

// Programs get their signal of the end when the thread that started them ends, so there is one for all of them.
void SlowFsync::StartPrograms(const std::function<void(int)>& tell) {
  tell(AskBeforeFsync());
  std::unique_lock lock(mutex_);
  while (true) {
    changed_.wait(lock, [this] { return ended_ || !starts_.empty(); });
    if (ended_) return;
    const std::function<void()> start = std::move(starts_.front());
    starts_.pop_front();
    lock.unlock();
    start();
    lock.lock();
  }
}

absl::StatusOr<host::ChildProcess> SlowFsync::Start(host::ProcessSpec spec) {
  std::promise<absl::StatusOr<host::ChildProcess>> started;
  {
    const std::lock_guard lock(mutex_);
    starts_.emplace_back([&] { started.set_value(host::ChildProcess::Start(std::move(spec))); });
  }
  changed_.notify_all();
  return started.get_future().get();
}

void SlowFsync::Answer() const {
  std::vector<Asked> waiting;
  while (true) {
    int patience_ms = -1;
    for (const Asked& asked : waiting) {
      const auto left = std::chrono::ceil<std::chrono::milliseconds>(asked.due - AnswerClock::now());
      const int left_ms = static_cast<int>(std::max<std::int64_t>(left.count(), 0));
      patience_ms = patience_ms < 0 ? left_ms : std::min(patience_ms, left_ms);
    }
    std::array<pollfd, 2> ready{
        {{.fd = listener_, .events = POLLIN, .revents = 0}, {.fd = end_, .events = POLLIN, .revents = 0}}};
    (void)poll(ready.data(), ready.size(), patience_ms);
    if (ready[1].revents != 0) return;
    if ((ready[0].revents & POLLIN) != 0) {
      seccomp_notif question{};
      const std::chrono::milliseconds delay = delay_;
      if (ioctl(listener_, SECCOMP_IOCTL_NOTIF_RECV, &question) == 0) {
        if (delay.count() > 0) ++delayed_;
        waiting.push_back({question.id, AnswerClock::now() + delay});
      }
    }
    const AnswerClock::time_point now = AnswerClock::now();
    std::erase_if(waiting, [&](const Asked& asked) {
      if (asked.due > now) return false;
      LetGoOn(listener_, asked.id);
      return true;
    });
  }
}

}  // namespace tessera::bench
