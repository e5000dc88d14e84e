// Deaths, restarts and players of a LockstepWorld.
#include <algorithm>
#include <array>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/game/player_record.h"
#include "core/region/catalog.h"
#include "core/region/inventory.h"
#include "core/region/log.h"
#include "core/region/region_state.h"
#include "core/region/resolve.h"
#include "core/world/partition_change.h"
#include "core/world/player_name.h"
#include "game_sdk/testing/lockstep_world.h"

namespace tessera::game {
namespace {

using region::RegionState;
using region::StandbyCopy;
using region::StepResult;

std::vector<const StandbyCopy*> CopyOf(RegionId dead, const std::map<RegionId, StandbyCopy>& copies) {
  const auto found = copies.find(dead);
  return found == copies.end() ? std::vector<const StandbyCopy*>() : std::vector<const StandbyCopy*>{&found->second};
}

}  // namespace

absl::Status LockstepWorld::Kill(RegionId region) {
  if (!regions_.contains(region)) return absl::NotFoundError(absl::StrCat("region ", region.value(), " does not live"));
  ++deaths_;
  // Nobody can carry it on: it is the last one, or has not made a tick yet.
  const auto standby = regions_.find(map_.Find(region)->standby);
  const bool copied = standby != regions_.end() && standby->second.copies.contains(region) &&
                      standby->second.copies.at(region).tick() == tick();
  return copied ? Fail(region) : Restart([](RegionState&) {});
}

absl::Status LockstepWorld::Place(BodyId body, absl::FunctionRef<void(BodyState&)> change) {
  if (OwnerOf(body) == RegionId()) {
    return absl::NotFoundError(absl::StrCat("body ", body.value(), " is no body that moves"));
  }
  return Restart([&](RegionState& whole) {
    for (region::StateBody& entry : whole.bodies) {
      if (entry.id != body) continue;
      change(entry.state);
      entry.state.asleep = false;
      entry.state.still_s = 0;
      entry.state.angular_momentum = {};
    }
  });
}

absl::Status LockstepWorld::Restart(absl::FunctionRef<void(RegionState&)> change) {
  std::vector<RegionState> states;
  for (const auto& [id, member] : regions_) {
    absl::StatusOr<RegionState> state = region::DecodeState(member.region->SaveState(), member.region->catalog());
    if (!state.ok()) return state.status();
    states.push_back(*std::move(state));
  }
  absl::StatusOr<RegionState> whole = region::MergeStates(states);
  if (!whole.ok()) return whole.status();
  change(*whole);
  const region::Catalog& catalog = regions_.begin()->second.region->catalog();
  if (absl::Status status = region::CheckRegionState(*whole, catalog); !status.ok()) return status;
  return Begin(std::make_shared<const RegionState>(*std::move(whole)));
}

void LockstepWorld::AssignStandbys() {
  std::vector<MapRegion> regions(map_.regions().begin(), map_.regions().end());
  for (std::size_t i = 0; i < regions.size() && regions.size() > 1; ++i) {
    if (regions[i].standby == RegionId()) regions[i].standby = regions[(i + 1) % regions.size()].id;
  }
  map_ = *PartitionMap::Create(map_.version(), map_.bounds(), {map_.cells().begin(), map_.cells().end()},
                               std::move(regions));
}

absl::Status LockstepWorld::Fail(RegionId dead) {
  regions_.erase(dead);
  const std::array<RegionId, 1> all_dead{dead};
  absl::StatusOr<PartitionMap> map = FailoverMap(map_, all_dead, MapVersion(map_.version().value() + 1));
  if (!map.ok()) return map.status();
  map_ = *std::move(map);
  AssignStandbys();
  std::vector<region::Inventory> inventories;
  for (auto& [id, member] : regions_) {
    absl::StatusOr<region::Inventory> inventory = member.region->BeginFailover(map_, CopyOf(dead, member.copies));
    if (!inventory.ok()) return inventory.status();
    inventories.push_back(*std::move(inventory));
  }
  const absl::StatusOr<region::Resolution> resolution = region::Resolve(map_, all_dead, inventories);
  if (!resolution.ok()) return resolution.status();
  std::vector<std::pair<RegionId, StepResult>> results;
  for (auto& [id, member] : regions_) {
    Protect(member);
    absl::StatusOr<StepResult> result = member.region->Resume(*resolution, CopyOf(dead, member.copies));
    if (!result.ok()) return result.status();
    results.emplace_back(id, *std::move(result));
    member.copies.erase(dead);
  }
  for (const auto& [id, result] : results) {
    if (absl::Status status = Distribute(id, result); !status.ok()) return status;
  }
  return absl::OkStatus();
}

absl::Status LockstepWorld::Disturb() {
  const auto drawn = [this] {
    auto at = regions_.begin();
    std::advance(at, random_() % regions_.size());
    return at;
  };
  if (random_() % kTicksOfAState == 0) {
    const WatchScope scope(module_, *this);
    if (absl::Status status = drawn()->second.host->Renew(); !status.ok()) return status;
  }
  return random_() % kTicksOfALife == 0 ? Kill(drawn()->first) : absl::OkStatus();
}

// --- Players

absl::StatusOr<PlayerNumber> LockstepWorld::Join(const std::string& name) {
  if (!scene_->player.has_value()) return absl::FailedPreconditionError("the scene has no players");
  if (absl::Status status = CheckPlayerName(name); !status.ok()) return status;
  joining_.emplace_back(PlayerNumber(++players_), name);
  return joining_.back().first;
}

void LockstepWorld::Leave(PlayerNumber player) {
  for (auto& [id, member] : regions_) member.region->RemovePlayer(player);
}

absl::Status LockstepWorld::Command(PlayerNumber player, std::string bytes) {
  const bool comes =
      std::ranges::find(joining_, player, &std::pair<PlayerNumber, std::string>::first) != joining_.end();
  if (!comes && OwnerOf(PlayerBodyId(player)) == RegionId()) {
    return absl::NotFoundError(absl::StrCat("player ", player.value(), " has no body"));
  }
  if (bytes.size() > kMaxCommandBytes) {
    return absl::InvalidArgumentError(absl::StrCat("bytes: ", bytes.size(), " are more than ", kMaxCommandBytes));
  }
  talks_[player].commands.push_back(std::move(bytes));
  return absl::OkStatus();
}

// In order; those that a region does not take now go again in the next tick.
void LockstepWorld::GiveCommands() {
  for (auto& [player, talk] : talks_) {
    const auto owner = regions_.find(OwnerOf(PlayerBodyId(player)));
    while (owner != regions_.end() && !talk.commands.empty()) {
      const std::uint32_t number = talk.last_command + 1;
      const absl::Status status = owner->second.region->TakeCommand(player, {number, number, talk.commands.front()});
      if (absl::IsNotFound(status) || absl::IsResourceExhausted(status)) break;
      talk.commands.pop_front();
      ++talk.last_command;
    }
  }
}

void LockstepWorld::HearGame() {
  for (const auto& [id, member] : regions_) {
    for (const region::OwnedBody& body : region::PlayersAmong(member.region->owned())) {
      const PlayerNumber player = PlayerOf(body.def->id);
      const PlayerRecord* const said = member.region->TalkOf(player);
      if (said == nullptr || said->events.empty()) continue;
      Talk& talk = talks_[player];
      std::uint32_t number = said->first_event();
      for (const PlayerEvent& event : said->events) {
        if (number++ <= talk.last_event) continue;
        talk.events.push_back({event.name, DecodeFields(event.values).value_or(GameFields())});
      }
      talk.last_event = said->last_event;
      member.region->AcknowledgeEvents(player, talk.last_event);
    }
    for (region::EndedPlayer& ended : member.region->ended_players()) {
      if (ended_.try_emplace(ended.player, ended.reason).second) Leave(ended.player);
    }
  }
}

std::vector<LockstepWorld::Event> LockstepWorld::TakeEvents(PlayerNumber player) {
  return std::exchange(talks_[player].events, {});
}

const std::string* LockstepWorld::EndedBecause(PlayerNumber player) const {
  const auto ended = ended_.find(player);
  return ended == ended_.end() ? nullptr : &ended->second;
}

absl::Status LockstepWorld::Input(PlayerNumber player, PlayerInput input) {
  const auto owner = regions_.find(OwnerOf(PlayerBodyId(player)));
  if (owner == regions_.end()) return absl::NotFoundError(absl::StrCat("player ", player.value(), " has no body"));
  input.number = ++inputs_[player];
  input.player = player;
  input.body = PlayerBodyId(player);
  return owner->second.region->QueueInput(AsSent(input));
}

}  // namespace tessera::game
