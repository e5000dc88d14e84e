#include "client_sdk/own_body.h"

#include <vector>

namespace tessera::client {

std::optional<Vec3d> OwnBody::Position(const WorldView& world, const Scene& scene) const {
  const auto own = world.bodies().find(id());
  if (own != world.bodies().end()) return own->second.state.position;
  if (spectator_view_) return spectator_view_;
  if (watches() || !scene.player) return std::nullopt;
  const std::vector<Vec3d>& spawns = scene.player->spawn_points;
  if (spawns.empty()) return std::nullopt;
  return spawns[(player_.value() - 1) % spawns.size()];
}

}  // namespace tessera::client
