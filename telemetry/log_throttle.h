// LogThrottle: how often a line of one kind may be logged, where whoever sends us something decides how often there is
// cause for it.
//
//   if (const auto left_out = throttle.Take(Clock::now())) spdlog::warn("refused ... more={}", *left_out);
//
// At most kLinesPerSecond pass in any second that begins with one that passes. Thread rule: any thread.
#pragma once

#include <chrono>
#include <cstdint>
#include <mutex>
#include <optional>

namespace tessera::telemetry {

class LogThrottle {
 public:
  using Clock = std::chrono::steady_clock;
  // So few fill no disk: 150 MB a day. Fewer, and a few people who come at once are not all seen.
  static constexpr int kLinesPerSecond = 10;

  // Nothing: this one is left out. Else it may be logged, and so many were left out since the last that was.
  std::optional<std::uint64_t> Take(Clock::time_point now);

 private:
  std::mutex mutex_;  // guards what follows
  std::optional<Clock::time_point> second_;
  int passed_ = 0;  // in that second
  std::uint64_t left_out_ = 0;
};

}  // namespace tessera::telemetry
