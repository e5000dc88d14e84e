// EventLoop: the one thread on which an agent decides.
//
// It waits for file descriptors, for deadlines and for work posted by other threads (gRPC's), and runs one callback at
// a time, so that nothing else in the agent needs a lock.
//
//   EventLoop loop;
//   loop.Watch(pidfd, [&] { Reap(pidfd); });
//   loop.Post([&] { ... });       // from any thread
//   loop.RunAt(Clock::now() + 1s, [&] { loop.Stop(); });
//   loop.Run();
//
// Thread rule: `Post` from any thread; all else on the thread that calls `Run`. What is posted after `Stop` is dropped.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <unordered_map>
#include <utility>
#include <vector>

#include "agent/limits.h"

namespace tessera::agent {

class EventLoop {
 public:
  using Callback = std::function<void()>;
  using TimerId = std::pair<TimePoint, std::uint64_t>;

  EventLoop();
  ~EventLoop();
  EventLoop(const EventLoop&) = delete;
  EventLoop& operator=(const EventLoop&) = delete;

  void Post(Callback callback);
  // Calls back each time `fd` is readable. The caller keeps the descriptor open until `Unwatch`.
  void Watch(int fd, Callback callback);
  void Unwatch(int fd);
  TimerId RunAt(TimePoint when, Callback callback);
  void Cancel(const TimerId& timer);  // does nothing once the timer has run

  void Run();
  void Stop() { stopped_ = true; }

 private:
  void RunPosted();
  void RunTimers();
  int WaitMillis() const;

  int epoll_ = -1, wake_ = -1;
  bool stopped_ = false;
  std::uint64_t next_timer_ = 1;
  std::map<TimerId, Callback> timers_;
  std::unordered_map<int, std::shared_ptr<Callback>> watches_;
  std::mutex mutex_;  // guards the one below
  std::vector<Callback> posted_;
};

}  // namespace tessera::agent
