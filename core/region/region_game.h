// RegionGame: the game of a region: turns what a step reported into events of the game, and lets the game see and
// change what the region owns.
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
#include "core/region/record_table.h"

namespace tessera::region {

class RegionGame : private game::GameWorld {
 public:
  // Without a host there is no game, and it does nothing. All others must outlive it.
  RegionGame(std::shared_ptr<game::GameHost> host, const Catalog& catalog, const Bodies& bodies, RecordTable& records)
      : host_(std::move(host)), catalog_(catalog), bodies_(bodies), records_(records) {}

  // After the step to `tick`, with the events that this region reports.
  void Run(Tick tick, std::span<const physics::PairEvent> events);
  game::GameHost* host() const { return host_.get(); }
  // GameHost::Inspect in this region, right after `tick`. Requires a game.
  void Inspect(Tick tick, game::GameHost::Inspection act) { host_->Inspect(tick, *this, act); }

 private:
  const Scene& scene() const override { return catalog_.scene(); }
  const BodyDef* Find(BodyId id) const override;
  BodyState StateOf(BodyId id) const override { return bodies_.world().StateOf(id); }
  bool Owns(BodyId id) const override { return bodies_.Owns(id); }
  void ForEachOwned(absl::FunctionRef<void(BodyId, const BodyDef&)> visit) const override;
  std::vector<BodyId> DueBy(Tick tick) const override { return records_.DueBy(tick); }
  PropertySet ChangedOf(BodyId id) const override;
  game::GameRecord RecordOf(BodyId id) const override;
  void Commit(BodyId id, const PropertySet& changed, const game::GameRecord& record) override {
    records_.Commit(id, changed, record);
  }

  const std::shared_ptr<game::GameHost> host_;
  const Catalog& catalog_;
  const Bodies& bodies_;
  RecordTable& records_;
};

}  // namespace tessera::region
