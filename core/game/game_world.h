// GameWorld: what a game host sees of its region, and what it changes there. core/region implements it.
//
// Thread rule: one thread at a time.
#pragma once

#include <cstddef>
#include <optional>
#include <string_view>
#include <vector>

#include "absl/functional/function_ref.h"
#include "core/game/blast.h"
#include "core/game/record.h"
#include "core/world/player_input.h"
#include "core/world/properties.h"
#include "core/world/query.h"
#include "core/world/scene.h"

namespace tessera::game {

class GameWorld {
 public:
  virtual ~GameWorld() = default;

  virtual const Scene& scene() const = 0;
  virtual RegionId region() const = 0;
  // Definition of a body that is here, static ones included; nullptr without one.
  virtual const BodyDef* Find(BodyId id) const = 0;
  // After the last step. The body is here.
  virtual BodyState StateOf(BodyId id) const = 0;
  // The angular impulse, N m s, that gives the body this angular velocity, rad/s. The body is here.
  virtual Vec3f AngularImpulseFor(BodyId id, Vec3d spin_rad_s) const = 0;
  // In the coordinates of the body's shape.
  virtual Vec3d CenterOfMassOf(const BodyDef& def) const = 0;
  // Whether joints hold the body, or one that joints connect to it, to the world or to a body that has no owner.
  virtual bool IsAnchored(BodyId id) const = 0;
  // kInstanceBody stands for the world's own record.
  virtual bool Owns(BodyId id) const = 0;
  virtual std::size_t OwnedCount() const = 0;
  // Looks at all that is here: own bodies, neighbours' and static ones, where the last step left them.
  virtual QueryResult FindBodies(const BodyQuery& query, const BodyPredicate& accept) const = 0;
  // All that this region owns, ascending.
  virtual void ForEachOwned(absl::FunctionRef<void(BodyId, const BodyDef&)> visit) const = 0;
  // Owned bodies with a timer that is due by `tick`, or that expire by then, ascending.
  virtual std::vector<BodyId> DueBy(Tick tick) const = 0;
  // Borders between this region and the farthest of those that a query touches.
  virtual std::uint32_t HopsFor(const BodyQuery& query) const = 0;
  // The answer of the regions to a question of a record that is owned here; nothing as long as one is awaited.
  virtual std::optional<Answer> AnswerTo(BodyId asker, const GameQuestion& question) const = 0;
  // The input of a player whose body the region owns that acted in the last step, or stands in for one; null if none
  // has come yet. Valid until the world changes.
  virtual const PlayerInput* InputOf(PlayerNumber player) const = 0;
  // The unit vector of the world along which an input looks, with the same bits on every host.
  virtual Vec3d LookOf(const PlayerInput& input) const = 0;
  // Owned bodies of players, ascending.
  virtual std::vector<BodyId> PlayerBodies() const = 0;
  // Owned bodies of players with commands that wait, ascending.
  virtual std::vector<BodyId> Commanded() const = 0;
  // Properties that were changed of a body that is here: of a neighbour's as they were some ticks ago.
  virtual PropertySet ChangedOf(BodyId id) const = 0;
  // Empty without one. Valid until the world changes.
  virtual const GameRecord& RecordOf(BodyId id) const = 0;
  // Properties that were changed of the world, as far as this region knows where another one owns them.
  virtual PropertySet KnownOfInstance() const = 0;
  // The id of the first body of a new one of this prefab; nothing when this region has none left to give.
  virtual std::optional<BodyId> NextId(std::size_t prefab) = 0;
  // The id of a new joint; nothing when this region has none left to give.
  virtual std::optional<JointId> NextJoint() = 0;
  // Owned bodies whose records have joints, ascending.
  virtual std::vector<BodyId> Jointed() const = 0;
  // Owned bodies that a player who is not theirs moves, or is to move, and owned bodies of such players; ascending.
  virtual std::vector<BodyId> Steering() const = 0;
  // Area effects that the region keeps.
  virtual std::size_t BlastCount() const = 0;
  // The body and all that joints in force connect to it, ascending.
  virtual std::vector<BodyId> AssemblyOf(BodyId id) const = 0;
  // Whether a joint in force, or one of the scene, connects the two.
  virtual bool AreConnected(BodyId a, BodyId b) const = 0;
  // Whether the body was removed here.
  virtual bool IsRemoved(BodyId id) const = 0;

  // Replaces both. The region owns the body. `together`: the same call changed other bodies as well, and what it did to
  // them and to this one may not be parted.
  virtual void Commit(BodyId id, const PropertySet& changed, GameRecord record, bool together) = 0;
  // A body of a prefab, with an id that follows from NextId. The region owns it from now on.
  virtual void Spawn(BodyId id, const BodyState& state) = 0;
  // The region owns the body, which is a player's: it is there from now on, instead of where the last step left it.
  virtual void Place(BodyId id, const BodyState& state) = 0;
  // An area effect, whose tick is to come.
  virtual void Explode(Blast blast) = 0;
  // The region owns the body. A player's goes only when the player leaves. Its messages still leave.
  virtual void Remove(BodyId id) = 0;
};

}  // namespace tessera::game
