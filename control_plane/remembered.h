// Remembered: a value that costs something to find, found anew once it is older than a second: whoever asks for it
// often, as every scraper may, costs no more than one who asks once a second.
//
//   Remembered<ClusterSummary> summary([&plane] { return plane.Call(...); });
//   const ClusterSummary now = summary.Get(std::chrono::steady_clock::now());
//
// Thread rule: any thread. One finds it while the others wait for that.
#pragma once

#include <chrono>
#include <functional>
#include <mutex>
#include <optional>
#include <utility>

namespace tessera::control {

template <class Value>
class Remembered {
 public:
  using Clock = std::chrono::steady_clock;
  // A scraper asks each few seconds, and sees nothing of it.
  static constexpr std::chrono::milliseconds kAge{1000};

  explicit Remembered(std::function<Value()> find) : find_(std::move(find)) {}

  Value Get(Clock::time_point now) {
    const std::lock_guard lock(mutex_);
    if (!value_ || now - found_at_ >= kAge) {
      value_ = find_();
      found_at_ = now;
    }
    return *value_;
  }

 private:
  std::function<Value()> find_;
  std::mutex mutex_;  // guards what follows
  std::optional<Value> value_;
  Clock::time_point found_at_{};
};

}  // namespace tessera::control
