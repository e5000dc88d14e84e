// Transaction: what one call of a game asked for. It reads as if all of it had been done; nothing is until Commit.
//
//   Transaction transaction(world);
//   transaction.Own(body)->record.push_ns += impulse;
//   if (game_returned_0) transaction.Commit();
//
// Thread rule: one thread.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "core/game/game_world.h"

namespace tessera::game {

class Transaction {
 public:
  struct Changes {
    PropertySet properties;
    GameRecord record;
  };

  explicit Transaction(GameWorld& world) : world_(world) {}

  const GameWorld& world() const { return world_; }
  // The body as this transaction leaves it, for changing; nullptr if the region does not own it.
  Changes* Own(BodyId id);
  // The properties as this transaction leaves them.
  PropertySet PropertiesOf(BodyId id) const;
  void Log(std::string line) { lines_.push_back(std::move(line)); }
  const std::vector<std::string>& lines() const { return lines_; }

  // Does all of it, in the order of ids.
  void Commit();

 private:
  GameWorld& world_;
  std::map<BodyId, Changes> changes_;
  std::vector<std::string> lines_;
};

}  // namespace tessera::game
