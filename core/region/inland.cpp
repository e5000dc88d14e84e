#include "core/region/inland.h"

#include <algorithm>
#include <cmath>

#include "core/region/cell_finder.h"

namespace tessera::region {
namespace {

// The most that any body has of each.
struct Most {
  Rect area;
  float speed_2 = 0;  // m^2/s^2
  double radius_m = 0, gravity_scale = 0;
};

Most MostOf(const Bodies& bodies) {
  const Vec3d first = bodies.owned().front().state.position;
  Most most{.area = {first.x, first.z, first.x, first.z}};
  Rect& area = most.area;
  for (std::size_t i = 0; i < bodies.owned().size(); ++i) {
    const OwnedBody& body = bodies.owned()[i];
    const Vec3d& at = body.state.position;
    area = {std::min(area.min_x, at.x), std::min(area.min_z, at.z), std::max(area.max_x, at.x),
            std::max(area.max_z, at.z)};
    most.speed_2 = std::max(most.speed_2, LengthSquared(body.state.linear_velocity));
    most.radius_m = std::max(most.radius_m, bodies.radius_m(i));
    most.gravity_scale = std::max(most.gravity_scale, std::abs(body.gravity_scale));
  }
  return most;
}

}  // namespace

bool AllInland(const Bodies& bodies, const Neighborhood& neighborhood, const RegionSettings& settings,
               Vec3d gravity_m_s2, double tick_s) {
  constexpr double kRounded = 1 + 1e-5;  // speeds are squared in single precision
  if (bodies.owned().empty()) return true;
  const Most most = MostOf(bodies);
  const Vec3d low{most.area.min_x, 0, most.area.min_z}, high{most.area.max_x, 0, most.area.max_z};
  const Cell& cell = neighborhood.map().CellAt(low.x, low.z);
  if (cell.owner != neighborhood.self()) return false;
  const double horizon_s = (settings.promise_ticks + settings.lookahead_ticks) * tick_s;
  const double acceleration = Length(gravity_m_s2) * most.gravity_scale;
  const double speed = std::sqrt(static_cast<double>(most.speed_2));
  const double far = most.radius_m + settings.aura_m + horizon_s * (speed + 0.5 * acceleration * horizon_s);
  return std::min(InsideOf(cell, low), InsideOf(cell, high)) > far * kRounded;
}

}  // namespace tessera::region
