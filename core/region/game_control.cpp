#include "core/region/game_control.h"

#include <utility>
#include <vector>

#include "core/region/region_parts.h"

namespace tessera::region {

void FindDriven(RegionParts& parts) {
  std::vector<Driven> driven;
  for (const BodyId own : parts.records.steering()) {
    if (!IsPlayerBody(own)) continue;
    const BodyId body = parts.records.Find(own)->game.player->driven();
    if (body == BodyId() || parts.bodies.IndexOf(body) < 0) continue;
    const KeptRecord* const moved = parts.records.Find(body);
    if (moved != nullptr && moved->game.driver == PlayerOf(own)) driven.push_back({own, body});
  }
  parts.players.SetDriven(std::move(driven));
}

void FollowDriven(RegionParts& parts) {
  for (const Driven& one : parts.players.driven()) {
    const auto body = static_cast<std::size_t>(parts.bodies.IndexOf(one.body));
    BodyState aside;
    aside.position = parts.bodies.owned()[body].state.position;
    // It is parked, so this touches nothing.
    parts.bodies.Teleport(one.own, aside);
  }
}

}  // namespace tessera::region
