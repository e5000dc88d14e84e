// CommandLimit: how many new commands, and bytes of them, a region takes from one client: a token bucket for each.
//
//   if (!limit.Take(now, command.size())) refuse;
//
// Thread rule: one thread; time comes in.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstddef>

#include "region_worker/core/time.h"

namespace tessera::worker {

class CommandLimit {
 public:
  // More than a person gives; each may cost a callback of a game, and its bytes go to the standby.
  static constexpr double kCommands_per_s = 20, kBytes_per_s = 4096;
  static constexpr double kBurstCommands = 40, kBurstBytes = 8192;

  bool Take(TimePoint now, std::size_t bytes) {
    const double passed_s = std::max(0.0, std::chrono::duration<double>(now - at_).count());
    at_ = std::max(at_, now);
    commands_ = std::min(kBurstCommands, commands_ + passed_s * kCommands_per_s);
    bytes_ = std::min(kBurstBytes, bytes_ + passed_s * kBytes_per_s);
    if (commands_ < 1 || bytes_ < static_cast<double>(bytes)) return false;
    commands_ -= 1;
    bytes_ -= static_cast<double>(bytes);
    return true;
  }

 private:
  TimePoint at_{};
  double commands_ = kBurstCommands, bytes_ = kBurstBytes;
};

}  // namespace tessera::worker
