// Bounds of turned geometries, closely about each kind of shape.
#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

#include "core/physics/collide/geometry.h"

namespace tessera::physics {
namespace {

constexpr float kHuge = std::numeric_limits<float>::max();
constexpr Bounds kEmpty{{kHuge, kHuge, kHuge}, {-kHuge, -kHuge, -kHuge}};

Bounds About(Vec3f half) { return {-half, half}; }

// Half extents of a disc with this unit normal.
Vec3f DiscExtents(Vec3f normal, float radius) {
  const auto along = [&](float n) { return radius * std::sqrt(std::max(0.0f, 1 - n * n)); };
  return {along(normal.x), along(normal.y), along(normal.z)};
}

Vec3f Absolute(Vec3f v) { return {std::abs(v.x), std::abs(v.y), std::abs(v.z)}; }

// Bounds of a box that is turned about the origin.
Bounds TurnedBounds(const Bounds& box, const Mat3f& r) {
  const Vec3f half = (box.max - box.min) * 0.5f, center = r * ((box.max + box.min) * 0.5f);
  const Vec3f extent = Absolute(r.x) * half.x + Absolute(r.y) * half.y + Absolute(r.z) * half.z;
  return {center - extent, center + extent};
}

}  // namespace

Bounds BoundsOf(const Geometry& g, const Mat3f& r) {
  switch (g.kind) {
    case GeometryKind::kSphere:
      return About({g.radius_m, g.radius_m, g.radius_m});
    case GeometryKind::kCapsule:
      return About(Absolute(r.y * g.half_height_m) + Vec3f{g.radius_m, g.radius_m, g.radius_m});
    case GeometryKind::kBox:
      return About(Absolute(r.x * g.half_extents_m.x) + Absolute(r.y * g.half_extents_m.y) +
                   Absolute(r.z * g.half_extents_m.z));
    case GeometryKind::kCylinder:
      return About(Absolute(r.y * g.half_height_m) + DiscExtents(r.y, g.radius_m));
    case GeometryKind::kCone: {
      const Vec3f base = r.y * g.base_y_m, rim = DiscExtents(r.y, g.radius_m);
      Bounds bounds{base - rim, base + rim};
      bounds.Include(r.y * (g.base_y_m + 2 * g.half_height_m));
      return bounds;
    }
    case GeometryKind::kHull: {
      Bounds bounds = kEmpty;
      for (const Vec3f& v : g.polyhedron->vertices) bounds.Include(r * v);
      return bounds;
    }
    case GeometryKind::kCompound: {
      Bounds bounds = kEmpty;
      for (const Geometry::Child& child : g.children) {
        const Bounds part = BoundsOf(*child.geometry, r * child.rotation);
        const Vec3f at = r * child.position;
        bounds.Include(at + part.min);
        bounds.Include(at + part.max);
      }
      return bounds;
    }
    case GeometryKind::kMesh:
    case GeometryKind::kHeightField:
      return TurnedBounds(g.surface->bounds(), r);
    case GeometryKind::kPlane:
      break;
  }
  assert(false && "a plane has no bounds");
  return {};
}

}  // namespace tessera::physics
