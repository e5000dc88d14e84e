#include "region_worker/core/client_map.h"

#include <string>

#include "core/world/partition_io.h"

namespace tessera::worker {

v1::RegionMap MakeClientMap(const PartitionMap& map, const v1::RegionAddress& self,
                            std::span<const PeerAddress> peers) {
  v1::RegionMap message;
  *message.mutable_map() = ToProto(map);
  const auto add = [&](std::uint32_t region, std::uint64_t incarnation, const std::string& host, std::uint32_t port) {
    v1::RegionEndpoint& endpoint = *message.add_endpoints();
    endpoint.set_region(region);
    endpoint.set_incarnation(incarnation);
    endpoint.set_host(host);
    endpoint.set_game_port(port);
  };
  add(self.region(), self.incarnation(), self.host(), self.game_port());
  for (const PeerAddress& peer : peers) {
    if (peer.game_port == 0 || peer.region.value() == self.region()) continue;
    add(peer.region.value(), peer.incarnation.value(), peer.host, peer.game_port);
  }
  return message;
}

}  // namespace tessera::worker
