#include "core/region/forces.h"

#include "core/region/fields.h"

namespace tessera::region {
namespace {

// Calls `visit(index, control)` for the owned bodies that players move, in their order. Unless somebody moves another
// body than his own, only players' bodies can be such.
template <class Visit>
void ForEachMoved(const Bodies& bodies, const RegionPlayers& players, Visit visit) {
  const std::span<const OwnedBody> owned = bodies.owned();
  const std::span<const OwnedBody> some = players.driven().empty() ? PlayersAmong(owned) : owned;
  for (const OwnedBody& body : some) {
    const PlayerControl* const control = players.MoverOf(body.def->id);
    if (control != nullptr) visit(static_cast<std::size_t>(&body - owned.data()), *control);
  }
}

}  // namespace

void BodyForces::StatesChanged() {
  if (scene_.fields.empty()) return;
  for (FieldNote& note : fields_) note.known = false;
}

Vec3d BodyForces::FieldOn(std::size_t index, const BodyState& state) {
  FieldNote& note = fields_[index];
  if (!note.known) note = {FieldAcceleration(scene_.fields, state), true};
  return note.acceleration_m_s2;
}

std::span<const physics::Forces> BodyForces::Find(const Bodies& bodies, const RegionPlayers& players,
                                                  const RecordTable& records) {
  fields_.Align(bodies);
  forces_.assign(bodies.owned().size(), {});
  for (std::size_t i = 0; i < forces_.size(); ++i) {
    const OwnedBody& body = bodies.owned()[i];
    if (body.state.asleep) continue;
    Vec3d& acceleration = forces_[i].acceleration_m_s2;
    acceleration = scene_.gravity_m_s2 * body.gravity_scale;
    if (!scene_.fields.empty()) acceleration += FieldOn(i, body.state);
  }
  ForEachMoved(bodies, players, [&](std::size_t i, const PlayerControl& control) {
    const OwnedBody& body = bodies.owned()[i];
    if (!body.state.asleep) forces_[i].acceleration_m_s2 += Vec3d(control.next.force_n) / body.def->mass_kg;
  });
  const auto rate = static_cast<float>(1 / tick_s_);
  for (const KeptRecord* record : records.Acting()) {
    const std::ptrdiff_t index = bodies.IndexOf(record->body);
    const Vec3f force_n = record->game.NextForce(rate);
    if (index < 0 || force_n == Vec3f()) continue;
    const auto i = static_cast<std::size_t>(index);
    forces_[i].acceleration_m_s2 += Vec3d(force_n) / bodies.owned()[i].def->mass_kg;
  }
  return forces_;
}

void BodyForces::Apply(const RegionPlayers& players, const RecordTable& records, Bodies& bodies) {
  fields_.Align(bodies);
  if (scene_.fields.empty()) {
    ForEachMoved(bodies, players, [&](std::size_t i, const PlayerControl& control) {
      bodies.ApplyForce(bodies.owned()[i].def->id, control.next.force_n, control.next.torque_nm);
    });
  } else {
    ApplyFields(players, bodies);
  }
  const auto per_tick = static_cast<float>(1 / tick_s_);
  for (const KeptRecord* record : records.Acting()) {
    if (!bodies.Owns(record->body)) continue;
    if (record->game.wakes) bodies.Wake(record->body);
    bodies.ApplyForce(record->body, record->game.NextForce(per_tick), record->game.NextTorque(per_tick));
  }
  ApplyToGhosts(bodies);
}

void BodyForces::ApplyFields(const RegionPlayers& players, Bodies& bodies) {
  for (std::size_t i = 0; i < bodies.owned().size(); ++i) {
    const OwnedBody& body = bodies.owned()[i];
    const BodyId id = body.def->id;
    Vec3f force, torque;
    if (const PlayerControl* control = players.MoverOf(id); control != nullptr) {
      force = control->next.force_n;
      torque = control->next.torque_nm;
    }
    if (!body.state.asleep) force += Vec3f(FieldOn(i, body.state) * body.def->mass_kg);
    bodies.ApplyForce(id, force, torque);
  }
}

void BodyForces::ApplyToGhosts(Bodies& bodies) const {
  const auto per_tick = static_cast<float>(1 / tick_s_);
  for (const Ghost& ghost : bodies.ghosts()) {
    const GhostRecord& record = ghost.record;
    Vec3f force = record.force_n, torque = record.torque_nm;
    if (record.woken) bodies.Wake(record.id);
    // A ghost that came to rest here a tick before it does with its owner is not woken by its load.
    const BodyState state = bodies.world().StateOf(record.id);
    if (!state.asleep) {
      force += record.load_ns * per_tick;
      torque += record.load_nms * per_tick;
      if (!scene_.fields.empty()) force += Vec3f(FieldAcceleration(scene_.fields, state) * ghost.def->mass_kg);
    }
    bodies.ApplyForce(record.id, force, torque);
  }
}

}  // namespace tessera::region
