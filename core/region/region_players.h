// RegionPlayers: who came, who left, and the inputs of those whose bodies are owned here.
//
// An input is chosen ("committed") one tick before it acts, because neighbours that see the body must apply the same
// force; it acts exactly once, and goes along when the body is handed over. Copies of an input are recognised here and
// nowhere else (InputSequence). Thread rule: one thread at a time.
#pragma once

#include <map>
#include <set>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "core/region/frame.h"
#include "core/region/input_sequence.h"
#include "core/region/movement.h"
#include "core/region/region.h"
#include "core/world/player_limits.h"
#include "core/world/properties.h"

namespace tessera::region {

// A player whose inputs move another body than the own one. Both are owned here.
struct Driven {
  BodyId own, body;
  friend bool operator==(const Driven&, const Driven&) = default;
};

class RegionPlayers {
 public:
  // `begins`: its name, and the properties that it begins with.
  void Spawn(PlayerNumber player, PropertySet begins = {});
  void Leave(PlayerNumber player) { left_.insert(player); }
  void Park(PlayerNumber player, bool parked);
  const std::set<PlayerNumber>& parked() const { return parked_; }
  // Those whose parking ended since the last call, ascending.
  std::set<PlayerNumber> TakeUnparked() { return std::exchange(unparked_, {}); }
  bool HasLeft(PlayerNumber player) const { return left_.contains(player); }
  const std::set<PlayerNumber>& left() const { return left_; }
  // Has a body, or had one: `Spawn` does nothing any more.
  void MarkSpawned(PlayerNumber player) { spawned_.insert(player); }
  const std::set<PlayerNumber>& spawned() const { return spawned_; }
  // Those asked for since the last call, ascending, with their names; each player comes out once in a life.
  std::vector<std::pair<PlayerNumber, PropertySet>> TakeSpawns();
  // The bodies of players that a game keeps out of the world now. Returns those that it does not any more.
  std::vector<BodyId> SetHidden(std::span<const BodyId> hidden);

  // Control of the bodies owned here.
  std::map<PlayerNumber, PlayerControl> Controls() const;
  void Adopt(PlayerNumber player, PlayerControl control);
  const PlayerControl* Find(PlayerNumber player) const;
  // The control whose next input pushes the body; null where nobody's does.
  const PlayerControl* MoverOf(BodyId body) const;
  // The players who move other bodies than their own, ascending by those.
  void SetDriven(std::vector<Driven> driven);
  std::span<const Driven> driven() const { return driven_; }
  // The body that the player's inputs move.
  BodyId MovedBy(PlayerNumber player) const;
  // Decides on an input that came from its player; errors as those of Region::QueueInput.
  absl::Status Queue(const PlayerInput& input);
  // An input that came by way of the last owner takes its place by number, unless it is here already or too late.
  void QueueForwarded(const PlayerInput& input);
  // Chooses the input of the next step; `move` finds what it does to the body that it moves, given the state that the
  // body's movement left. Where no input is there and it `goes_on`, the last one does for kMaxHeldTicks, so that a late
  // one is not felt as a stumble, and then nothing is asked; otherwise nothing is done.
  void Commit(PlayerNumber player, bool goes_on,
              absl::FunctionRef<Moved(const PlayerInput&, const MovementState&)> move);
  // The committed input is acting: its number becomes the last one.
  void Applied(PlayerNumber player);
  // All that the new owner must know. What is queued after this comes out of `Release` and has to be sent after it.
  PlayerControl MakeGrant(PlayerNumber player);
  std::vector<PlayerInput> Release(PlayerNumber player);

  void Validate() const;

 private:
  struct Controlled {
    PlayerControl control;
    InputSequence sequence;
    std::size_t granted = 0;  // inputs that went with a grant already
  };
  static bool TakeNext(PlayerControl& control);

  std::map<PlayerNumber, PropertySet> asked_;
  std::set<PlayerNumber> spawned_, left_, parked_, unparked_;
  std::vector<BodyId> hidden_;
  std::map<PlayerNumber, Controlled> controlled_;  // players whose bodies are owned here
  std::vector<Driven> driven_;                     // ascending by own
  std::vector<Driven> drivers_;                    // the same, ascending by body
};

// Scaled down to `max_force_n`, and along each axis to its share; its part against gravity is cut down to
// `max_force_up_n`; then the part along the velocity fades to 0 as the body nears `max_speed_m_s` that way.
Vec3f LimitedForce(const PlayerRules& rules, Vec3f asked_n, Vec3f velocity_m_s, const PlayerLimits& limits = {});
// The same at the surface of a body of this radius: no more than the largest force does there, and none beyond the
// speed at which the surface moves by `max_speed_m_s`. So a player cannot spin a body until it is taken out as absurd.
Vec3f LimitedTorque(const PlayerRules& rules, double radius_m, Vec3f asked_nm, Vec3f angular_velocity_rad_s,
                    const PlayerLimits& limits = {});

}  // namespace tessera::region
