// Geometries and poses for the tests of this folder.
#pragma once

#include <cmath>
#include <memory>
#include <utility>
#include <vector>

#include "core/physics/collide/pair_functions.h"

namespace tessera::physics {

template <class Form>
std::shared_ptr<const Geometry> GeometryOf(Form form) {
  return MakeGeometry(std::make_shared<const Shape>(Shape{std::move(form)}), {});
}

inline Quatd About(Vec3d axis, double angle) {
  const Vec3d v = Normalized(axis) * std::sin(angle / 2);
  return {v.x, v.y, v.z, std::cos(angle / 2)};
}

inline LocalPose LocalOf(const Pose& b_in_a) {
  return {Vec3f(b_in_a.position), RotationOf(b_in_a.orientation),
          -Rotate(Conjugate(b_in_a.orientation), b_in_a.position)};
}

inline ConvexHullShape CubeHull(Vec3f center, float half) {
  ConvexHullShape hull;
  for (int i = 0; i < 8; ++i) {
    hull.points.push_back(center + Vec3f{i & 1 ? half : -half, i & 2 ? half : -half, i & 4 ? half : -half});
  }
  return hull;
}

// A prism over a regular polygon, lying along y.
inline ConvexHullShape PrismHull(int corners, float radius, float half_height) {
  ConvexHullShape hull;
  for (int i = 0; i < corners; ++i) {
    const float angle = 6.2831853f * static_cast<float>(i) / static_cast<float>(corners);
    const float x = radius * std::cos(angle), z = radius * std::sin(angle);
    hull.points.push_back({x, -half_height, z});
    hull.points.push_back({x, half_height, z});
  }
  return hull;
}

inline std::vector<std::shared_ptr<const Geometry>> ConvexShapes() {
  return {GeometryOf(SphereShape{0.4}),
          GeometryOf(CapsuleShape{0.3, 0.5}),
          GeometryOf(BoxShape{{0.5, 0.3, 0.7}}),
          GeometryOf(CylinderShape{0.4, 0.6}),
          GeometryOf(ConeShape{0.6, 1.1}),
          GeometryOf(PrismHull(7, 0.5f, 0.4f)),
          GeometryOf(CubeHull({0.2f, 0.1f, -0.1f}, 0.4f))};
}

}  // namespace tessera::physics
