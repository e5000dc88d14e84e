// Convex shapes above a plane.
#include <absl/container/inlined_vector.h>

#include <algorithm>
#include <cmath>

#include "core/physics/collide/pair_functions.h"
#include "core/physics/collide/polyhedron.h"

namespace tessera::physics {
namespace {

// Points of a face that need no memory of their own.
constexpr std::size_t kUsualFaceVertices = 8;

LocalPoint PointOver(const LocalPlane& plane, Vec3f at, float height, std::uint32_t feature) {
  return {.on_a = at, .on_b = at - plane.normal * height, .separation_m = height, .feature = feature};
}

void CollideBall(Vec3f center, float radius, const LocalPlane& plane, std::uint32_t feature, float speculative_m,
                 LocalManifold* out) {
  const float height = Dot(plane.normal, center) - plane.offset_m - radius;
  if (height > speculative_m) return;
  out->points[static_cast<std::size_t>(out->count++)] =
      PointOver(plane, center - plane.normal * radius, height, feature);
}

// The four corners of the face that looks down most: the nearest corner is one of them.
void CollideBox(Vec3f h, const LocalPlane& plane, float speculative_m, LocalManifold* out) {
  const Vec3f n = plane.normal;
  const float reach = std::abs(n.x) * h.x + std::abs(n.y) * h.y + std::abs(n.z) * h.z;
  if (-reach - plane.offset_m > speculative_m) return;
  const float along[3] = {n.x, n.y, n.z}, half[3] = {h.x, h.y, h.z};
  int i = 0;
  for (int k = 1; k < 3; ++k)
    if (std::abs(along[k]) > std::abs(along[i])) i = k;
  const int i1 = (i + 1) % 3, i2 = (i + 2) % 3;
  for (std::uint32_t k = 0; k < 4; ++k) {
    float corner[3];
    corner[i] = along[i] > 0 ? -half[i] : half[i];
    corner[i1] = k & 1 ? half[i1] : -half[i1];
    corner[i2] = k & 2 ? half[i2] : -half[i2];
    const Vec3f at{corner[0], corner[1], corner[2]};
    const float height = Dot(n, at) - plane.offset_m;
    if (height > speculative_m) continue;
    const std::uint32_t face = static_cast<std::uint32_t>(2 * i + (along[i] > 0));
    out->points[static_cast<std::size_t>(out->count++)] = PointOver(plane, at, height, face << 2 | k);
  }
}

// Takes the face that looks down most among those that hold the lowest corner.
void CollideHull(const Polyhedron& hull, const LocalPlane& plane, float speculative_m, LocalManifold* out) {
  const std::uint32_t lowest = SupportVertex(hull, -plane.normal);
  if (Dot(plane.normal, hull.vertices[lowest]) - plane.offset_m > speculative_m) return;
  const Polyhedron::Face* bottom = hull.faces.data();
  float best = 2;
  for (const Polyhedron::Face& face : hull.faces) {
    const float cosine = Dot(face.normal, plane.normal);
    const auto loop = hull.loops.begin() + face.first;
    if (cosine < best && std::find(loop, loop + face.count, lowest) != loop + face.count) bottom = &face, best = cosine;
  }
  absl::InlinedVector<LocalPoint, kUsualFaceVertices> points;
  for (std::uint32_t k = 0; k < bottom->count; ++k) {
    const std::uint32_t v = hull.loops[bottom->first + k];
    const float height = Dot(plane.normal, hull.vertices[v]) - plane.offset_m;
    if (height <= speculative_m) points.push_back(PointOver(plane, hull.vertices[v], height, v));
  }
  Reduce({points.data(), points.size()}, out->normal, out);
}

}  // namespace

LocalPlane PlaneIn(const Geometry& plane, const LocalPose& plane_in_a) {
  // In doubles: the plane's origin may be far from a.
  const double along = Dot(Vec3d(plane.plane_normal), plane_in_a.a_in_b);
  return {.normal = plane_in_a.rotation * plane.plane_normal,
          .offset_m = static_cast<float>(plane.plane_offset_m - along)};
}

void CollidePlane(const Geometry& a, const LocalPlane& plane, float speculative_m, LocalManifold* out) {
  out->count = 0;
  out->normal = -plane.normal;
  switch (a.kind) {
    case GeometryKind::kSphere:
      CollideBall({}, a.radius_m, plane, 0, speculative_m, out);
      return;
    case GeometryKind::kCapsule:
      CollideBall({0, a.half_height_m, 0}, a.radius_m, plane, 0, speculative_m, out);
      CollideBall({0, -a.half_height_m, 0}, a.radius_m, plane, 1, speculative_m, out);
      return;
    case GeometryKind::kBox:
      CollideBox(a.half_extents_m, plane, speculative_m, out);
      return;
    case GeometryKind::kHull:
      CollideHull(*a.polyhedron, plane, speculative_m, out);
      return;
    default:
      CollideRoundPlane(a, plane, speculative_m, out);
  }
}

}  // namespace tessera::physics
