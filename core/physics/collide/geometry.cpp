#include "core/physics/collide/geometry.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/physics/collide/hull.h"

namespace tessera::physics {
namespace {

// Radius of the largest ball about `center` inside the hull; negative where the center lies outside.
float RadiusAbout(Vec3f center, const Polyhedron& hull) {
  float radius = std::numeric_limits<float>::max();
  for (const Polyhedron::Face& face : hull.faces) radius = std::min(radius, face.offset_m - Dot(face.normal, center));
  return radius;
}

struct FillGeometry {
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
    for (const Vec3f& p : hull.points) points.push_back(Vec3f(frame.FromShape(Vec3d(p))));
    out.polyhedron = HullOf(points);
    out.inner_radius_m = std::max(RadiusAbout({}, *out.polyhedron), 0.0f);
    out.middle = out.polyhedron->inside;
    out.middle_radius_m = RadiusAbout(out.middle, *out.polyhedron);
    for (const Vec3f& v : out.polyhedron->vertices) out.outer_radius_m = std::max(out.outer_radius_m, Length(v));
  }

  void operator()(const CompoundShape& compound) const {
    out.kind = GeometryKind::kCompound;
    for (const CompoundChild& part : compound.children) {
      const Pose pose = frame.FromShape(part.pose);
      const Vec3f position(pose.position);
      const std::shared_ptr<const Geometry> geometry = MakeGeometry(*part.shape, {});
      out.children.push_back({geometry, position, RotationOf(Normalized(pose.orientation))});
      const float away = Length(position);
      out.inner_radius_m = std::max(out.inner_radius_m, geometry->inner_radius_m - away);
      out.outer_radius_m = std::max(out.outer_radius_m, geometry->outer_radius_m + away);
    }
  }

  void operator()(const TriangleMeshShape& mesh) const {
    out.kind = GeometryKind::kMesh;
    out.surface = std::make_shared<const Surface>(mesh);
    for (const Vec3f& v : mesh.vertices) out.outer_radius_m = std::max(out.outer_radius_m, Length(v));
  }

  void operator()(const HeightFieldShape& field) const {
    out.kind = GeometryKind::kHeightField;
    out.surface = std::make_shared<const Surface>(field, frame);
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

}  // namespace

std::shared_ptr<const Geometry> MakeGeometry(const Shape& shape, const BodyFrame& frame) {
  auto geometry = std::make_shared<Geometry>();
  std::visit(FillGeometry{frame, *geometry}, shape.form);
  if (geometry->convex() && geometry->middle_radius_m == 0) geometry->middle_radius_m = geometry->inner_radius_m;
  return geometry;
}

}  // namespace tessera::physics
