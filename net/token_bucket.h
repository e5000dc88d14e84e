// TokenBucket: whether something may happen once more, at a rate.
//
//   if (!bucket.Take(now, {.per_s = 10, .burst = 20})) refuse;
//
// It begins full. Thread rule: one thread; time comes in.
#pragma once

#include <algorithm>
#include <chrono>

namespace tessera::net {

struct Rate {
  double per_s = 0, burst = 0;
};

class TokenBucket {
 public:
  using TimePoint = std::chrono::steady_clock::time_point;

  // Takes nothing where there is less than `amount`.
  bool Take(TimePoint now, const Rate& rate, double amount = 1) {
    Fill(now, rate);
    if (left_ < amount) return false;
    left_ -= amount;
    return true;
  }
  // Requires the time of the call before, or a later one; an earlier one adds nothing.
  void Fill(TimePoint now, const Rate& rate) {
    const double gained = std::chrono::duration<double>(now - since_).count() * rate.per_s;
    left_ = since_ == TimePoint() ? rate.burst : std::min(rate.burst, left_ + std::max(gained, 0.0));
    since_ = std::max(since_, now);
  }
  double left() const { return left_; }  // at the last call
  void Spend(double amount) { left_ -= amount; }

 private:
  double left_ = 0;
  TimePoint since_{};
};

}  // namespace tessera::net
