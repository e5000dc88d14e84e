// Transaction: what one call of a game asked for. It reads as if all of it had been done; nothing is until Commit.
//
//   Transaction transaction(world);
//   transaction.Own(body)->record.push_ns += impulse;
//   if (game_returned_0) transaction.Commit();
//
// Thread rule: one thread.
#pragma once

#include <cstddef>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "core/game/game_world.h"
#include "core/world/prefab.h"

namespace tessera::game {

class Transaction {
 public:
  struct Changes {
    PropertySet properties;
    GameRecord record;
  };

  struct SpawnLimits {
    std::size_t bodies = 0;     // that this call may make
    std::size_t in_region = 0;  // that the region may have then
  };

  explicit Transaction(GameWorld& world, SpawnLimits limits) : world_(world), limits_(limits) {}

  // The world before the call: only for what the call cannot change.
  const GameWorld& world() const { return world_; }

  // --- The world as this transaction leaves it.
  const BodyDef* Find(BodyId id) const;
  BodyState StateOf(BodyId id) const;  // the body is here
  bool Owns(BodyId id) const;
  PropertySet PropertiesOf(BodyId id) const;

  // --- Changes.
  // The body, for changing; nullptr if the region does not own it.
  Changes* Own(BodyId id);
  // The first body of a new one of this prefab. RESOURCE_EXHAUSTED: too many in this tick or in this region, or no ids.
  absl::StatusOr<BodyId> Spawn(std::size_t prefab, const SpawnMotion& motion);
  // The region owns the body.
  void Remove(BodyId id);
  void Log(std::string line) { lines_.push_back(std::move(line)); }
  const std::vector<std::string>& lines() const { return lines_; }

  // Does all of it, in the order of ids. Returns how many bodies were made.
  std::size_t Commit();

 private:
  struct Made {
    BodyDef def;
    BodyState state;
  };

  GameWorld& world_;
  std::map<BodyId, Changes> changes_;
  std::map<BodyId, Made> made_;
  std::set<BodyId> removed_;  // none of those in the two above
  SpawnLimits limits_;        // what is left of it
  std::vector<std::string> lines_;
};

}  // namespace tessera::game
