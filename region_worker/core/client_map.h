// The map that clients get: the cells of each region, and the endpoints at which regions accept clients.
//
// Thread rule: a free function on values.
#pragma once

#include <span>

#include "core/world/partition_map.h"
#include "region_worker/core/peer_address.h"
#include "tessera/v1/game.pb.h"
#include "tessera/v1/worker_link.pb.h"

namespace tessera::worker {

// `self`: the address of the region that sends it. Peers without a game port are left out.
v1::RegionMap MakeClientMap(const PartitionMap& map, const v1::RegionAddress& self, std::span<const PeerAddress> peers);

}  // namespace tessera::worker
