// Transaction: what one call of a game asked for. It reads as if all of it had been done; nothing is until Commit.
//
//   Transaction transaction(world);
//   transaction.Own(body)->record.push_ns += impulse;
//   if (game_returned_0) transaction.Commit();
//
// Thread rule: one thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/game/game_world.h"
#include "core/game/settings.h"
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
    std::size_t messages = kMaxOutbox;
  };

  // `game`: number of the game, which the bodies that it makes are of.
  explicit Transaction(GameWorld& world, SpawnLimits limits, std::uint32_t game = 0)
      : world_(world), limits_(limits), game_(game) {}

  // The world before the call: only for what the call cannot change.
  const GameWorld& world() const { return world_; }

  // --- The world as this transaction leaves it.
  const BodyDef* Find(BodyId id) const { return id == found_.id ? found_.def : FindAnew(id).def; }
  BodyState StateOf(BodyId id) const;  // the body is here
  bool Owns(BodyId id) const { return id == found_.id ? found_.owned : FindAnew(id).owned; }
  bool Removed(BodyId id) const { return removed_.contains(id); }  // by this call
  PropertySet PropertiesOf(BodyId id) const;
  // The region owns the body. Valid until anything changes.
  const GameRecord& RecordOf(BodyId id) const;

  // The caller notes a body of the world as it was before anything changed, so that it is not looked up.
  void Know(BodyId id, const BodyDef& def, bool owned) { found_ = {id, &def, owned}; }

  // --- Changes.
  // The body, for changing; nullptr if the region does not own it.
  Changes* Own(BodyId id);
  // The first body of a new one of this prefab. RESOURCE_EXHAUSTED: too many in this tick or in this region, or no ids.
  absl::StatusOr<BodyId> Spawn(std::size_t prefab, const SpawnMotion& motion);
  // The id of a new joint; nothing when the region has none left to give.
  std::optional<JointId> NextJoint() { return world_.NextJoint(); }
  // The state of a body that this call makes, for changing; nullptr for others.
  BodyState* MadeState(BodyId id);
  // The region owns the body, which is a player's.
  void Place(BodyId id, const BodyState& state) { placed_[id] = state; }
  // The region owns the body.
  void Remove(BodyId id);
  // Sends a message that goes with the record of `carrier`, which the region owns or has just removed. `target` is not
  // static. FAILED_PRECONDITION: the region does not own the carrier; RESOURCE_EXHAUSTED: too many messages.
  absl::Status Send(BodyId carrier, BodyId target, Tick now, Message what);
  // RESOURCE_EXHAUSTED: the region keeps as many area effects as it may.
  absl::Status Explode(Blast blast);
  void Log(std::string line) { lines_.push_back(std::move(line)); }
  const std::vector<std::string>& lines() const { return lines_; }
  // Adds to one of the game's own counters.
  void Count(std::string name, std::uint64_t more) { counts_.emplace_back(std::move(name), more); }
  const std::vector<std::pair<std::string, std::uint64_t>>& counts() const { return counts_; }

  bool removes() const { return !removed_.empty(); }
  // Does all of it, in the order of ids. Returns how many bodies were made.
  std::size_t Commit();
  std::size_t sent() const { return sent_; }  // messages

 private:
  struct Made {
    BodyDef def;
    BodyState state;
  };

  // A body as this transaction has it.
  struct Found {
    BodyId id;
    const BodyDef* def = nullptr;
    bool owned = false;
  };
  const Found& FindAnew(BodyId id) const;
  // Gives that of a carrier; nullptr if the region owns no such record.
  Mail* MailOf(BodyId carrier);

  GameWorld& world_;
  // The body that was asked for last: mostly one that the call is about, and asks for again and again. Forgotten when
  // bodies come or go.
  mutable Found found_;
  std::map<BodyId, Changes> changes_;
  std::map<BodyId, Made> made_;
  std::map<BodyId, BodyState> placed_;    // none that was made
  std::set<BodyId> removed_;              // none of those that are made or changed
  std::map<BodyId, Changes> last_words_;  // records of removed bodies, where the call changed them
  SpawnLimits limits_;                    // the part of them that is left
  std::size_t sent_ = 0;
  std::uint32_t game_;
  std::vector<Blast> blasts_;
  std::vector<std::string> lines_;
  std::vector<std::pair<std::string, std::uint64_t>> counts_;
};

}  // namespace tessera::game
