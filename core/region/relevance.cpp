#include "core/region/relevance.h"

#include <algorithm>
#include <cassert>
#include <utility>

#include "core/region/cell_finder.h"

namespace tessera::region {

Relevance::Relevance(const Catalog& catalog, const RegionSettings& settings, double tick_s)
    : catalog_(catalog),
      aura_m_(settings.aura_m),
      horizon_s_(settings.lookahead_ticks * tick_s),
      ghost_depth_(settings.ghost_depth),
      islands_(catalog, settings.whole_up_to) {}

void Relevance::Update(const Inputs& in) {
  still_ticks_.Align(in.bodies);
  table_.Reset(in.bodies.owned().size(), in.neighborhood.size());
  if (in.neighborhood.size() == 0) return islands_.Mark(in.bodies, in.neighborhood, table_);
  if (!in.inland) MarkSwept(in);
  if (!in.bodies.stepped()) MarkFirst(in);
  MarkNearOthers(in);
  MarkDeeper(in);
  islands_.Mark(in.bodies, in.neighborhood, table_);
  MarkSleepers(in);
  for (const BodyId id : in.hidden) {
    if (const std::ptrdiff_t index = in.bodies.IndexOf(id); index >= 0) table_.Clear(static_cast<std::size_t>(index));
  }
  CountStill(in.bodies);
  MarkAssemblies(in.bodies);
}

// A body so far inside its cell that it cannot leave it in time is passed over without predicting its bounds.
void Relevance::MarkSwept(const Inputs& in) {
  const PartitionMap& map = in.neighborhood.map();
  CellFinder cells(map);
  for (std::size_t i = 0; i < in.bodies.owned().size(); ++i) {
    const BodyState& state = in.bodies.owned()[i].state;
    const physics::Forces& forces = in.forces[i];
    const double radius_m = in.bodies.radius_m(i);
    const double horizon_s = state.asleep ? 0.0 : horizon_s_;
    double far = radius_m + aura_m_;
    if (!state.asleep) {
      far += Length(Vec3d(state.linear_velocity)) * horizon_s +
             0.5 * Length(forces.acceleration_m_s2) * horizon_s * horizon_s;
    }
    const Cell& cell = cells.At(state.position);
    if (cell.owner == in.neighborhood.self() && InsideOf(cell, state.position) > far) continue;
    const BodyDef& def = *in.bodies.owned()[i].def;
    const Aabb box = physics::SweptBounds(def, state, forces, radius_m, horizon_s).Expanded(aura_m_);
    for (std::size_t n = 0; n < in.neighborhood.size(); ++n) {
      if (map.Reaches(in.neighborhood[n], box)) table_.Mark(i, n);
    }
  }
}

// Before the first step no neighbour has reported anything: owned bodies may belong to one island by bodies of others.
// A few are all relevant to everyone; of more, those near a border are.
void Relevance::MarkFirst(const Inputs& in) {
  constexpr std::size_t kFew = 256;
  const std::size_t own = in.bodies.owned().size();
  for (std::size_t body = 0; body < own; ++body) {
    MarkAround(body, in.bodies.world().BoundsOf(in.bodies.owned()[body].def->id), in.neighborhood, table_);
    for (std::size_t n = 0; own <= kFew && n < in.neighborhood.size(); ++n) table_.Mark(body, n);
  }
}

// A body near another's is relevant to the other's owner, and to the owner of the cell that the other lies in.
void Relevance::MarkNearOthers(const Inputs& in) {
  const Bodies& bodies = in.bodies;
  const auto mark_about = [&](BodyId id, RegionId owner) {
    const std::ptrdiff_t to = in.neighborhood.IndexOf(owner);
    const std::ptrdiff_t at =
        in.neighborhood.IndexOf(in.neighborhood.map().OwnerOf(bodies.world().StateOf(id).position));
    places_.clear();
    bodies.AddNear(id, &places_);
    for (const std::uint32_t near : places_) {
      if (near >= bodies.owned().size()) continue;
      if (to >= 0) table_.Mark(near, static_cast<std::size_t>(to));
      if (at >= 0) table_.Mark(near, static_cast<std::size_t>(at));
    }
  };
  for (const Ghost& ghost : bodies.ghosts()) mark_about(ghost.record.id, ghost.owner);
  for (const DepartingBody& body : in.departing) {
    if (bodies.IndexOf(body.record.id) >= 0) mark_about(body.record.id, body.to);
  }
}

bool Relevance::Moves(std::size_t body, const Bodies& bodies) const {
  return still_ticks_[body] < kSettledTicks && !bodies.owned()[body].state.asleep;
}

void Relevance::MarkDeeper(const Inputs& in) {
  if (ghost_depth_ == 0 || !in.bodies.stepped() || !table_.Any()) return;
  for (std::size_t n = 0; n < in.neighborhood.size(); ++n) {
    edge_.clear();
    for (std::size_t i = 0; i < in.bodies.owned().size(); ++i) {
      if (table_.To(i, n) && Moves(i, in.bodies)) edge_.push_back(i);
    }
    for (std::uint32_t layer = 0; layer < ghost_depth_ && !edge_.empty(); ++layer) MarkLayer(in.bodies, n);
  }
}

// Goes one contact deeper from edge_, which becomes those of the new layer that move.
void Relevance::MarkLayer(const Bodies& bodies, std::size_t neighbor) {
  next_edge_.clear();
  for (const std::size_t body : edge_) {
    places_.clear();
    bodies.world().AddTouching(bodies.owned()[body].def->id, &places_);
    for (const std::uint32_t other : places_) {
      if (other >= bodies.owned().size() || table_.To(other, neighbor)) continue;
      table_.Mark(other, neighbor);
      if (Moves(other, bodies)) next_edge_.push_back(other);
    }
  }
  std::swap(edge_, next_edge_);
}

void Relevance::MarkSleepers(const Inputs& in) {
  for (std::size_t n = 0; n < in.neighborhood.size(); ++n) {
    for (const GhostRecord& sent : in.sent[n]) {
      if (!sent.state.asleep) continue;
      const std::ptrdiff_t index = in.bodies.IndexOf(sent.id);
      if (index < 0) continue;
      const auto i = static_cast<std::size_t>(index);
      if (in.bodies.owned()[i].state.asleep) table_.Mark(i, n);
    }
  }
}

void Relevance::CountStill(const Bodies& bodies) {
  if (!table_.Any()) return std::fill(still_ticks_.begin(), still_ticks_.end(), std::uint8_t{0});
  for (std::size_t i = 0; i < bodies.owned().size(); ++i) {
    const auto moves = [&, &state = bodies.owned()[i].state] {
      const float rim_m_s = Length(state.angular_velocity) * static_cast<float>(bodies.radius_m(i));
      return Length(state.linear_velocity) + rim_m_s > kSettled_m_s;
    };
    const bool still = table_.ToAny(i) && !moves();
    still_ticks_[i] = still ? std::min<std::uint8_t>(still_ticks_[i] + 1, kSettledTicks) : std::uint8_t{0};
  }
}

void Relevance::MarkAssemblies(const Bodies& bodies) {
  if (!bodies.has_joints() || !table_.Any()) return;
  for (std::size_t i = 0; i < bodies.owned().size(); ++i) {
    if (bodies.AssemblyOf(bodies.owned()[i].def->id).size() == 1) continue;
    const std::vector<std::size_t> members = bodies.OwnedAssembly(i);
    if (members.front() == i) table_.Unite(members);
  }
}

bool Relevance::IsSettled(std::size_t body, const OwnedBody& owned) const {
  return still_ticks_[body] >= kSettledTicks && !owned.state.asleep && !islands_.IsWhole(body) &&
         !IsPlayerBody(owned.def->id);
}

void Relevance::Validate(const Bodies& bodies) const {
  islands_.Validate(bodies);
  still_ticks_.Validate();
  assert(still_ticks_.size() == bodies.owned().size());
}

}  // namespace tessera::region
