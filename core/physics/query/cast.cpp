#include "core/physics/query/cast.h"

#include <algorithm>
#include <cassert>
#include <limits>

#include "core/physics/collide/gjk.h"

namespace tessera::physics {
namespace {

constexpr int kCastIterations = 64;
// From here on, m, the rest of the way is taken in one step along the axis; GJK tells shapes apart that are further
// from each other than a ten-millionth of their size.
constexpr double kTouch_m = 1e-6, kTouchShare = 1e-6;

std::shared_ptr<const Geometry> GeometryOfProbe(const QueryShape& shape) {
  if (const auto* sphere = std::get_if<SphereShape>(&shape)) return MakeGeometry({*sphere}, {});
  if (const auto* capsule = std::get_if<CapsuleShape>(&shape)) return MakeGeometry({*capsule}, {});
  assert(std::holds_alternative<BoxShape>(shape));
  return MakeGeometry({std::get<BoxShape>(shape)}, {});
}

}  // namespace

Probe::Probe(const QueryShape& shape, Quatd orientation)
    : geometry_(GeometryOfProbe(shape)), orientation_(orientation) {}

Probe::Turned Probe::In(Quatd frame) const {
  const Quatd q = Conjugate(frame) * orientation_;
  Turned turned{Core(AtOrigin(*geometry_), 0), {Rotate(q, {1, 0, 0}), Rotate(q, {0, 1, 0}), Rotate(q, {0, 0, 1})}};
  turned.size_m = geometry_->outer_radius_m;
  turned.half_m = {turned.Reach({1, 0, 0}), turned.Reach({0, 1, 0}), turned.Reach({0, 0, 1})};
  return turned;
}

double Probe::Turned::Reach(Vec3d direction) {
  core.Place({}, axes);
  return Dot(direction, core.Support(direction)) + core.radius() * Length(direction);
}

std::optional<SurfaceHit> CastAtConvex(const Convex& target, double size_m, Probe::Turned& probe, const LocalRay& ray,
                                       int* steps) {
  const Core core(target, 0);
  const double radii = core.radius() + probe.core.radius();
  const double near = std::max(kTouch_m, kTouchShare * (size_m + probe.size_m));
  double t = 0;
  SurfaceHit hit{0, ray.from, ray.Back()};
  for (int i = 0; i < kCastIterations; ++i) {
    ++*steps;
    probe.core.Place(ray.At(t), probe.axes);
    const GjkResult found = Gjk(core, probe.core, ray.At(t), std::numeric_limits<double>::infinity());
    // Rounding alone makes the two overlap on the way; then the last axis counts.
    if (found.kind != GjkResult::Kind::kApart || found.distance_m <= radii) {
      hit.fraction = t;
      return hit;
    }
    const double distance = found.distance_m - radii, approach = -Dot(found.axis, ray.along);
    if (approach <= 0) return {};
    hit.point = found.on_a + found.axis * core.radius();
    hit.normal = found.axis;
    if (distance <= near) {
      hit.fraction = t + distance / approach;
      return hit.fraction <= 1 ? std::optional(hit) : std::nullopt;
    }
    t += (distance - near / 2) / approach;
    if (t > 1) return {};
  }
  // It is nearer than any step could tell, and not past the impact.
  hit.fraction = t;
  return hit;
}

std::optional<SurfaceHit> CastAtPlane(const Geometry& plane, Probe::Turned& probe, const LocalRay& ray) {
  const Vec3d normal(plane.plane_normal);
  const double lowest = probe.Reach(-normal);
  const double height = Dot(normal, ray.from) - plane.plane_offset_m - lowest, approach = -Dot(normal, ray.along);
  if (height <= 0) return SurfaceHit{0, ray.from, ray.Back()};
  if (approach <= 0 || height > approach) return {};
  const double t = height / approach;
  probe.core.Place(ray.At(t), probe.axes);
  return SurfaceHit{t, probe.core.Support(-normal) - normal * probe.core.radius(), normal};
}

}  // namespace tessera::physics
