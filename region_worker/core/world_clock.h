// WorldClock: whether the region may step by the terms of its world, and how fast.
//
// A pause is part of a map: every region has stepped to the same tick when that is in force, and steps no more. The
// end of a pause needs no tick, since nobody is beyond that one: each region goes on when an order says so, or when the
// frame of a neighbour shows that it has gone on, and those who hear of it first wait for the others' frames. A step by
// so many ticks is the end of the pause together with the map of the next one, which all know of by then.
//
// A faster pace counts as soon as its map is committed, so that leaving slow motion does not take twenty slow ticks.
//
// Thread rule: none of its own.
#pragma once

#include <algorithm>
#include <cstdint>

#include "core/world/partition_map.h"

namespace tessera::worker {

// As clients are told.
struct ClockState {
  bool paused = false;
  double ticks_per_second = 0;
  friend bool operator==(const ClockState&, const ClockState&) = default;
};

class WorldClock {
 public:
  explicit WorldClock(std::uint32_t tick_rate_hz)
      : tick_rate_hz_(tick_rate_hz), state_{.paused = false, .ticks_per_second = static_cast<double>(tick_rate_hz)} {}

  // The pause by the map of this version, and any before it, is over.
  void Resume(MapVersion version) { resumed_ = std::max(resumed_, version); }
  // By the map in force and the one that is committed to be next, null without one. True if anything has changed.
  bool Follow(const PartitionMap& map, const PartitionMap* committed) {
    const WorldTerms& terms = map.terms();
    ClockState now{.paused = terms.paused && map.version() > resumed_, .ticks_per_second = PaceOf(terms)};
    if (committed != nullptr) now.ticks_per_second = std::max(now.ticks_per_second, PaceOf(committed->terms()));
    const bool changed = now != state_;
    state_ = now;
    return changed;
  }

  bool paused() const { return state_.paused; }
  const ClockState& state() const { return state_; }

 private:
  double PaceOf(const WorldTerms& terms) const {
    const auto rate = static_cast<double>(tick_rate_hz_);
    return terms.ticks_per_second > 0 ? std::min(terms.ticks_per_second, rate) : rate;
  }

  std::uint32_t tick_rate_hz_;
  MapVersion resumed_;
  ClockState state_;
};

}  // namespace tessera::worker
