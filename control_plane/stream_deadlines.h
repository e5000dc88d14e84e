// StreamDeadlines: streams from which a message is due, such as the one that says who somebody is: few at a time, and
// not for long.
//
//   auto waiting = deadlines.Begin([context] { context->TryCancel(); });
//   if (!waiting) return too many;
//   stream->Read(&hello);
//   const bool in_time = waiting->End();
//
// Thread rule: any thread. `cancel` is called from a thread of its own, and not after End or destruction.
#pragma once

#include <chrono>
#include <condition_variable>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <thread>

namespace tessera::control {

class StreamDeadlines {
 public:
  class Waiting {
   public:
    Waiting(StreamDeadlines& deadlines, std::uint64_t number) : deadlines_(deadlines), number_(number) {}
    ~Waiting() { End(); }
    Waiting(const Waiting&) = delete;
    Waiting& operator=(const Waiting&) = delete;
    // False: the time was over first, and the stream was cancelled.
    bool End();

   private:
    StreamDeadlines& deadlines_;
    std::uint64_t number_;
    bool ended_ = false, in_time_ = false;
  };

  StreamDeadlines(std::chrono::milliseconds patience, std::size_t most);
  ~StreamDeadlines();

  // Null: `most` wait already.
  std::unique_ptr<Waiting> Begin(std::function<void()> cancel);

 private:
  using Clock = std::chrono::steady_clock;
  struct Stream {
    Clock::time_point until;
    std::function<void()> cancel;
  };
  void Run();

  const std::chrono::milliseconds patience_;
  const std::size_t most_;
  std::mutex mutex_;  // guards what follows
  std::condition_variable changed_;
  std::map<std::uint64_t, Stream> streams_;  // ascending, so the first is due first
  std::uint64_t last_ = 0;
  bool ending_ = false;
  std::thread thread_;
};

}  // namespace tessera::control
