#include "core/region/movement.h"

#include <utility>

#include "core/region/region_players.h"

namespace tessera::region {
namespace {

physics::CharacterDrive DriveByForce(const Mover& mover, const PlayerInput& input) {
  const PlayerRules& rules = *mover.scene.player;
  const BodyState state = mover.world.StateOf(mover.body);
  return {LimitedForce(rules, input.force_n, state.linear_velocity, mover.limits),
          LimitedTorque(rules, mover.radius_m, input.torque_nm, state.angular_velocity, mover.limits)};
}

physics::CharacterDrive DriveAsCharacter(const Mover& mover, const PlayerInput& input) {
  const auto drive = [&](const PlayerRules& rules) {
    return physics::DriveCharacter(mover.world, mover.body, rules, mover.scene.gravity_m_s2, input, mover.tick_s);
  };
  return mover.limits.empty() ? drive(*mover.scene.player) : drive(RulesWith(*mover.scene.player, mover.limits));
}

}  // namespace

MovementKind KindOfMovement(const Scene& scene, const BodyDef& def, bool own, const GameMovement* game) {
  if (game != nullptr && game->Moves(def)) return MovementKind::kGame;
  return own && scene.player->character.has_value() ? MovementKind::kCharacter : MovementKind::kForce;
}

Moved Move(const Mover& mover, const PlayerInput& input, const MovementState& state) {
  switch (mover.kind) {
    case MovementKind::kForce:
      return {DriveByForce(mover, input), {}, {}};
    case MovementKind::kCharacter:
      return {DriveAsCharacter(mover, input), {}, {}};
    case MovementKind::kGame:
      break;
  }
  const physics::MovementTick tick{mover.body, input, mover.scene.gravity_m_s2, mover.tick_s};
  physics::MovementRun run = physics::RunMovement(*mover.game, mover.world, tick, state);
  return {run.drive, run.state, std::move(run.error)};
}

}  // namespace tessera::region
