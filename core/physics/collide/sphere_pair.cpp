// Spheres against spheres, capsules, boxes and hulls, in closed form.
#include <algorithm>
#include <cmath>

#include "core/physics/collide/polyhedron.h"
#include "core/physics/collide/primary_pairs.h"

namespace tessera::physics {
namespace {

// One point between a ball of `radius_a` about `at_a` and a ball of `radius_b` about `at_b`.
void CollideBalls(Vec3f at_a, float radius_a, Vec3f at_b, float radius_b, Vec3f fallback, float speculative_m,
                  LocalManifold* out) {
  out->count = 0;
  const Vec3f between = at_b - at_a;
  const float reach = radius_a + radius_b + speculative_m, square = LengthSquared(between);
  if (square > reach * reach) return;
  const float distance = std::sqrt(square);
  out->normal = distance > 0 ? between / distance : fallback;
  out->count = 1;
  out->points[0] = {.on_a = at_a + out->normal * radius_a,
                    .on_b = at_b - out->normal * radius_b,
                    .separation_m = distance - radius_a - radius_b,
                    .feature = 0};
}

// A ball about `center` whose nearest surface point of a is `surface`, `height` above it (below: negative), along the
// unit `normal` out of a.
void CollideSurface(Vec3f center, float radius, Vec3f surface, Vec3f normal, float height, std::uint32_t feature,
                    LocalManifold* out) {
  out->normal = normal;
  out->count = 1;
  out->points[0] = {
      .on_a = surface, .on_b = center - normal * radius, .separation_m = height - radius, .feature = feature};
}

}  // namespace

void CollideSpheres(const Geometry& a, const Geometry& b, const LocalPose& pose, float speculative_m,
                    LocalManifold* out) {
  CollideBalls({}, a.radius_m, pose.position, b.radius_m, {0, 1, 0}, speculative_m, out);
}

void CollideCapsuleSphere(const Geometry& a, const Geometry& b, const LocalPose& pose, float speculative_m,
                          LocalManifold* out) {
  const Vec3f nearest{0, std::clamp(pose.position.y, -a.half_height_m, a.half_height_m), 0};
  CollideBalls(nearest, a.radius_m, pose.position, b.radius_m, {1, 0, 0}, speculative_m, out);
}

void CollideBoxSphere(const Geometry& a, const Geometry& b, const LocalPose& pose, float speculative_m,
                      LocalManifold* out) {
  out->count = 0;
  const Vec3f c = pose.position, h = a.half_extents_m;
  const Vec3f nearest{std::clamp(c.x, -h.x, h.x), std::clamp(c.y, -h.y, h.y), std::clamp(c.z, -h.z, h.z)};
  const Vec3f away = c - nearest;
  const float square = LengthSquared(away), reach = b.radius_m + speculative_m;
  if (square > reach * reach) return;
  if (square > 0) {
    const float distance = std::sqrt(square);
    CollideSurface(c, b.radius_m, nearest, away / distance, distance, 0, out);
    return;
  }
  // The centre is inside: out through the nearest face.
  const float depth[3] = {h.x - std::abs(c.x), h.y - std::abs(c.y), h.z - std::abs(c.z)};
  const int i = depth[0] <= depth[1] && depth[0] <= depth[2] ? 0 : depth[1] <= depth[2] ? 1 : 2;
  Vec3f normal, surface = c;
  if (i == 0) {
    normal.x = c.x >= 0 ? 1.0f : -1.0f, surface.x = normal.x * h.x;
  } else if (i == 1) {
    normal.y = c.y >= 0 ? 1.0f : -1.0f, surface.y = normal.y * h.y;
  } else {
    normal.z = c.z >= 0 ? 1.0f : -1.0f, surface.z = normal.z * h.z;
  }
  CollideSurface(c, b.radius_m, surface, normal, -depth[i], 0, out);
}

void CollideHullSphere(const Geometry& a, const Geometry& b, const LocalPose& pose, float speculative_m,
                       LocalManifold* out) {
  out->count = 0;
  const PolyhedronPoint near = NearestOn(*a.polyhedron, pose.position, b.radius_m + speculative_m);
  if (near.distance_m > b.radius_m + speculative_m) return;
  CollideSurface(pose.position, b.radius_m, near.point, near.normal, near.distance_m, 0, out);
}

}  // namespace tessera::physics
