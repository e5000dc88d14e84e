// Character: what moves a player's body that walks.
//
// The body is a capsule of the engine without friction that nothing tilts. Before each step the character feels the
// ground and the way ahead with a few swept spheres, and answers with a force and a torque for the next step. So a
// region that has the body as a ghost needs none of this: it applies the force that the owner reports. The owner and
// the prediction of a client compute it alike.
//
//   const CharacterDrive drive = DriveCharacter(world, id, *scene.player, scene.gravity_m_s2, input, tick_s);
//   world.ApplyForce(id, drive.force_n, drive.torque_nm);
//
// It has no memory: the force follows from the state of the world and the input. On the ground, which is what is no
// steeper than the rules allow and within reach of a step, it is driven to the asked velocity along the ground, held
// against what gravity does along it, and drawn down to it; in the air it is driven sideways only. So nobody flies,
// whatever inputs come: the only forces up are a jump from the ground, a step that lies ahead, and what holds it on a
// slope. At most five spheres are swept a tick; none while it sleeps and nothing is asked of it.
//
// Thread rule: one thread at a time; `Drive` is a free function on values.
#pragma once

#include "core/physics/world.h"
#include "core/world/player_input.h"

namespace tessera::physics {

struct CharacterDrive {
  Vec3f force_n, torque_nm;  // for the next step
  friend bool operator==(const CharacterDrive&, const CharacterDrive&) = default;
};

// Holds what a character feels around it.
struct Footing {
  bool grounded = false;       // it stands on ground that it can walk on, or may be drawn down to it
  Vec3d normal{0, 1, 0};       // normal of the contact with the ground, unit
  Vec3d ground_velocity_m_s;   // velocity of the ground that it stands on
  double gap_m = 0;            // between the capsule and the ground, vertically
  std::optional<Vec3d> steep;  // horizontal normal, unit, of ground that is too steep and touched
  std::optional<Vec3d> wall;   // horizontal normal, unit, of what bars the way and is no step
  double wall_m = 0;           // between the capsule and that
  double rise_m = 0;           // height of the step ahead; 0: none
};

// The horizontal velocity that an input asks for.
Vec3d AskedVelocity(const CharacterRules& rules, const PlayerInput& input);

// Feels the ground under a body and, where it is asked to move, the way ahead.
Footing FindFooting(const World& world, BodyId id, const PlayerRules& player, double gravity_m_s2, Vec3d asked_m_s,
                    double tick_s);

// The force and torque that follow. `gravity_m_s2` > 0 points down.
CharacterDrive Drive(const PlayerRules& player, double gravity_m_s2, const BodyState& state, const Footing& footing,
                     const PlayerInput& input, double tick_s);

// Both. Requires player.character, a capsule in the world under `id`, and gravity along -y.
CharacterDrive DriveCharacter(const World& world, BodyId id, const PlayerRules& player, Vec3d gravity_m_s2,
                              const PlayerInput& input, double tick_s);

}  // namespace tessera::physics
