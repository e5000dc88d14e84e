#include "region_worker/order.h"

#include "absl/strings/str_cat.h"
#include "core/world/limits.h"
#include "core/world/partition_io.h"

namespace tessera::worker {
namespace {

constexpr std::uint32_t kDefaultSnapshotRateHz = 30;

absl::Status CheckAddressee(const v1::WorkerOrder& message, const Identity& self) {
  if (message.instance_id() == self.instance_id && message.region() == self.region.value() &&
      message.incarnation() == self.incarnation.value()) {
    return absl::OkStatus();
  }
  return absl::FailedPreconditionError(absl::StrCat("order for instance ", message.instance_id(), " region ",
                                                    message.region(), " incarnation ", message.incarnation(),
                                                    ", not for this worker"));
}

absl::Status ReadPeers(const v1::WorkerOrder& message, Order& order) {
  for (int i = 0; i < message.peers_size(); ++i) {
    const v1::RegionAddress& peer = message.peers(i);
    if (peer.region() == 0 || peer.region() > kMaxRegions) {
      return absl::InvalidArgumentError(absl::StrCat("peers[", i, "].region: ", peer.region()));
    }
    if (peer.link_port() == 0 || peer.link_port() > 65535) {
      return absl::InvalidArgumentError(absl::StrCat("peers[", i, "].link_port: ", peer.link_port()));
    }
    order.peers.push_back({RegionId(peer.region()), Incarnation(peer.incarnation()), peer.host(),
                           static_cast<std::uint16_t>(peer.link_port())});
  }
  return absl::OkStatus();
}

absl::Status ReadPlayers(const v1::WorkerOrder& message, Order& order) {
  for (int i = 0; i < message.players_size(); ++i) {
    const v1::Player& player = message.players(i);
    if (player.number() == 0) return absl::InvalidArgumentError(absl::StrCat("players[", i, "].number: 0"));
    order.players.push_back({PlayerNumber(player.number()), RegionId(player.spawn_region()), player.left()});
  }
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<Order> CheckOrder(const v1::WorkerOrder& message, const Identity& self) {
  if (absl::Status status = CheckAddressee(message, self); !status.ok()) return status;
  Order order;
  order.revision = message.revision();
  order.scene_path = message.scene_path();
  order.scene_hash = message.scene_hash();
  order.run = message.run();
  order.stop = message.stop();
  order.snapshot_rate_hz = message.snapshot_rate_hz() == 0 ? kDefaultSnapshotRateHz : message.snapshot_rate_hz();
  if (order.snapshot_rate_hz > kMaxTickRateHz) {
    return absl::InvalidArgumentError(absl::StrCat("snapshot_rate_hz: ", order.snapshot_rate_hz));
  }
  if (message.has_map()) {
    absl::StatusOr<PartitionMap> map = FromProto(message.map());
    if (!map.ok()) return absl::InvalidArgumentError(absl::StrCat("map: ", map.status().message()));
    order.map = *std::move(map);
  }
  if (!message.instance_key().empty()) {
    absl::StatusOr<net::InstanceKey> key = net::InstanceKeyFrom(message.instance_key());
    if (!key.ok()) return absl::InvalidArgumentError(absl::StrCat("instance_key: ", key.status().message()));
    order.key = *key;
  }
  if (absl::Status status = ReadPeers(message, order); !status.ok()) return status;
  if (absl::Status status = ReadPlayers(message, order); !status.ok()) return status;
  return order;
}

}  // namespace tessera::worker
