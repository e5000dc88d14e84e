// Deaths, restarts and players of a LockstepWorld.
#include <array>

#include "absl/strings/str_cat.h"
#include "core/region/catalog.h"
#include "core/region/inventory.h"
#include "core/region/log.h"
#include "core/region/region_state.h"
#include "core/region/resolve.h"
#include "core/world/partition_change.h"
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

absl::StatusOr<PlayerNumber> LockstepWorld::Join() {
  if (!scene_->player.has_value()) return absl::FailedPreconditionError("the scene has no players");
  joining_.emplace_back(++players_);
  return joining_.back();
}

void LockstepWorld::Leave(PlayerNumber player) {
  for (auto& [id, member] : regions_) member.region->RemovePlayer(player);
}

absl::Status LockstepWorld::Input(PlayerNumber player, Vec3f force_n, Vec3f torque_nm) {
  const auto owner = regions_.find(OwnerOf(PlayerBodyId(player)));
  if (owner == regions_.end()) return absl::NotFoundError(absl::StrCat("player ", player.value(), " has no body"));
  PlayerInput input;
  input.number = ++inputs_[player];
  input.player = player;
  input.body = PlayerBodyId(player);
  input.force_n = force_n;
  input.torque_nm = torque_nm;
  return owner->second.region->QueueInput(input);
}

}  // namespace tessera::game
