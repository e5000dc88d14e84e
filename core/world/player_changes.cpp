#include "core/world/player_changes.h"

#include <algorithm>
#include <utility>

namespace tessera {
namespace {

using PlayerList = google::protobuf::RepeatedPtrField<v1::Player>;
using NumberList = google::protobuf::RepeatedField<std::uint32_t>;

auto PlaceOfPlayer(PlayerList& players, std::uint32_t number) {
  return std::lower_bound(players.begin(), players.end(), number,
                          [](const v1::Player& player, std::uint32_t wanted) { return player.number() < wanted; });
}

void PutPlayer(v1::Player& player, PlayerList& players) {
  const auto place = PlaceOfPlayer(players, player.number());
  if (place != players.end() && place->number() == player.number()) return place->Swap(&player);
  const auto at = place - players.begin();
  players.Add()->Swap(&player);
  for (int i = players.size() - 1; i > at; --i) players.SwapElements(i, i - 1);
}

void ErasePlayer(std::uint32_t number, PlayerList& players) {
  const auto place = PlaceOfPlayer(players, number);
  if (place != players.end() && place->number() == number) players.erase(place);
}

void EraseNumber(std::uint32_t number, NumberList& numbers) {
  const auto place = std::lower_bound(numbers.begin(), numbers.end(), number);
  if (place != numbers.end() && *place == number) numbers.erase(place);
}

}  // namespace

bool Continues(const v1::WorkerOrder& before, const v1::WorkerOrder& next) {
  return next.players_since() == 0 || next.players_since() == before.revision();
}

void CompletePlayers(v1::WorkerOrder before, v1::WorkerOrder& next) {
  if (next.players_since() == 0) return;
  PlayerList& players = *before.mutable_players();
  NumberList& forgotten = *before.mutable_players_forgotten();
  for (v1::Player& player : *next.mutable_players()) {
    EraseNumber(player.number(), forgotten);
    PutPlayer(player, players);
  }
  for (const std::uint32_t number : next.players_forgotten()) ErasePlayer(number, players);
  if (before.players_since() != 0) {  // else nobody who is forgotten is named
    forgotten.MergeFrom(next.players_forgotten());
    std::sort(forgotten.begin(), forgotten.end());
  }
  next.mutable_players()->Swap(&players);
  next.mutable_players_forgotten()->Swap(&forgotten);
  next.set_players_since(before.players_since());
}

}  // namespace tessera
