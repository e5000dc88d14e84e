// ByteBudget: how many bytes may be sent at a moment so that there are no more than a rate on average.
//
// It fills with time, up to a quarter of a second's bytes, and may be overdrawn: then nothing is left until time has
// paid for that. So over any time t it lets at most rate * (t + 0.25 s) through, and the last message. Pure: time is
// passed in. Thread rule: one thread.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <limits>
#include <optional>

namespace tessera::gateway {

class ByteBudget {
 public:
  using TimePoint = std::chrono::steady_clock::time_point;

  // From now on; before the first call there is no limit.
  void Limit(double bytes_per_s) { rate_ = bytes_per_s; }

  std::size_t Left(TimePoint now) {
    if (rate_ == kNoLimit) return std::numeric_limits<std::size_t>::max();
    const double most = rate_ * kBurst_s;
    const double since_s = last_ ? std::chrono::duration<double>(now - *last_).count() : kBurst_s;
    last_ = now;
    left_ = std::min(left_ + rate_ * std::max(since_s, 0.0), most);
    return static_cast<std::size_t>(std::max(left_, 0.0));
  }
  void Spend(std::size_t bytes) {
    if (rate_ != kNoLimit) left_ -= static_cast<double>(bytes);
  }

 private:
  static constexpr double kNoLimit = std::numeric_limits<double>::infinity();
  static constexpr double kBurst_s = 0.25;

  double rate_ = kNoLimit, left_ = 0;
  std::optional<TimePoint> last_;
};

}  // namespace tessera::gateway
