// SilentLinks: the neighbours from which nothing comes although the links to them stand.
//
// A network that breaks says nothing: the transport gives a peer up after five to ten seconds (net/endpoint.h). A
// neighbour whose border is closed asks to open it many times a second, and says that it is well while it makes no
// steps; so one that says nothing for kSilence on end is cut off, or stands still as a whole.
//
// Only time in which this process looked counts: what had come while it stood still had no chance to be heard. Once
// silent, a neighbour stays so until it is heard, or its border is open again.
//
//   if (silent.Due(now)) silent.Look(neighbours with a closed border, links, now);
//   report all links but those for which silent.Is(region, links)
//
// Changes nothing about the links themselves. Thread rule: none of its own. Time is passed in, never read.
#pragma once

#include <map>
#include <optional>
#include <span>

#include "core/world/ids.h"
#include "region_worker/core/link_table.h"
#include "region_worker/core/time.h"

namespace tessera::worker {

class SilentLinks {
 public:
  static constexpr Duration kInterval = std::chrono::milliseconds(50);
  // The time before one look counts as so much at most.
  static constexpr Duration kLongestLook = std::chrono::milliseconds(100);
  // Beyond NeighbourWatch::kSilence, after which the border is closed: a second in all. Shorter, and a process that
  // stands still for a moment has its links reported as lost and as up again; longer, and a world with a cut link is
  // called RUNNING for as long.
  static constexpr Duration kSilence = std::chrono::milliseconds(750);

  bool Due(TimePoint now) const { return now >= next_look_; }
  // `closed`: the neighbours whose border is closed.
  void Look(std::span<const RegionId> closed, const LinkTable& links, TimePoint now);
  bool Is(RegionId region, const LinkTable& links) const;

 private:
  struct Silence {
    std::optional<TimePoint> heard;  // before it
    Duration counted{0};
  };

  TimePoint looked_at_{}, next_look_{};
  std::map<RegionId, Silence> silences_;
};

}  // namespace tessera::worker
