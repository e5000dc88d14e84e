#include "control_plane/stream_deadlines.h"

#include <utility>

namespace tessera::control {

StreamDeadlines::StreamDeadlines(std::chrono::milliseconds patience, std::size_t most)
    : patience_(patience), most_(most) {}

StreamDeadlines::~StreamDeadlines() {
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
  }
  changed_.notify_all();
  if (thread_.joinable()) thread_.join();
}

std::unique_ptr<StreamDeadlines::Waiting> StreamDeadlines::Begin(std::function<void()> cancel) {
  const std::lock_guard lock(mutex_);
  if (streams_.size() >= most_) return nullptr;
  const std::uint64_t number = ++last_;
  streams_.emplace(number, Stream{Clock::now() + patience_, std::move(cancel)});
  if (!thread_.joinable()) thread_ = std::thread([this] { Run(); });  // most doors never need it
  changed_.notify_all();
  return std::make_unique<Waiting>(*this, number);
}

bool StreamDeadlines::Waiting::End() {
  if (std::exchange(ended_, true)) return in_time_;
  const std::lock_guard lock(deadlines_.mutex_);
  in_time_ = deadlines_.streams_.erase(number_) > 0;
  return in_time_;
}

void StreamDeadlines::Run() {
  std::unique_lock lock(mutex_);
  while (!ending_) {
    if (streams_.empty()) {
      changed_.wait(lock);
    } else if (const auto first = streams_.begin(); first->second.until > Clock::now()) {
      // A copy: the stream may end meanwhile, and the time that is waited for is read again thereafter.
      const Clock::time_point until = first->second.until;
      changed_.wait_until(lock, until);
    } else {
      // Under the lock, so that whoever ends it meanwhile waits, and the call's context is still there.
      first->second.cancel();
      streams_.erase(first);
    }
  }
}

}  // namespace tessera::control
