// GameMovement at work: one call of a movement that a game wrote (core/world/movement.h), for one body and one tick.
//
//   const MovementRun run = RunMovement(movement, world, {id, input, scene.gravity_m_s2, tick_s}, state);
//   world.ApplyForce(id, run.drive.force_n, run.drive.torque_nm);
//   state = run.state;
//
// It runs right after a step, as the character does, and what it gives acts in the next one. A region and a client's
// prediction call it alike. Whatever the function does, short of a crash, is contained: where it fails, or gives what
// is no number, the drive is 0, the state stays, and `error` says why.
//
// Thread rule: one thread at a time.
#pragma once

#include <string>

#include "core/physics/character.h"
#include "core/physics/world.h"
#include "core/world/movement.h"
#include "core/world/player_input.h"

namespace tessera::physics {

// The body that is moved, and what its player asks.
struct MovementTick {
  BodyId body;
  const PlayerInput& input;
  Vec3d gravity_m_s2;
  double tick_s = 0;
};

struct MovementRun {
  CharacterDrive drive;
  MovementState state;  // to begin the next tick with
  std::string error;    // one line; empty: all is well
};

// The greatest angular acceleration that a movement gives, rad/s^2; for the linear one it is kMaxAcceleration_m_s2.
inline constexpr double kMostMovementSpin_rad_s2 = 1e4;

// `before`: the state that the body's last call left, or of whatever moved last. A parked body, and one that sleeps and
// of which nothing is asked, is not moved. Requires a dynamic body in the world.
MovementRun RunMovement(const GameMovement& movement, const World& world, const MovementTick& tick,
                        const MovementState& before);

}  // namespace tessera::physics
