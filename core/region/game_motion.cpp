#include "core/region/game_motion.h"

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "core/physics/trig.h"
#include "core/region/region_parts.h"

namespace tessera::region {
namespace {

// Whether a neighbour that hears nothing of this tick would have to step the body in another way, now or at `place`.
bool ConcernsTheDeaf(const RegionParts& parts, const OwnedBody& body, double radius_m, Vec3d place) {
  const double horizon_s = parts.settings.lookahead_ticks * parts.tick_s;
  const double far = radius_m + parts.settings.aura_m + horizon_s * Length(Vec3d(body.state.linear_velocity));
  const Vec3d around{far, far, far};
  for (std::size_t n = 0; n < parts.neighborhood.size(); ++n) {
    const RegionId neighbor = parts.neighborhood[n];
    if (!parts.borders.IsUp(n) || parts.borders.Speaks(neighbor)) continue;
    const std::span<const GhostRecord> sent = parts.borders.sent(n);
    const auto seen = std::ranges::lower_bound(sent, body.def->id, {}, &GhostRecord::id);
    if (seen != sent.end() && seen->id == body.def->id) return true;
    if (parts.neighborhood.map().Reaches(neighbor, {place - around, place + around})) return true;
  }
  return false;
}

// The body's state in another place. The parts of an assembly keep their places in it.
BodyState Carried(const BodyState& state, const BodyState& from, const game::GameTeleport& to) {
  const Quatd turn = to.rotation ? Normalized(*to.rotation * Conjugate(from.orientation)) : Quatd();
  BodyState there = state;
  const Vec3d arm = state.position - from.position;
  there.position = to.position + (to.rotation ? Rotate(turn, arm) : arm);
  if (to.rotation) there.orientation = Normalized(turn * state.orientation);
  if (to.velocity_m_s) there.linear_velocity = *to.velocity_m_s;
  if (to.spin_rad_s) there.angular_velocity = *to.spin_rad_s;
  // The angular velocity stays as it is in the world, and counts from now on.
  if (to.rotation || to.spin_rad_s) there.angular_momentum = {};
  there.asleep = false;
  there.still_s = 0;
  return there;
}

// A kinematic body that is elsewhere stands there.
BodyState Standing(BodyState state) {
  state.linear_velocity = state.angular_velocity = {};
  state.asleep = true;
  return state;
}

void Teleport(RegionParts& parts, std::size_t index) {
  const BodyId id = parts.bodies.owned()[index].def->id;
  const game::GameTeleport to = *parts.records.Find(id)->game.teleport;
  const BodyState from = parts.bodies.owned()[index].state;
  for (const std::size_t member : parts.bodies.OwnedAssembly(index)) {
    const OwnedBody& body = parts.bodies.owned()[member];
    const BodyId moved = body.def->id;
    BodyState there = Carried(body.state, from, to);
    if (moved == id) {
      there.position = to.position;
      if (to.rotation) there.orientation = *to.rotation;
    }
    parts.bodies.Teleport(moved, body.def->kinematic ? Standing(there) : there);
    game::GameRecord record = parts.records.Of(moved).game;
    record.target.reset();
    if (moved == id) record.teleport.reset();
    record.jumped = true;
    ++record.jumps;
    parts.records.Put(moved, record);
  }
}

// The state of a kinematic body with which it gets to its target by way of equal steps; it stands where it has arrived.
// Until the tick at which it is to be there, that is: then it is put there, which is less than a float's rounding.
BodyState Approaching(const BodyState& state, const game::GameTarget& target, Tick tick, double tick_s) {
  BodyState next = state;
  if (tick >= target.arrives && !state.asleep) {
    next.position = target.position;
    next.orientation = target.rotation;
    return Standing(next);
  }
  const auto left = static_cast<double>(std::max<std::int64_t>(target.arrives - tick, 1)) * tick_s;
  const Vec3d turn = physics::RotationVectorOf(target.rotation * Conjugate(state.orientation));
  next.linear_velocity = Vec3f((target.position - state.position) / left);
  next.angular_velocity = Vec3f(turn / left);
  next.asleep = next.linear_velocity == Vec3f() && next.angular_velocity == Vec3f();
  return next;
}

void Approach(RegionParts& parts, std::size_t index) {
  const OwnedBody& body = parts.bodies.owned()[index];
  const BodyId id = body.def->id;
  game::GameRecord record = parts.records.Of(id).game;
  if (body.state.asleep && ConcernsTheDeaf(parts, body, parts.bodies.radius_m(index), body.state.position)) return;
  const BodyState next = Approaching(body.state, *record.target, parts.tick, parts.tick_s);
  parts.bodies.Drive(id, next);
  if (!next.asleep) return;
  record.target.reset();
  parts.records.Put(id, record);
}

}  // namespace

void MoveByGame(RegionParts& parts) {
  if (!parts.records.AnyActs()) return;
  std::vector<BodyId> leaping, driven;
  for (const KeptRecord* record : parts.records.Acting()) {
    if (record->game.teleport) leaping.push_back(record->body);
    if (record->game.target) driven.push_back(record->body);
  }
  for (const BodyId id : driven) Approach(parts, static_cast<std::size_t>(parts.bodies.IndexOf(id)));
  for (const BodyId id : leaping) {
    const auto index = static_cast<std::size_t>(parts.bodies.IndexOf(id));
    const OwnedBody& body = parts.bodies.owned()[index];
    const Vec3d place = parts.records.Find(id)->game.teleport->position;
    if (!ConcernsTheDeaf(parts, body, parts.bodies.radius_m(index), place)) Teleport(parts, index);
  }
}

bool AnyoneWaits(const RegionParts& parts) {
  if (!parts.records.AnyActs()) return false;
  return std::ranges::any_of(parts.records.Acting(), [&](const KeptRecord* record) {
    if (record->game.teleport) return true;
    const std::ptrdiff_t index = parts.bodies.IndexOf(record->body);
    return record->game.target && parts.bodies.owned()[static_cast<std::size_t>(index)].state.asleep;
  });
}

void AddGame(const game::GameRecord& game, float tick_rate_hz, GhostRecord& ghost) {
  ghost.force_n += game.NextForce(tick_rate_hz);
  ghost.torque_nm += game.NextTorque(tick_rate_hz);
  ghost.woken = game.wakes;
  ghost.jumped = game.jumped;
  ghost.tuning = game.tuning;
  ghost.tuning.claim.reset();  // no neighbour's business
  ghost.joints = game.joints;
}

}  // namespace tessera::region
