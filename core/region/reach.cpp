#include "core/region/reach.h"

#include <algorithm>

namespace tessera::region {

Reach::Reach(const PartitionMap& map, RegionId self, std::span<const RegionId> neighbors, const Settings& settings,
             double tick_s)
    : map_(map),
      self_(self),
      neighbors_(neighbors),
      aura_m_(settings.aura_m),
      horizon_s_(settings.lookahead_ticks * tick_s) {}

void Reach::Clear(std::size_t bodies) { seen_.assign(bodies * neighbors_.size(), 0); }

bool Reach::Look(std::size_t body, const BodyDef& def, const BodyState& state, const physics::Forces& forces,
                 double radius_m) {
  const Vec3d p = state.position;
  double reach = radius_m + aura_m_;
  if (!state.asleep) {
    const Vec3d a = forces.acceleration_m_s2;
    reach += Length(Vec3d(state.linear_velocity)) * horizon_s_ + 0.5 * Length(a) * horizon_s_ * horizon_s_;
  }
  const Cell& cell = map_.CellAt(p.x, p.z);
  const Rect& area = cell.area;
  const double inside = std::min({p.x - area.min_x, area.max_x - p.x, p.z - area.min_z, area.max_z - p.z});
  if (cell.owner == self_ && inside > reach) return false;
  const Aabb box =
      physics::SweptBounds(def, state, forces, radius_m, state.asleep ? 0.0 : horizon_s_).Expanded(aura_m_);
  for (std::size_t i = 0; i < neighbors_.size(); ++i) {
    if (map_.Reaches(neighbors_[i], box)) Show(body, i);
  }
  return true;
}

void Reach::Unite(std::span<const std::size_t> bodies) {
  for (std::size_t i = 0; i < neighbors_.size(); ++i) {
    const bool any = std::any_of(bodies.begin(), bodies.end(), [&](std::size_t body) { return Shows(body, i); });
    if (!any) continue;
    for (const std::size_t body : bodies) Show(body, i);
  }
}

}  // namespace tessera::region
