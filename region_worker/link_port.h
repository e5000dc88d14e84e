// LinkPort: what a region's parts need of its links to other regions: RegionLinks in a worker, virtual ones in the
// simulator.
//
// Thread rule: one thread.
#pragma once

#include <cstdint>
#include <span>

#include "core/world/ids.h"
#include "net/endpoint.h"

namespace tessera::worker {

class LinkPort {
 public:
  virtual ~LinkPort() = default;

  // Changes with each new link to that region; PeerHandle() while there is none.
  virtual net::PeerHandle LinkTo(RegionId region) const = 0;
  // What is of use only at once. False: not linked, or the link takes no more.
  virtual bool SendNow(RegionId to, std::span<const std::uint8_t> message) = 0;
  // This life of the region has ended, or is taken to have ended: its link is cut, and it is let in no more.
  virtual void Outrank(RegionId region, Incarnation incarnation) = 0;
  virtual void SetMapVersion(MapVersion version) = 0;
};

}  // namespace tessera::worker
