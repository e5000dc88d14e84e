// Background: what may take long (joins, orders), off the event loop.
//
//   background.Run([=] { auto joined = Join(); return [=] { Take(joined); }; });
//   loop: background.Finish();
//
// A job runs on one of a few threads; what it returns runs in `Finish`, on the caller's thread, in no order. `wake` is
// called from any thread when there is something to finish. Destruction waits for jobs under way and drops the others.
// Thread rule: one thread, which also destroys it.
#pragma once

#include <condition_variable>
#include <cstddef>
#include <deque>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

namespace tessera::gateway {

class Background {
 public:
  using Done = std::function<void()>;
  using Job = std::function<Done()>;

  Background(std::size_t threads, std::function<void()> wake);
  ~Background();
  Background(const Background&) = delete;
  Background& operator=(const Background&) = delete;

  // False: too many wait already.
  bool Run(Job job);
  void Finish();

 private:
  void Work();

  std::function<void()> wake_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Job> waiting_;
  std::vector<Done> done_;
  bool ending_ = false;
  std::vector<std::thread> threads_;
};

}  // namespace tessera::gateway
