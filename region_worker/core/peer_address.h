// PeerAddress: where the worker of a region is.
#pragma once

#include <cstdint>
#include <string>

#include "core/world/ids.h"

namespace tessera::worker {

struct PeerAddress {
  RegionId region;
  Incarnation incarnation;
  std::string host;
  std::uint16_t link_port = 0, game_port = 0;
  friend bool operator==(const PeerAddress&, const PeerAddress&) = default;
};

}  // namespace tessera::worker
