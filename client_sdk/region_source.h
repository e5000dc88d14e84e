// RegionSource: the one region that sends a client something large, while all regions could. If it dies or falls
// silent, the next one is asked to go on.
//
//   if (source.Choose(now, welcomed, preferred)) ...   // once a poll
//   if (source.is(region)) source.Heard(now);          // a part came
//
// Promise: the regions are asked in the order of their ids, in a circle, so each of them is tried.
// Pure: time comes in. Thread rule: one thread at a time.
#pragma once

#include <algorithm>
#include <chrono>
#include <optional>
#include <span>

#include "core/world/ids.h"

namespace tessera::client {

class RegionSource {
 public:
  using TimePoint = std::chrono::steady_clock::time_point;

  // A region that has sent nothing for so long is asked no more while there is another.
  static constexpr std::chrono::milliseconds kPatience{2000};

  bool is(RegionId region) const { return region_ == region; }
  void Heard(TimePoint now) { heard_at_ = now; }
  // `welcomed`: those that could send it, ascending. `preferred`: begins, if it is among them. True: the one that sent
  // until now is still there, and silent.
  bool Choose(TimePoint now, std::span<const RegionId> welcomed, std::optional<RegionId> preferred = std::nullopt) {
    const auto could = [&](RegionId region) { return std::ranges::binary_search(welcomed, region); };
    const bool there = region_ && could(*region_);
    if (there && now - heard_at_ < kPatience) return false;
    if (!region_ && preferred && could(*preferred)) {
      region_ = preferred;
    } else {
      const auto next = region_ ? std::ranges::upper_bound(welcomed, *region_) : welcomed.begin();
      region_ = welcomed.empty() ? std::nullopt : std::optional(next == welcomed.end() ? welcomed.front() : *next);
    }
    heard_at_ = now;
    return there;
  }

 private:
  std::optional<RegionId> region_;
  TimePoint heard_at_{};
};

}  // namespace tessera::client
