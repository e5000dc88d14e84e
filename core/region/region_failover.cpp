// A region's part in a failover: it halts and says what it holds; later it promotes the bodies that the resolution
// gives it, and goes on.
#include <algorithm>
#include <map>
#include <utility>

#include "core/region/failover.h"
#include "core/region/game_control.h"
#include "core/region/game_joints.h"
#include "core/region/region_map.h"
#include "core/region/region_parts.h"
#include "core/region/tick_end.h"

namespace tessera::region {
namespace {

using Copies = std::map<BodyId, KeptGrant>;

// The body is owned elsewhere, or promoted here anew; then it did not depart.
void LetGo(BodyId id, RegionId to, const Copies& promoted, RegionParts& parts, StepResult& result) {
  if (!parts.bodies.Owns(id)) return;
  const bool bodiless = parts.bodies.FindBodiless(id) != nullptr;
  const Departure departure = parts.ownership.LetGo(id, to);
  if (!promoted.contains(id) && !bodiless) result.departures.push_back(departure);
}

// Every grant that was under way from here has been settled: its body is somebody else's, or promoted here. One that
// has come back since is owned by a higher epoch.
void LetGoOfGranted(const Copies& promoted, RegionParts& parts, StepResult& result) {
  for (const auto& [key, grant] : parts.grants_out.kept()) {
    const auto& [id, epoch] = key;
    if (parts.bodies.EpochOf(id) > epoch) continue;
    LetGo(id, grant.to, promoted, parts, result);
  }
}

void Promote(const Resolution& resolution, const Copies& promoted, RegionParts& parts, StepResult& result) {
  for (const Takeover& takeover : resolution.takeovers) {
    if (takeover.region != parts.self()) LetGo(takeover.body, takeover.region, promoted, parts, result);
  }
  for (const Takeover& takeover : resolution.takeovers) {
    if (takeover.region != parts.self()) continue;
    const BodyId id = takeover.body;
    // A game that is to be told of the leave is told by the next step.
    const bool left = IsPlayerBody(id) && parts.players.HasLeft(PlayerOf(id));
    if (left && !parts.game.TakesLeave()) continue;
    const KeptGrant& copy = promoted.at(id);
    parts.ownership.Restore({id, takeover.epoch, copy.state, copy.record}, copy.control);
    parts.reports.Restore(copy.touching);
  }
}

void MarkAllSpawned(const Resolution& resolution, std::span<const StandbyCopy* const> primaries,
                    RegionPlayers& players) {
  for (const PlayerNumber player : resolution.players) players.MarkSpawned(player);
  for (const StandbyCopy* primary : primaries) {
    for (const PlayerNumber player : primary->state().spawned) players.MarkSpawned(player);
  }
}

// Events that wait for the game in a dead region, for bodies that come here from it. A body that was here already has
// brought its own along; of one that is gone, they count if the dead region removed it.
void AdoptEvents(const RegionState& dead, const Copies& promoted, RegionParts& parts) {
  const auto comes = [&](BodyId id) { return promoted.contains(id); };
  const auto takes = [&](const BodyDef&, BodyId gone) {
    if (IsPlayerBody(gone)) return parts.players.HasLeft(PlayerOf(gone));
    return std::ranges::binary_search(dead.tombstones, gone, {}, &BodyClaim::body);
  };
  parts.game.AdoptEvents(dead.host, comes, takes);
}

}  // namespace

absl::StatusOr<Inventory> Region::BeginFailover(const PartitionMap& map,
                                                std::span<const StandbyCopy* const> primaries) {
  RegionParts& parts = *parts_;
  bool begun = false;
  if (absl::Status status = parts.failover.Begin(map, parts.neighborhood.map().version(), &begun); !status.ok()) {
    return status;
  }
  if (begun) {
    parts.map_change.Clear();
    parts.borders.Expect(map.version(), map.Neighbors(id()));
  }
  parts.failover.Validate(parts.neighborhood.map().version());
  return TakeInventory(StateOf(parts), map.version(), primaries);
}

absl::StatusOr<StepResult> Region::Resume(const Resolution& resolution, std::span<const StandbyCopy* const> primaries) {
  RegionParts& parts = *parts_;
  if (absl::Status status = parts.failover.Check(resolution, parts.tick); !status.ok()) return status;
  const absl::StatusOr<Copies> promoted =
      FindPromoted(resolution, id(), parts.grants_out.kept(), primaries, parts.catalog, parts.reports);
  if (!promoted.ok()) return promoted.status();

  StepResult result;
  parts.tick = result.tick = Tick(resolution.resume_tick.value() - 1);
  LetGoOfGranted(*promoted, parts, result);
  for (const PendingGrant& grant : resolution.pending) {
    if (grant.to == id()) parts.grants_in.Owe(grant.body, grant.epoch, grant.granter, parts.tick);
  }
  parts.grants_out.Settle(FindStillNeeded(resolution, id(), parts.grants_out.kept(), primaries));
  Promote(resolution, *promoted, parts, result);
  MarkAllSpawned(resolution, primaries, parts.players);
  for (const StandbyCopy* primary : primaries) parts.tombstones.Merge(primary->state().tombstones, parts.tick);
  for (const StandbyCopy* primary : primaries) {
    parts.blasts.Adopt(primary->state().blasts);
    AdoptEvents(primary->state(), *promoted, parts);
  }
  parts.grants_in.StartStep();
  parts.exchange.Clear();
  parts.loads.Clear();
  parts.bodies.ForgetGrants();
  parts.bodies.ForgetPoses();
  parts.bodies.ConnectJoints();
  if (parts.catalog.has_game()) ConnectGameJoints(parts.records, parts.bodies);
  FindDriven(parts);
  AdoptMap(parts.failover.End(), true, parts);

  parts.log.Restart();
  parts.reports.TakeChanges();
  parts.records.TakeNews();
  parts.messages.Restart();
  parts.blasts.Restart();
  parts.questions.Restart();
  FindInland(parts);
  FindRelevant(parts);
  parts.grants_in.Release(parts.log.standby_has());
  result.frames = MakeFrames(parts);
  if (parts.log.on()) result.log = WriteLog(parts);
  Validate(parts);
  return result;
}

}  // namespace tessera::region
