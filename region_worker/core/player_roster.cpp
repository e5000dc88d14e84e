#include "region_worker/core/player_roster.h"

#include <algorithm>

#include "absl/strings/str_cat.h"

namespace tessera::worker {

void PlayerRoster::Set(std::span<const OrderedPlayer> players, bool joins, region::Region& region, Actions& actions) {
  named_.clear();
  for (const OrderedPlayer& player : players) {
    named_.insert(player.number);
    newest_named_ = std::max(newest_named_, player.number);
    region.ParkPlayer(player.number, player.parked);
    if (player.left) {
      if (left_.insert(player.number).second) actions.emplace_back(ExpelPlayer{player.number, player.ended_because});
      continue;
    }
    net::Generation& generation = generations_[player.number];
    if (generation != net::Generation() && player.generation > generation) {
      actions.emplace_back(ReplacePlayer{player.number, player.generation});
    }
    generation = std::max(generation, player.generation);
    const bool makes_body = players_have_bodies_ && player.spawn_region == region.id();
    if (!makes_body || !asked_to_spawn_.insert(player.number).second) continue;
    if (joins) {
      region.MarkSpawned(player.number);
      continue;
    }
    LogInfo(actions, absl::StrCat("spawn player=", player.number.value()));
    region.SpawnPlayer(player.number, player.name, player.properties);
    spawning_.push_back(player.number);
  }
  const auto forgotten = [this](PlayerNumber player) { return !named_.contains(player); };
  std::erase_if(left_, forgotten);
  std::erase_if(asked_to_spawn_, forgotten);
  std::erase_if(generations_, [&](const auto& known) { return forgotten(known.first); });
}

bool PlayerRoster::HasLeft(PlayerNumber player) const {
  return left_.contains(player) || (player <= newest_named_ && !named_.contains(player));
}

void PlayerRoster::RemoveLeft(region::Region& region) const {
  for (const region::OwnedBody& body : region::PlayersAmong(region.owned())) {
    if (HasLeft(PlayerOf(body.def->id))) region.RemovePlayer(PlayerOf(body.def->id));
  }
}

void PlayerRoster::CountSpawned(const region::Region& region) {
  spawned_ += std::erase_if(spawning_, [&](PlayerNumber player) { return region.Owns(PlayerBodyId(player)); });
}

}  // namespace tessera::worker
