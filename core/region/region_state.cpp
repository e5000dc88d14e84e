#include "core/region/region_state.h"

#include <algorithm>
#include <set>

#include "absl/strings/str_cat.h"
#include "core/region/frame_check.h"
#include "core/region/owned_body.h"
#include "core/world/state_check.h"

namespace tessera::region {
namespace {

absl::Status Bad(const std::string& what) { return absl::InvalidArgumentError(what); }

// A player's body has a control, others have none.
absl::Status CheckControls(const RegionState& state) {
  const std::span<const StateBody> players = PlayersAmong(state.bodies, &StateBody::id);
  for (const StateBody& body : players) {
    if (!state.controls.contains(PlayerOf(body.id)))
      return Bad(absl::StrCat("body ", body.id.value(), " has no control"));
  }
  return players.size() == state.controls.size() ? absl::OkStatus() : Bad("controls: a player without a body");
}

// A callback that is off in one region is off in the world. Each region goes on with its own bodies' events.
void MergeHost(const game::HostState& other, game::HostState& host) {
  host.waiting.insert(host.waiting.end(), other.waiting.begin(), other.waiting.end());
  for (const game::FailedCallback& failed : other.failed) {
    const auto same = [&](const game::FailedCallback& one) {
      return one.callback == failed.callback && one.kind == failed.kind;
    };
    const auto known = std::ranges::find_if(host.failed, same);
    if (known == host.failed.end()) {
      host.failed.push_back(failed);
    } else {
      known->failures = std::max(known->failures, failed.failures);
      known->off = known->off || failed.off;
    }
  }
  std::ranges::sort(host.failed, {}, [](const game::FailedCallback& one) { return std::pair(one.callback, one.kind); });
}

}  // namespace

const StateBody* RegionState::Find(BodyId id) const {
  const auto it = std::lower_bound(bodies.begin(), bodies.end(), id,
                                   [](const StateBody& body, BodyId wanted) { return body.id < wanted; });
  return it != bodies.end() && it->id == id ? &*it : nullptr;
}

CarriedRecord RegionState::RecordOf(BodyId id) const {
  const auto it = records.find(id);
  return it == records.end() ? CarriedRecord() : it->second;
}

absl::Status CheckRegionState(const RegionState& state, const Catalog& catalog) {
  BodyId last;
  for (const StateBody& body : state.bodies) {
    if (body.id <= last) return Bad("bodies: ids do not ascend");
    last = body.id;
    if (absl::Status status = CheckKnown(body.id, catalog); !status.ok()) return status;
    if (body.epoch == Epoch()) return Bad(absl::StrCat("body ", body.id.value(), ": epoch 0"));
    if (absl::Status status = CheckState(body.id, body.state); !status.ok()) return status;
  }
  for (const auto& [id, changed] : state.records) {
    if (state.Find(id) == nullptr) return Bad(absl::StrCat("records: body ", id.value(), " is not there"));
    if (absl::Status status = CheckRecord(id, changed, catalog); !status.ok()) return status;
  }
  last = BodyId();
  for (const BodyClaim& tombstone : state.tombstones) {
    if (tombstone.body <= last) return Bad("tombstones: ids do not ascend");
    last = tombstone.body;
    if (absl::Status status = CheckKnown(tombstone.body, catalog); !status.ok()) return status;
    if (tombstone.epoch == Epoch()) return Bad(absl::StrCat("tombstones: body ", last.value(), ": epoch 0"));
  }
  if (absl::Status status = game::CheckHostState(state.host, catalog.scene().kinds.size()); !status.ok()) return status;
  std::uint64_t blast = 0;
  for (const KeptBlast& kept : state.blasts) {
    if (kept.blast.id <= blast) return Bad("blasts: ids do not ascend");
    blast = kept.blast.id;
    if (absl::Status status = game::CheckBlast(kept.blast); !status.ok()) return status;
  }
  return CheckControls(state);
}

absl::StatusOr<RegionState> MergeStates(std::span<const RegionState> states) {
  if (states.empty()) return Bad("no states");
  std::map<BodyId, std::pair<StateBody, const RegionState*>> bodies;
  std::set<PlayerNumber> spawned;
  std::set<TouchingPair> touching;
  std::map<BodyId, Epoch> tombstones;
  std::vector<KeptBlast> blasts;
  game::HostState host;
  for (const RegionState& state : states) {
    if (state.tick != states[0].tick) {
      return Bad(absl::StrCat("region ", state.region.value(), " is of tick ", state.tick.value(), ", region ",
                              states[0].region.value(), " of tick ", states[0].tick.value()));
    }
    for (const StateBody& body : state.bodies) {
      const auto [entry, added] = bodies.try_emplace(body.id, body, &state);
      if (!added && entry->second.first.epoch < body.epoch) entry->second = {body, &state};
    }
    blasts = MergeBlasts(blasts, state.blasts);
    MergeHost(state.host, host);
    spawned.insert(state.spawned.begin(), state.spawned.end());
    touching.insert(state.touching.begin(), state.touching.end());
    for (const BodyClaim& tombstone : state.tombstones) {
      Epoch& epoch = tombstones[tombstone.body];
      epoch = std::max(epoch, tombstone.epoch);
    }
  }
  RegionState merged;
  merged.tick = states[0].tick;
  merged.blasts = std::move(blasts);
  merged.host = std::move(host);
  // Each body has its own marks.
  for (KeptBlast& kept : merged.blasts) kept.acted = false;
  for (const auto& [id, epoch] : tombstones) merged.tombstones.push_back({id, epoch});
  merged.bodies.reserve(bodies.size());
  for (const auto& [id, entry] : bodies) {
    const auto tombstone = tombstones.find(id);
    if (tombstone != tombstones.end() && entry.first.epoch <= tombstone->second) continue;
    merged.bodies.push_back(entry.first);
    CarriedRecord record = entry.second->RecordOf(id);
    MarkSettled(entry.second->blasts, record.game);
    if (!record.empty()) merged.records.emplace(id, std::move(record));
    if (IsPlayerBody(id)) merged.controls.emplace(PlayerOf(id), entry.second->controls.at(PlayerOf(id)));
  }
  merged.spawned.assign(spawned.begin(), spawned.end());
  merged.touching.assign(touching.begin(), touching.end());
  return merged;
}

}  // namespace tessera::region
