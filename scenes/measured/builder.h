// Builder: a scene made by number rather than written down. What all measured scenes are made with.
//
// Promise: the same calls give the same bits on every host: angles and random numbers are reckoned here, without the C
// library's. Ids count from 1 in the order of making. Bodies never sleep unless the scene lets them, since a
// measurement of a sleeper is none: `AllowSleep` sets all at once.
//
//   Builder make("tower");
//   make.Ground({.friction = 0.6});
//   for (int i = 0; i < 10; ++i) make.Dynamic(BoxOf(0.5, 0.5, 0.5), {0, 0.5 + i, 0}, 1.0);
//   Scene scene = make.Take();
//
// Thread rule: one thread at a time.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "core/world/scene.h"

namespace tessera::scenes {

// --- Shapes. Half extents, radii, half heights in m.
ShapePtr BoxOf(double half_x, double half_y, double half_z);
ShapePtr BallOf(double radius_m);
ShapePtr CapsuleOf(double radius_m, double half_height_m);
ShapePtr CylinderOf(double radius_m, double half_height_m);
ShapePtr HullOf(std::vector<Vec3f> points);
ShapePtr PlaneOf(Vec3d normal, double offset_m = 0);
// A grid of `cells` x `cells` squares of `spacing_m`, two triangles each, centred on the origin; `height` of a corner
// by its x and z.
template <class Height>
ShapePtr GridMeshOf(int cells, double spacing_m, Height height);

// --- Numbers that are the same on every host.
struct SinCos {
  double sin, cos;
};
SinCos SinCosOf(double angle_rad);
Quatd Turn(Vec3d unit_axis, double angle_rad);
// Uniform in [0, 1), then the next; SplitMix64.
class Random {
 public:
  explicit Random(std::uint64_t seed) : state_(seed) {}
  double Unit();
  double Between(double low, double high) { return low + (high - low) * Unit(); }

 private:
  std::uint64_t state_;
};

class Builder {
 public:
  explicit Builder(std::string name);

  // Solid below y = 0.
  BodyId Ground(Material material = {});
  // The references hold until the next body or joint.
  BodyDef& Static(ShapePtr shape, Vec3d position, Material material = {});
  BodyDef& Dynamic(ShapePtr shape, Vec3d position, double mass_kg, Material material = {});
  // Frames in the coordinates of the bodies; to the world with `b` = BodyId(), frame_b then in world space.
  template <class Kind>
  JointDef& Joint(BodyId a, BodyId b, Pose frame_a, Pose frame_b, Kind kind) {
    JointDef& joint = NewJoint(a, b, frame_a, frame_b);
    joint.kind = std::move(kind);
    return joint;
  }
  // Between bodies as they stand, about a frame in world space.
  template <class Kind>
  JointDef& JointAt(BodyId a, BodyId b, const Pose& world, Kind kind) {
    return Joint(a, b, LocalTo(a, world), LocalTo(b, world), std::move(kind));
  }

  void Gravity(double down_m_s2) { scene_.gravity_m_s2 = {0, -down_m_s2, 0}; }
  const Scene& scene() const { return scene_; }
  Scene Take();  // with bounds that hold all bodies

 private:
  Pose LocalTo(BodyId body, const Pose& world) const;
  BodyDef& NewBody(ShapePtr shape, Vec3d position, Material material);
  JointDef& NewJoint(BodyId a, BodyId b, Pose frame_a, Pose frame_b);

  Scene scene_;
};

const BodyDef& BodyOf(const Scene& scene, BodyId id);
// Lets every dynamic body sleep, or none.
void AllowSleep(Scene& scene, bool allowed);
// Moves everything, static bodies and world frames of joints too.
void Shift(Scene& scene, Vec3d by);
// Sets a body's velocities to those of a turn at `rate_rad_s` about `center`.
void TurnAbout(BodyDef& body, Vec3d center, Vec3d rate_rad_s);

// --- Implementation

template <class Height>
ShapePtr GridMeshOf(int cells, double spacing_m, Height height) {
  TriangleMeshShape mesh;
  const auto corner = [&](int i) { return (i - cells / 2.0) * spacing_m; };
  for (int row = 0; row <= cells; ++row) {
    for (int column = 0; column <= cells; ++column) {
      const double x = corner(column), z = corner(row);
      mesh.vertices.push_back({static_cast<float>(x), static_cast<float>(height(x, z)), static_cast<float>(z)});
    }
  }
  for (int row = 0; row < cells; ++row) {
    for (int column = 0; column < cells; ++column) {
      const auto a = static_cast<std::uint32_t>(row * (cells + 1) + column);
      const auto below = a + static_cast<std::uint32_t>(cells) + 1;
      mesh.triangles.push_back({a, below, a + 1});
      mesh.triangles.push_back({a + 1, below, below + 1});
    }
  }
  return std::make_shared<const Shape>(Shape{std::move(mesh)});
}

}  // namespace tessera::scenes
