#include "region_worker/by_hand.h"

#include <sodium.h>

#include <string_view>

namespace tessera::worker {

net::InstanceKey HandKey() {
  constexpr std::string_view kText = "tessera: the key of worlds that are run by hand";
  net::InstanceKey key{};
  crypto_generichash(key.data(), key.size(), reinterpret_cast<const unsigned char*>(kText.data()), kText.size(),
                     nullptr, 0);
  return key;
}

absl::StatusOr<Order> HandOrder(const ByHand& flags, const Scene& scene) {
  absl::StatusOr<PartitionMap> map = MakeGridMap(scene.ground(), flags.regions);
  if (!map.ok()) return map.status();
  Order order;
  order.revision = 1;
  order.map = *std::move(map);
  order.key = HandKey();
  order.snapshot_rate_hz = flags.snapshot_rate_hz;
  order.borders = flags.borders;
  for (std::uint32_t region = 1; region <= flags.regions; ++region) {
    const auto link_port = static_cast<std::uint16_t>(flags.base_port + 3 * (region - 1) + 1);
    order.peers.push_back({RegionId(region), Incarnation(1), "127.0.0.1", link_port});
  }
  return order;
}

OrderedPlayer HandPlayer(PlayerNumber number, const Scene& scene, const PartitionMap& map) {
  OrderedPlayer player{.number = number};
  if (scene.player) {
    const auto& points = scene.player->spawn_points;
    player.spawn_region = map.OwnerOf(points[(number.value() - 1) % points.size()]);
  }
  return player;
}

}  // namespace tessera::worker
