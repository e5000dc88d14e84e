#include "bench/engine_parts.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/physics/mass_properties.h"

namespace tessera::bench {

MassFrame MassFrameOf(const BodyDef& def) {
  if (def.motion != Motion::kDynamic) return {};
  const physics::MassProperties mass = physics::MassPropertiesOf(*def.shape);
  MassFrame frame{.origin = mass.center_of_mass, .axes = {}, .inertia_kg_m2 = {}};
  if (def.inertia_kg_m2) {
    frame.inertia_kg_m2 = *def.inertia_kg_m2;
  } else {
    frame.axes = mass.axes;
    frame.inertia_kg_m2 = mass.principal * def.mass_kg;
  }
  return frame;
}

Pose Compose(const Pose& outer, const Pose& inner) {
  return {outer.position + Rotate(outer.orientation, inner.position),
          Normalized(outer.orientation * inner.orientation)};
}

Quatd TurnFromZ(Vec3d direction) {
  if (direction.z < -1 + 1e-12) return {1, 0, 0, 0};
  const Vec3d axis = Cross(Vec3d{0, 0, 1}, direction);
  return Normalized(Quatd{axis.x, axis.y, axis.z, 1 + direction.z});
}

Pose JointFrame(const MassFrame& mass, const Pose& in_shape) { return Compose(mass.ShapePose(), in_shape); }

double PairFriction(const Material& a, const Material& b) { return std::sqrt(a.friction * b.friction); }
double PairRestitution(const Material& a, const Material& b) { return std::max(a.restitution, b.restitution); }

double CommonRestitution(const Scene& scene) {
  // A pair has the larger one of its two, so statics may have less than the bodies that meet them.
  double common = -1, of_statics = 0;
  for (const BodyDef& body : scene.bodies) {
    if (body.trigger) continue;
    if (body.motion == Motion::kStatic) {
      of_statics = std::max(of_statics, body.material.restitution);
    } else if (common < 0) {
      common = body.material.restitution;
    } else if (body.material.restitution != common) {
      return -1;
    }
  }
  if (common < 0) return of_statics;
  return of_statics > common ? -1 : common;
}

absl::Status Lacking(std::string_view engine, std::string_view what) {
  return absl::UnimplementedError(fmt::format("{}: {}", engine, what));
}

}  // namespace tessera::bench
