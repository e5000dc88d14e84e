// Running without a control plane: what it would have said, worked out from the flags, the same in every worker.
//
// The key is no secret: a world run by hand is for loopback and debugging.
#pragma once

#include <cstdint>

#include "absl/status/statusor.h"
#include "core/world/scene.h"
#include "net/connect_token.h"
#include "region_worker/order.h"
#include "region_worker/worker_options.h"

namespace tessera::worker {

inline constexpr char kHandInstanceId[] = "by-hand";
inline constexpr std::uint16_t kDefaultBasePort = 7900;
inline constexpr double kMaxSeconds = 1e6;

// What connect tokens for such a world are sealed with.
net::InstanceKey HandKey();

// Not yet `run`: the worker starts by itself when it is linked and its players are there.
absl::StatusOr<Order> HandOrder(const ByHand& flags, const Scene& scene);

// A player that came by itself: its body is made by the region that owns its spawn point.
OrderedPlayer HandPlayer(PlayerNumber number, const Scene& scene, const PartitionMap& map);

}  // namespace tessera::worker
