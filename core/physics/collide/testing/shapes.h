// Geometries and poses for the tests of this folder.
#pragma once

#include <cmath>
#include <memory>
#include <random>
#include <utility>
#include <vector>

#include "core/physics/collide/pair_functions.h"
#include "core/physics/testing/turns.h"

namespace tessera::physics {

template <class Form>
std::shared_ptr<const Geometry> GeometryOf(Form form) {
  return MakeGeometry(Shape{std::move(form)}, {});
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

class Draw {
 public:
  explicit Draw(std::uint32_t seed) : random_(seed) {}
  double In(double low, double high) { return low + (high - low) * (static_cast<double>(random_()) / 4294967295.0); }
  Vec3d Direction() {
    for (;;) {
      const Vec3d v{In(-1, 1), In(-1, 1), In(-1, 1)};
      if (Length(v) > 0.1 && Length(v) <= 1) return Normalized(v);
    }
  }
  Quatd Turn() { return About(Direction(), In(-3.1, 3.1)); }
  // A fifth of them nearly aligned, as boxes mostly are.
  Quatd OftenAligned() {
    const double kind = In(0, 1);
    if (kind < 0.1) return About({0, 1, 0}, In(-3, 3));
    if (kind < 0.2) return About(Direction(), In(-1e-3, 1e-3));
    return Turn();
  }
  std::uint32_t Index(std::size_t size) { return static_cast<std::uint32_t>(random_() % size); }

 private:
  std::mt19937 random_;
};

inline ConvexHullShape RandomHull(Draw& draw, int points) {
  ConvexHullShape hull;
  for (int i = 0; i < points; ++i) hull.points.push_back(Vec3f(draw.Direction() * draw.In(0.3, 0.6)));
  return hull;
}

}  // namespace tessera::physics
