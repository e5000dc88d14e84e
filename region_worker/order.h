// Order: what a worker is to be, checked. The plain form of tessera.v1.WorkerOrder.
//
// An order is a whole state, not a command: the worker compares it with what it is and does the difference. A field
// that is not known yet is empty and comes with a later revision.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "core/world/partition_map.h"
#include "net/connect_token.h"
#include "region_worker/worker_options.h"
#include "tessera/v1/worker_link.pb.h"

namespace tessera::worker {

struct PeerAddress {
  RegionId region;
  Incarnation incarnation;
  std::string host;
  std::uint16_t link_port = 0;
  friend bool operator==(const PeerAddress&, const PeerAddress&) = default;
};

struct OrderedPlayer {
  PlayerNumber number;
  RegionId spawn_region{};  // makes its body; RegionId(): the scene has none
  bool left = false;
};

struct Order {
  std::uint64_t revision = 0;
  std::string scene_path, scene_hash;
  std::optional<PartitionMap> map;
  std::optional<net::InstanceKey> key;
  std::vector<PeerAddress> peers;
  std::vector<OrderedPlayer> players;
  bool run = false, stop = false;
  std::uint32_t snapshot_rate_hz = 30;
};

// Errors: FAILED_PRECONDITION if it is not meant for `self`, INVALID_ARGUMENT naming the field.
absl::StatusOr<Order> CheckOrder(const v1::WorkerOrder& message, const Identity& self);

}  // namespace tessera::worker
