#include "telemetry/log_throttle.h"

#include <utility>

namespace tessera::telemetry {

std::optional<std::uint64_t> LogThrottle::Take(Clock::time_point now) {
  const std::lock_guard lock(mutex_);
  if (!second_ || now - *second_ >= std::chrono::seconds(1)) {
    second_ = now;
    passed_ = 0;
  }
  if (passed_ >= kLinesPerSecond) {
    ++left_out_;
    return std::nullopt;
  }
  ++passed_;
  return std::exchange(left_out_, 0);
}

}  // namespace tessera::telemetry
