#include "core/physics/collide/geometry.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/physics/bullet_math.h"
#include "core/physics/collide/polyhedron.h"
#include "core/physics/collide/surface.h"

namespace tessera::physics {
namespace {

constexpr float kHuge = std::numeric_limits<float>::max();

// Of the largest ball about `center` inside of the hull; negative where it lies outside.
float RadiusAbout(Vec3f center, const Polyhedron& hull) {
  float radius = kHuge;
  for (const Polyhedron::Face& face : hull.faces) radius = std::min(radius, face.offset_m - Dot(face.normal, center));
  return radius;
}

struct Fill {
  const BodyFrame& frame;
  Geometry& out;

  void operator()(const SphereShape& sphere) const {
    out.kind = GeometryKind::kSphere;
    out.radius_m = static_cast<float>(sphere.radius_m);
    out.inner_radius_m = out.outer_radius_m = out.radius_m;
  }

  void operator()(const CapsuleShape& capsule) const {
    out.kind = GeometryKind::kCapsule;
    out.radius_m = static_cast<float>(capsule.radius_m);
    out.half_height_m = static_cast<float>(capsule.half_height_m);
    out.inner_radius_m = out.radius_m;
    out.outer_radius_m = out.radius_m + out.half_height_m;
  }

  void operator()(const BoxShape& box) const {
    out.kind = GeometryKind::kBox;
    const Vec3f h = out.half_extents_m = Vec3f(box.half_extents_m);
    out.polyhedron = BoxOf(h);
    out.inner_radius_m = std::min({h.x, h.y, h.z});
    out.outer_radius_m = Length(h);
  }

  void operator()(const CylinderShape& cylinder) const {
    out.kind = GeometryKind::kCylinder;
    out.radius_m = static_cast<float>(cylinder.radius_m);
    out.half_height_m = static_cast<float>(cylinder.half_height_m);
    out.inner_radius_m = std::min(out.radius_m, out.half_height_m);
    out.outer_radius_m = std::sqrt(out.radius_m * out.radius_m + out.half_height_m * out.half_height_m);
  }

  void operator()(const ConeShape& cone) const {
    out.kind = GeometryKind::kCone;
    const double base = -cone.height_m / 2 - frame.origin.y, apex = base + cone.height_m, r = cone.radius_m;
    out.radius_m = static_cast<float>(r);
    out.half_height_m = static_cast<float>(cone.height_m / 2);
    out.base_y_m = static_cast<float>(base);
    const double to_side = apex * r / std::sqrt(r * r + cone.height_m * cone.height_m);
    out.inner_radius_m = static_cast<float>(std::max(0.0, std::min(-base, to_side)));
    out.middle_radius_m =
        static_cast<float>(r * cone.height_m / (r + std::sqrt(r * r + cone.height_m * cone.height_m)));
    out.middle = {0, out.base_y_m + out.middle_radius_m, 0};
    out.outer_radius_m = static_cast<float>(std::max(apex, std::sqrt(r * r + base * base)));
  }

  void operator()(const ConvexHullShape& hull) const {
    out.kind = GeometryKind::kHull;
    std::vector<Vec3f> points;
    const Quatd to_frame = Conjugate(frame.axes);
    for (const Vec3f& p : hull.points) points.push_back(Vec3f(Rotate(to_frame, Vec3d(p) - frame.origin)));
    out.polyhedron = HullOf(points);
    out.inner_radius_m = std::max(RadiusAbout({}, *out.polyhedron), 0.0f);
    out.middle = out.polyhedron->inside;
    out.middle_radius_m = RadiusAbout(out.middle, *out.polyhedron);
    for (const Vec3f& v : out.polyhedron->vertices) out.outer_radius_m = std::max(out.outer_radius_m, Length(v));
  }

  void operator()(const CompoundShape& compound) const {
    out.kind = GeometryKind::kCompound;
    const Quatd to_frame = Conjugate(frame.axes);
    for (const CompoundChild& part : compound.children) {
      const Vec3f position(Rotate(to_frame, part.pose.position - frame.origin));
      const std::shared_ptr<const Geometry> geometry = MakeGeometry(part.shape, {});
      out.children.push_back(
          {geometry, position, RotationOf(Normalized(to_frame * Normalized(part.pose.orientation)))});
      const float away = Length(position);
      out.inner_radius_m = std::max(out.inner_radius_m, geometry->inner_radius_m - away);
      out.outer_radius_m = std::max(out.outer_radius_m, geometry->outer_radius_m + away);
    }
  }

  void operator()(const TriangleMeshShape& mesh) const {
    out.kind = GeometryKind::kMesh;
    out.surface = Surface::Of(mesh, frame);
    for (const Vec3f& v : mesh.vertices) out.outer_radius_m = std::max(out.outer_radius_m, Length(v));
  }

  void operator()(const HeightFieldShape& field) const {
    out.kind = GeometryKind::kHeightField;
    out.surface = Surface::Of(field, frame);
    const auto [low, high] = std::minmax_element(field.heights_m.begin(), field.heights_m.end());
    const double x = field.spacing_m * (field.columns - 1) / 2, z = field.spacing_m * (field.rows - 1) / 2;
    const double y = std::max(std::abs(*low - frame.origin.y), std::abs(*high - frame.origin.y));
    out.outer_radius_m = static_cast<float>(Length(Vec3d{x, y, z}));
  }

  void operator()(const PlaneShape& plane) const {
    out.kind = GeometryKind::kPlane;
    const double length = Length(plane.normal);
    out.plane_normal = Vec3f(plane.normal / length);
    out.plane_offset_m = plane.offset_m / length;
    out.outer_radius_m = std::numeric_limits<float>::infinity();
  }
};

LocalBounds About(Vec3f half) { return {-half, half}; }

void Include(Vec3f point, LocalBounds* bounds) {
  Vec3f &low = bounds->min, &high = bounds->max;
  low = {std::min(low.x, point.x), std::min(low.y, point.y), std::min(low.z, point.z)};
  high = {std::max(high.x, point.x), std::max(high.y, point.y), std::max(high.z, point.z)};
}

constexpr LocalBounds kNothing{{kHuge, kHuge, kHuge}, {-kHuge, -kHuge, -kHuge}};

// Half extents of a disc with this unit normal.
Vec3f DiscExtents(Vec3f normal, float radius) {
  const auto along = [&](float n) { return radius * std::sqrt(std::max(0.0f, 1 - n * n)); };
  return {along(normal.x), along(normal.y), along(normal.z)};
}

Vec3f Absolute(Vec3f v) { return {std::abs(v.x), std::abs(v.y), std::abs(v.z)}; }

LocalBounds BulletBounds(const Geometry& geometry, const Mat3f& r) {
  btTransform transform;
  transform.setOrigin({0, 0, 0});
  transform.setBasis({r.x.x, r.y.x, r.z.x, r.x.y, r.y.y, r.z.y, r.x.z, r.y.z, r.z.z});
  btVector3 low, high;
  geometry.bullet->bullet()->getAabb(transform, low, high);
  return {FromBullet(low), FromBullet(high)};
}

}  // namespace

std::shared_ptr<const Geometry> MakeGeometry(const ShapePtr& shape, const BodyFrame& frame) {
  auto geometry = std::make_shared<Geometry>();
  std::visit(Fill{frame, *geometry}, shape->form);
  if (geometry->convex() && geometry->middle_radius_m == 0) geometry->middle_radius_m = geometry->inner_radius_m;
  if (geometry->kind == GeometryKind::kPlane) {
    geometry->bullet = MakePlane(Vec3d(geometry->plane_normal), geometry->plane_offset_m);
  } else {
    geometry->bullet = MakeShape(*shape, frame);
  }
  return geometry;
}

LocalBounds BoundsOf(const Geometry& g, const Mat3f& r) {
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
      LocalBounds bounds{base - rim, base + rim};
      Include(r.y * (g.base_y_m + 2 * g.half_height_m), &bounds);
      return bounds;
    }
    case GeometryKind::kHull: {
      LocalBounds bounds = kNothing;
      for (const Vec3f& v : g.polyhedron->vertices) Include(r * v, &bounds);
      return bounds;
    }
    case GeometryKind::kCompound: {
      LocalBounds bounds = kNothing;
      for (const Geometry::Child& child : g.children) {
        const LocalBounds part = BoundsOf(*child.geometry, r * child.rotation);
        const Vec3f at = r * child.position;
        Include(at + part.min, &bounds);
        Include(at + part.max, &bounds);
      }
      return bounds;
    }
    default:
      return BulletBounds(g, r);
  }
}

}  // namespace tessera::physics
