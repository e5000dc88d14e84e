// Which function searches which pair.
#include <algorithm>
#include <cassert>
#include <cmath>
#include <utility>

#include "core/physics/collide/primary_pairs.h"
#include "core/physics/tuning.h"

namespace tessera::physics {
namespace {

// The simpler of two is b: its place in the other's frame is exact where the other is large. Of two that are alike, b
// is the smaller.
int RankOf(const Geometry& geometry) {
  switch (geometry.kind) {
    case GeometryKind::kSphere:
      return 0;
    case GeometryKind::kCapsule:
      return 1;
    case GeometryKind::kMesh:
    case GeometryKind::kHeightField:
    case GeometryKind::kPlane:
      return -1;  // always b: a is what may touch it, anywhere on it
    default:
      return 2;
  }
}

// Whether to look at all pairs of edges. Beyond kEdgePairs that costs more than GJK.
bool Polyhedral(const Geometry& a, const Geometry& b) {
  const auto flat = [](const Geometry& g) { return g.kind == GeometryKind::kBox || g.kind == GeometryKind::kHull; };
  return flat(a) && flat(b) && a.polyhedron->edges.size() * b.polyhedron->edges.size() <= kEdgePairs;
}

void CollideWithSphere(const Geometry& a, const Geometry& b, const LocalPose& pose, float speculative_m,
                       ConvexCache& cache, LocalManifold* out) {
  switch (a.kind) {
    case GeometryKind::kSphere:
      return CollideSpheres(a, b, pose, speculative_m, out);
    case GeometryKind::kCapsule:
      return CollideCapsuleSphere(a, b, pose, speculative_m, out);
    case GeometryKind::kBox:
      return CollideBoxSphere(a, b, pose, speculative_m, out);
    case GeometryKind::kHull:
      return CollideHullSphere(a, b, pose, speculative_m, out);
    default:
      return CollideConvexPair(a, b, pose, speculative_m, cache, out);
  }
}

void CollideWithCapsule(const Geometry& a, const Geometry& b, const LocalPose& pose, float speculative_m,
                        ConvexCache& cache, LocalManifold* out) {
  switch (a.kind) {
    case GeometryKind::kCapsule:
      return CollideCapsules(a, b, pose, speculative_m, out);
    case GeometryKind::kBox:
      return CollideBoxCapsule(a, b, pose, speculative_m, out);
    case GeometryKind::kHull:
      return CollideHullCapsule(a, b, pose, speculative_m, out);
    default:
      return CollideConvexPair(a, b, pose, speculative_m, cache, out);
  }
}

// As `Grazes` of boxes (box_box.cpp), for a box and what has edges but is none: only the box's own axes are looked
// along.
bool Grazes(const Geometry& box, const Geometry& other, const LocalPose& other_in_box, Vec3f normal) {
  constexpr float kAthwart = 0.5f;
  const Vec3f h = box.half_extents_m, at = other_in_box.position;
  const Bounds bounds = BoundsOf(other, other_in_box.rotation);
  const float size = std::min({h.x, h.y, h.z, other.middle_radius_m});
  const float thin = std::min(kGraze_m, kGrazeShare * size);
  const auto athwart = [&](float along, float half, float low, float high) {
    return std::abs(std::max(low, -high) - half) < thin && std::abs(along) < kAthwart;
  };
  return athwart(normal.x, h.x, at.x + bounds.min.x, at.x + bounds.max.x) ||
         athwart(normal.y, h.y, at.y + bounds.min.y, at.y + bounds.max.y) ||
         athwart(normal.z, h.z, at.z + bounds.min.z, at.z + bounds.max.z);
}

// Neither is a sphere or a capsule, nor are both boxes.
void CollideEdged(const Geometry& a, const Geometry& b, const LocalPose& pose, float speculative_m, ConvexCache& cache,
                  LocalManifold* out) {
  if (Polyhedral(a, b)) {
    CollideHulls(a, b, pose, speculative_m, cache, out);
  } else {
    CollideConvexPair(a, b, pose, speculative_m, cache, out);
  }
  if (out->count == 0) return;
  if ((a.kind == GeometryKind::kBox && Grazes(a, b, pose, out->normal)) ||
      (b.kind == GeometryKind::kBox && Grazes(b, a, Reversed(pose), Into(pose.rotation, out->normal)))) {
    out->count = 0;
  }
}

// In the order that `InOrder` wants.
void CollideOrdered(const Geometry& a, const Geometry& b, const LocalPose& pose, float speculative_m,
                    ConvexCache& cache, LocalManifold* out) {
  out->count = 0;
  out->key = 0;
  if (b.kind == GeometryKind::kSphere) {
    CollideWithSphere(a, b, pose, speculative_m, cache, out);
  } else if (b.kind == GeometryKind::kCapsule) {
    CollideWithCapsule(a, b, pose, speculative_m, cache, out);
  } else if (a.kind == GeometryKind::kBox && b.kind == GeometryKind::kBox) {
    CollideBoxes(a, b, pose, speculative_m, cache, out);
  } else {
    CollideEdged(a, b, pose, speculative_m, cache, out);
  }
}

}  // namespace

bool InOrder(const Geometry& a, const Geometry& b) {
  const int rank_a = RankOf(a), rank_b = RankOf(b);
  return rank_a > rank_b || (rank_a == rank_b && a.outer_radius_m >= b.outer_radius_m);
}

LocalPose Reversed(const LocalPose& pose) {
  const Vec3f a_in_b = -Into(pose.rotation, pose.position);
  const Mat3f r = Transposed(pose.rotation);
  const Vec3d p = pose.a_in_b;
  // b's origin as a sees it, in doubles again.
  const Vec3d b_in_a = -(Vec3d(pose.rotation.x) * p.x + Vec3d(pose.rotation.y) * p.y + Vec3d(pose.rotation.z) * p.z);
  return {.position = a_in_b, .rotation = r, .a_in_b = b_in_a};
}

LocalManifold Reversed(const LocalManifold& manifold, const LocalPose& pose) {
  LocalManifold result = manifold;
  result.normal = -Into(pose.rotation, manifold.normal);
  for (std::size_t i = 0; i < static_cast<std::size_t>(manifold.count); ++i) {
    result.points[i].on_a = Into(pose.rotation, manifold.points[i].on_b - pose.position);
    result.points[i].on_b = Into(pose.rotation, manifold.points[i].on_a - pose.position);
  }
  return result;
}

void CollideConvex(const Geometry& a, const Geometry& b, const LocalPose& pose, float speculative_m, ConvexCache& cache,
                   LocalManifold* out) {
  if (InOrder(a, b)) return CollideOrdered(a, b, pose, speculative_m, cache, out);
  const LocalPose reversed = Reversed(pose);
  CollideOrdered(b, a, reversed, speculative_m, cache, out);
  if (out->count > 0) *out = Reversed(*out, reversed);
}

void CollideLocal(const Geometry& a, const Geometry& b, const LocalPose& pose, float speculative_m, PartCaches& parts,
                  std::vector<LocalManifold>* out) {
  if (a.convex() && b.convex()) {
    if (parts.empty()) parts.resize(1);
    LocalManifold manifold;
    CollideConvex(a, b, pose, speculative_m, parts[0].cache, &manifold);
    if (manifold.count > 0) out->push_back(manifold);
    return;
  }
  if (!InOrder(a, b)) {
    const LocalPose reversed = Reversed(pose);
    const std::size_t first = out->size();
    CollideLocal(b, a, reversed, speculative_m, parts, out);
    for (std::size_t i = first; i < out->size(); ++i) (*out)[i] = Reversed((*out)[i], reversed);
    return;
  }
  if (a.kind == GeometryKind::kCompound || b.kind == GeometryKind::kCompound) {
    CollideCompound(a, b, pose, speculative_m, parts, out);
  } else if (b.kind == GeometryKind::kMesh) {
    CollideMesh(a, b, pose, speculative_m, parts, out);
  } else if (b.kind == GeometryKind::kHeightField) {
    CollideHeightField(a, b, pose, speculative_m, parts, out);
  } else {
    assert(b.kind == GeometryKind::kPlane && a.convex());
    LocalManifold manifold;
    CollidePlane(a, PlaneIn(b, pose), speculative_m, &manifold);
    if (manifold.count > 0) out->push_back(manifold);
  }
}

}  // namespace tessera::physics
