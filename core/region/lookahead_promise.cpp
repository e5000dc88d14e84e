#include "core/region/lookahead_promise.h"

#include <algorithm>

namespace tessera::region {
namespace {

// A character comes to its greatest speed within a tick where it jumps, and gets no faster then.
double MostAcceleration(const PlayerRules& player, double tick_s, double horizon_s) {
  if (!player.character.has_value()) return player.max_force_n / player.body.mass_kg;
  const CharacterRules& rules = *player.character;
  const double most_m_s = std::max({rules.walk_speed_m_s, rules.run_speed_m_s, rules.jump_speed_m_s});
  return rules.acceleration_m_s2 + 2 * most_m_s * (horizon_s + tick_s) / (horizon_s * horizon_s);
}

}  // namespace

std::uint32_t LookaheadPromise::For(RegionId to, const BorderFrame& frame) {
  const std::uint32_t ticks = in_.settings.promise_ticks;
  const bool quiet = frame.impulses.empty() && frame.grants.empty() && frame.acknowledgements.empty() &&
                     frame.late_corrections.empty() && frame.inputs.empty() && frame.packets.empty();
  if (ticks == 0 || !quiet || in_.restless) return 0;
  const auto sleeps = [](const GhostRecord& ghost) {
    const bool pushed = ghost.woken || ghost.jumped || ghost.force_n != Vec3f() || ghost.torque_nm != Vec3f();
    return ghost.state.asleep && !pushed && !IsPlayerBody(ghost.id);
  };
  if (!std::ranges::all_of(frame.ghosts, sleeps)) return 0;
  if (in_.inland) return frame.ghosts.empty() || !AnyAwake() ? ticks : 0;
  if (!unrest_.has_value()) unrest_ = FindUnrest();
  if (!frame.ghosts.empty()) return unrest_->any ? 0 : ticks;
  const auto disturbs = [&](const Aabb& place) { return in_.neighborhood.map().Reaches(to, place); };
  return std::ranges::any_of(unrest_->places, disturbs) ? 0 : ticks;
}

bool LookaheadPromise::AnyAwake() const {
  return std::ranges::any_of(in_.bodies.owned(), [](const OwnedBody& body) { return !body.state.asleep; });
}

LookaheadPromise::Unrest LookaheadPromise::FindUnrest() const {
  const Scene& scene = in_.catalog.scene();
  Unrest unrest;
  for (std::size_t i = 0; i < in_.bodies.owned().size(); ++i) {
    const OwnedBody& body = in_.bodies.owned()[i];
    AddUnrest(body.def->id, body.state, in_.bodies.radius_m(i), Length(in_.forces[i].acceleration_m_s2), unrest);
  }
  for (const Ghost& ghost : in_.bodies.ghosts()) {
    const BodyId id = ghost.record.id;
    const Aabb box = in_.bodies.world().BoundsOf(id);
    const double acceleration = Length(scene.gravity_m_s2 * GravityScaleOf(*ghost.def, ghost.record.tuning));
    AddUnrest(id, in_.bodies.world().StateOf(id), Length(box.max - box.min) / 2, acceleration, unrest);
  }
  return unrest;
}

// A body that cannot leave this region's cell within the ticks of a promise, and those that a neighbour must see in
// advance, disturbs nobody: most bodies are such.
void LookaheadPromise::AddUnrest(BodyId id, const BodyState& state, double radius_m, double acceleration_m_s2,
                                 Unrest& unrest) const {
  const bool steered = IsPlayerBody(id);
  if (state.asleep && !steered) return;
  unrest.any = true;
  const double horizon_s = (in_.settings.promise_ticks + in_.settings.lookahead_ticks) * in_.tick_s;
  if (steered) acceleration_m_s2 += MostAcceleration(*in_.catalog.scene().player, in_.tick_s, horizon_s);
  const double far = radius_m + in_.settings.aura_m +
                     horizon_s * (Length(Vec3d(state.linear_velocity)) + 0.5 * acceleration_m_s2 * horizon_s);
  const Vec3d at = state.position;
  const Cell& cell = in_.neighborhood.map().CellAt(at.x, at.z);
  const double inside =
      std::min({at.x - cell.area.min_x, cell.area.max_x - at.x, at.z - cell.area.min_z, cell.area.max_z - at.z});
  if (cell.owner == in_.neighborhood.self() && inside > far) return;
  const Vec3d around{far, far, far};
  unrest.places.push_back({at - around, at + around});
}

}  // namespace tessera::region
