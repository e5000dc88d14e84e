#include "core/physics/sphere_sweep.h"

#include <algorithm>

#include "core/physics/motion/sweep.h"

namespace tessera::physics {
namespace {

// Bounds of a way are in single precision; this covers the rounding 10 km from the origin, m.
constexpr double kBoundsSlack_m = 0.01;

Geometry SphereOf(double radius_m) {
  Geometry sphere;
  sphere.kind = GeometryKind::kSphere;
  sphere.radius_m = sphere.inner_radius_m = sphere.outer_radius_m = sphere.middle_radius_m =
      static_cast<float>(radius_m);
  return sphere;
}

}  // namespace

Aabb BoundsOf(const SphereWay& way) {
  return Aabb{way.from, way.from}.United({way.to, way.to}).Expanded(way.radius_m + kBoundsSlack_m);
}

std::optional<SphereHit> SweepSphere(std::span<const RigidBody* const> near, const SphereWay& way) {
  const Geometry sphere = SphereOf(way.radius_m);
  const SweptMotion motion{sphere, way.from, way.to, Quatd(), Vec3d()};
  std::optional<SphereHit> first;
  for (const RigidBody* body : near) {
    if (body->id() == way.ignored || body->trigger() || !body->layer().CollidesWith(way.layer)) continue;
    const Vec3d at = body->placement().position;
    const SweptMotion still{body->geometry(), at, at, body->placement().orientation, Vec3d()};
    const std::optional<Impact> impact = FirstImpact(still, motion, static_cast<float>(kSweptGap_m));
    if (!impact.has_value()) continue;
    const bool sooner = !first.has_value() || impact->fraction < first->fraction ||
                        (impact->fraction == first->fraction && body->id() < first->body);
    if (!sooner) continue;
    first = SphereHit{.body = body->id(),
                      .center = way.from + (way.to - way.from) * impact->fraction,
                      .normal = Normalized(Vec3d(impact->normal)),
                      .fraction = impact->fraction};
  }
  return first;
}

}  // namespace tessera::physics
