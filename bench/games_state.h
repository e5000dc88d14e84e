// Scene `state` of the suite `games`: a region dies again and again during a match, and afterwards all is there that
// clients had been told.
#pragma once

#include <cstdint>

#include "bench/report.h"

namespace tessera::bench {

struct StateFigures {
  std::uint64_t deaths = 0;
  // That a client had been told of, and that was gone after the next death; a removed body that came back counts too.
  std::uint64_t properties_lost = 0, spawns_lost = 0, removals_lost = 0, events_lost = 0;
  std::uint64_t told_spawns = 0, told_removals = 0, told_events = 0;
  std::uint64_t lost() const { return properties_lost + spawns_lost + removals_lost + events_lost; }
};

// Throws if the game or a failover fails.
StateFigures PlayThroughDeaths(std::uint64_t deaths);

void MeasureState(Report& report);

}  // namespace tessera::bench
