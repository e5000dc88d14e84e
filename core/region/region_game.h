// RegionGame: the game of a region: turns what a step reported into events of the game, and lets the game see and
// change what the region owns.
//
// Bodies that the game makes are owned from the end of the tick on, and those that it removes are gone by then.
//
// A pair's begin or end is an event for both of its bodies, as far as this region owns them; static bodies are told
// where the pair is reported. Thread rule: one thread at a time.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "core/game/game_host.h"
#include "core/game/game_world.h"
#include "core/physics/world.h"
#include "core/region/bodies.h"
#include "core/region/catalog.h"
#include "core/region/ownership.h"
#include "core/region/record_table.h"
#include "core/region/tombstones.h"
#include "core/world/spawned_id.h"

namespace tessera::region {

class RegionGame : private game::GameWorld {
 public:
  // Without a host there is no game, and it does nothing. All others must outlive it.
  RegionGame(std::shared_ptr<game::GameHost> host, RegionId self, Incarnation maker, const Catalog& catalog,
             const Bodies& bodies, RecordTable& records, Ownership& ownership, Tombstones& tombstones,
             OutputCommit& output)
      : host_(std::move(host)),
        self_(self),
        catalog_(catalog),
        bodies_(bodies),
        records_(records),
        ownership_(ownership),
        tombstones_(tombstones),
        output_(output),
        ids_(maker) {}

  // After the step to `tick`, with the events that this region reports. Returns the bodies that it removed.
  std::vector<Departure> Run(Tick tick, std::span<const physics::PairEvent> events);
  game::GameHost* host() const { return host_.get(); }
  // GameHost::Inspect in this region, right after `tick`. Requires a game.
  void Inspect(Tick tick, game::GameHost::Inspection act) { host_->Inspect(tick, *this, act); }

 private:
  const Scene& scene() const override { return catalog_.scene(); }
  RegionId region() const override { return self_; }
  const BodyDef* Find(BodyId id) const override;
  BodyState StateOf(BodyId id) const override { return bodies_.world().StateOf(id); }
  bool Owns(BodyId id) const override { return bodies_.Owns(id); }
  std::size_t OwnedCount() const override { return bodies_.owned().size(); }
  QueryResult FindBodies(const BodyQuery& query) const override { return bodies_.world().FindBodies(query); }
  void ForEachOwned(absl::FunctionRef<void(BodyId, const BodyDef&)> visit) const override;
  std::vector<BodyId> DueBy(Tick tick) const override { return records_.DueBy(tick); }
  PropertySet ChangedOf(BodyId id) const override;
  game::GameRecord RecordOf(BodyId id) const override;
  std::optional<BodyId> NextId(std::size_t prefab) override { return ids_.Next(prefab); }
  void Commit(BodyId id, const PropertySet& changed, const game::GameRecord& record, bool together) override;
  void Spawn(BodyId id, const BodyState& state) override;
  void Remove(BodyId id) override;

  const std::shared_ptr<game::GameHost> host_;
  const RegionId self_;
  const Catalog& catalog_;
  const Bodies& bodies_;
  RecordTable& records_;
  Ownership& ownership_;
  Tombstones& tombstones_;
  OutputCommit& output_;
  SpawnedIds ids_;
  Tick tick_;
  std::vector<Departure> removed_;  // in this tick
};

}  // namespace tessera::region
