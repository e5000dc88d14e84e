#include "core/region/region_begin.h"

#include <algorithm>
#include <iterator>

#include "core/region/game_control.h"
#include "core/region/game_joints.h"

namespace tessera::region {
namespace {

bool IsInCells(const RegionParts& parts, Vec3d position) {
  return parts.neighborhood.map().OwnerOf(position) == parts.self();
}

// The lowest body of the assembly that is in the state: others may have been taken out.
const StateBody& AnchorOf(const StateBody& body, const RegionState& state, const Catalog& catalog) {
  for (const BodyId id : catalog.AssemblyOf(body.id)) {
    if (const StateBody* anchor = state.Find(id); anchor != nullptr) return *anchor;
  }
  return body;
}

}  // namespace

void OwnFromScene(RegionParts& parts) {
  for (const BodyDef& def : parts.scene().bodies) {
    if (def.motion != Motion::kDynamic) continue;
    const BodyDef* anchor = parts.catalog.Find(parts.catalog.AssemblyOf(def.id).front());
    if (IsInCells(parts, anchor->initial.position)) parts.bodies.Own(def.id, Epoch(1), def.initial);
  }
  if (parts.catalog.has_game() && IsInCells(parts, parts.catalog.InstancePlace())) parts.ownership.BeginInstance();
  parts.bodies.ConnectJoints();
}

void OwnFromState(const RegionState& initial, RegionParts& parts) {
  parts.tick = initial.tick;
  const bool own = initial.region == parts.self();
  for (const StateBody& body : initial.bodies) {
    if (!own && !IsInCells(parts, AnchorOf(body, initial, parts.catalog).state.position)) continue;
    // Changes of properties are numbered anew from here on: the state may be another cluster's.
    CarriedRecord record = initial.RecordOf(body.id);
    MarkSettled(initial.blasts, record.game);
    record.change = std::min<std::uint64_t>(record.change, 1);
    const bool player = IsPlayerBody(body.id);
    parts.ownership.Restore({body.id, body.epoch, body.state, std::move(record)},
                            player ? initial.controls.at(PlayerOf(body.id)) : PlayerControl());
  }
  // A whole world that had no game.
  const bool begins = initial.region == RegionId() && !initial.bodies.empty() && initial.Find(kInstanceBody) == nullptr;
  if (begins && parts.catalog.has_game() && IsInCells(parts, parts.catalog.InstancePlace())) {
    parts.ownership.BeginInstance();
  }
  if (const CarriedRecord world = initial.RecordOf(kInstanceBody); !world.empty())
    parts.messages.BeginWith(world.bytes);
  for (const PlayerNumber player : initial.spawned) parts.players.MarkSpawned(player);
  parts.tombstones.Merge(initial.tombstones, parts.tick);
  parts.blasts.Adopt(initial.blasts);
  if (own) {
    parts.game.AdoptHost(initial.host);
  } else {
    const auto takes = [&](const BodyDef& still, BodyId gone) {
      const bool removed = IsPlayerBody(gone) ? parts.players.HasLeft(PlayerOf(gone)) : parts.tombstones.Has(gone);
      return removed && IsInCells(parts, still.initial.position);
    };
    parts.game.AdoptEvents(
        initial.host, [&](BodyId id) { return parts.bodies.IndexOf(id) >= 0; }, takes);
  }
  std::vector<TouchingPair> touching;
  std::ranges::copy_if(initial.touching, std::back_inserter(touching),
                       [&](const TouchingPair& pair) { return parts.bodies.Owns(parts.reports.ReporterOf(pair)); });
  parts.reports.Restore(touching);
  parts.bodies.ConnectJoints();
  if (parts.catalog.has_game()) ConnectGameJoints(parts.records, parts.bodies);
  FindDriven(parts);
}

}  // namespace tessera::region
