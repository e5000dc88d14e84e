#include "core/world/level_bounds.h"

#include <cassert>
#include <cmath>

namespace tessera {
namespace {

// Bounds of what lies within a ball about the origin.
Aabb BallAt(const Pose& pose, double radius_m) { return Aabb{pose.position, pose.position}.Expanded(radius_m); }

struct FormBounds {
  const Pose& pose;

  Aabb Box(Vec3d half) const {
    GrowingBounds bounds;
    for (int corner = 0; corner < 8; ++corner) {
      const auto side = [&](int bit, double along) { return (corner >> bit & 1) != 0 ? along : -along; };
      bounds.Add(PlacedAt(pose, {side(0, half.x), side(1, half.y), side(2, half.z)}));
    }
    return bounds.Get();
  }
  Aabb Points(std::span<const Vec3f> points) const {
    GrowingBounds bounds;
    for (const Vec3f& point : points) bounds.Add(PlacedAt(pose, Vec3d(point)));
    return bounds.Get();
  }
  Aabb operator()(const BoxShape& s) const { return Box(s.half_extents_m); }
  Aabb operator()(const SphereShape& s) const { return BallAt(pose, s.radius_m); }
  Aabb operator()(const CapsuleShape& s) const { return BallAt(pose, s.radius_m + s.half_height_m); }
  Aabb operator()(const CylinderShape& s) const { return Box({s.radius_m, s.half_height_m, s.radius_m}); }
  Aabb operator()(const ConeShape& s) const { return Box({s.radius_m, s.height_m / 2, s.radius_m}); }
  Aabb operator()(const ConvexHullShape& s) const { return Points(s.points); }
  Aabb operator()(const CompoundShape& s) const {
    GrowingBounds bounds;
    for (const CompoundChild& child : s.children) {
      bounds.Add(
          BoundsOf(*child.shape, {PlacedAt(pose, child.pose.position), pose.orientation * child.pose.orientation}));
    }
    return bounds.Get();
  }
  Aabb operator()(const TriangleMeshShape& s) const { return Points(s.vertices); }
  Aabb operator()(const HeightFieldShape& s) const {
    GrowingBounds bounds;
    for (std::uint32_t row = 0; row < s.rows; ++row) {
      for (std::uint32_t column = 0; column < s.columns; ++column) {
        bounds.Add(PlacedAt(pose, SampleAt(s, column, row)));
      }
    }
    return bounds.Get();
  }
  Aabb operator()(const PlaneShape&) const {
    assert(false);
    return {};
  }
};

}  // namespace

Aabb BoundsOf(const Shape& shape, const Pose& pose) { return std::visit(FormBounds{pose}, shape.form); }

}  // namespace tessera
