#include "region_worker/core/player_roster.h"

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"

namespace tessera::worker {

void PlayerRoster::Set(std::span<const OrderedPlayer> players, bool joins, region::Region& region, Actions& actions) {
  std::vector<Known> next;
  next.reserve(players.size());
  auto before = known_.begin();
  for (const OrderedPlayer& player : players) {
    while (before != known_.end() && before->number < player.number) ++before;  // named no more
    const bool known = before != known_.end() && before->number == player.number;
    next.push_back(known ? *before : Known{.number = player.number});
    Take(player, joins, next.back(), region, actions);
  }
  known_ = std::move(next);
  if (!known_.empty()) newest_named_ = std::max(newest_named_, known_.back().number);
}

void PlayerRoster::Take(const OrderedPlayer& player, bool joins, Known& known, region::Region& region,
                        Actions& actions) {
  if (std::exchange(known.parked, player.parked) != player.parked) region.ParkPlayer(player.number, player.parked);
  if (player.left) {
    if (!std::exchange(known.left, true)) actions.emplace_back(ExpelPlayer{player.number, player.ended_because});
    return;
  }
  if (known.generation != net::Generation() && player.generation > known.generation) {
    actions.emplace_back(ReplacePlayer{player.number, player.generation});
  }
  known.generation = std::max(known.generation, player.generation);
  const bool makes_body = players_have_bodies_ && player.spawn_region == region.id();
  if (!makes_body || std::exchange(known.asked_to_spawn, true)) return;
  if (joins) return region.MarkSpawned(player.number);
  LogInfo(actions, absl::StrCat("spawn player=", player.number.value()));
  region.SpawnPlayer(player.number, player.name, player.properties);
  spawning_.push_back(player.number);
}

bool PlayerRoster::HasLeft(PlayerNumber player) const {
  const auto known = std::ranges::lower_bound(known_, player, {}, &Known::number);
  if (known != known_.end() && known->number == player) return known->left;
  return player <= newest_named_;
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
