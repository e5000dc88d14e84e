// A world at rest: when a suite that kills and moves may strike next. Pure; any thread.
//
//   SteadyFor steady(kFollowed);
//   while (!steady.Take(IsAtRest(run.Latest(), 4), Clock::now())) ...
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>

#include "tessera/v1/instance.pb.h"

namespace tessera::bench {

// So long every region's standby has followed it before a suite strikes: a report of each comes in that time.
inline constexpr std::chrono::seconds kFollowed{1};

// The world runs with so many regions, all by one map, each with a standby on another host that has acknowledged a
// tick, and nothing is being changed.
bool IsAtRest(const v1::Instance& instance, std::uint32_t regions);

// No host carries two regions more than another one that carries any.
bool IsSpreadEvenly(const v1::Instance& instance);

// Reports when something has held without a break for `span`.
class SteadyFor {
 public:
  using TimePoint = std::chrono::steady_clock::time_point;

  explicit SteadyFor(std::chrono::steady_clock::duration span) : span_(span) {}

  // `holds`: at `now`, which never goes back.
  bool Take(bool holds, TimePoint now) {
    if (!holds) {
      since_.reset();
      return false;
    }
    if (!since_) since_ = now;
    return now - *since_ >= span_;
  }

 private:
  std::chrono::steady_clock::duration span_;
  std::optional<TimePoint> since_;
};

}  // namespace tessera::bench
