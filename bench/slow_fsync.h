// SlowFsync: programs whose fsync and fdatasync take longer than their disk needs, by as much as is wanted and for as
// long. The kernel asks this process before each of them (seccomp's user notification), and the thread that called it
// waits for the answer, as it waits for a slow disk; no other thread of the program does.
//
//   auto slow = SlowFsync::Begin();
//   auto etcd = (*slow)->Start({.argv = {"/usr/bin/etcd", ...}, .log_path = log});
//   (*slow)->SetDelay(100ms);
//
// Its programs, and all that they start, end before it: the kernel refuses their calls after. Thread rule: one thread
// starts programs; `SetDelay` and `delayed` from any.
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <thread>

#include "absl/status/statusor.h"
#include "host/child_process.h"

namespace tessera::bench {

class SlowFsync {
 public:
  // UNAVAILABLE where the kernel does not ask.
  static absl::StatusOr<std::unique_ptr<SlowFsync>> Begin();
  ~SlowFsync();
  SlowFsync(const SlowFsync&) = delete;
  SlowFsync& operator=(const SlowFsync&) = delete;

  // Errors as of host::ChildProcess::Start.
  absl::StatusOr<host::ChildProcess> Start(host::ProcessSpec spec);
  // Each call that begins from here on takes so much longer; 0, as in the beginning: as long as the disk needs.
  void SetDelay(std::chrono::milliseconds delay) { delay_ = delay; }
  // Calls that were made to wait so far.
  std::uint64_t delayed() const { return delayed_; }

 private:
  SlowFsync() = default;
  void StartPrograms(const std::function<void(int)>& tell);
  void Answer() const;

  std::atomic<std::chrono::milliseconds> delay_{std::chrono::milliseconds(0)};
  mutable std::atomic<std::uint64_t> delayed_{0};
  int listener_ = -1, end_ = -1;
  std::mutex mutex_;  // guards what follows
  std::condition_variable changed_;
  std::deque<std::function<void()>> starts_;
  bool ended_ = false;
  std::thread starter_, answerer_;  // the kernel asks of what the starter starts, and of nobody else
};

}  // namespace tessera::bench
