// Movement: how a player's input moves a body. There are three: by a force within limits, as a character, and by a
// function that a game wrote. The region that owns the body and a client that predicts it ask here for what the input
// does in the next step, so they do the same.
//
//   const MovementKind kind = KindOfMovement(scene, def, own, game);
//   const Mover mover{world, scene, kind, id, radius_m, tick_s, limits, game};
//   const Moved moved = Move(mover, input, state);
//   world.ApplyForce(id, moved.drive.force_n, moved.drive.torque_nm);
//
// Thread rule: free functions on values.
#pragma once

#include <cstdint>
#include <string>

#include "core/physics/game_movement.h"
#include "core/world/movement.h"
#include "core/world/player_limits.h"

namespace tessera::region {

enum class MovementKind : std::uint8_t {
  kForce,      // by the force and torque of an input, which act in that tick alone
  kCharacter,  // the engine's (core/physics/character.h)
  kGame,       // by a GameMovement
};

// `own`: it is a player's own body, rather than another one that a game let the player move. `game`: null without one.
MovementKind KindOfMovement(const Scene& scene, const BodyDef& def, bool own, const GameMovement* game);

// Whether the last input goes on for a while where none is there.
inline bool GoesOn(MovementKind kind) { return kind != MovementKind::kForce; }

struct Mover {
  const physics::World& world;
  const Scene& scene;  // with a player
  MovementKind kind;
  BodyId body;  // in the world
  double radius_m;
  double tick_s;
  const PlayerLimits& limits;
  const GameMovement* game;  // not null where it is the kind
};

struct Moved {
  physics::CharacterDrive drive;  // for the next step
  MovementState state;            // none unless a game's movement moves it
  std::string error;              // as physics::MovementRun
};

// `state`: as the last call for this player left it.
Moved Move(const Mover& mover, const PlayerInput& input, const MovementState& state);

}  // namespace tessera::region
