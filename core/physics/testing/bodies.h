// Bodies and shapes for the tests of this folder.
#pragma once

#include <memory>
#include <utility>
#include <vector>

#include "core/physics/world.h"

namespace tessera::physics {

inline constexpr double kDt = 1.0 / 60;
inline constexpr double kGravity = 9.81;

template <class Form>
ShapePtr MakeShapePtr(Form form) {
  return std::make_shared<const Shape>(Shape{std::move(form)});
}

inline ShapePtr Box(double x, double y, double z) { return MakeShapePtr(BoxShape{{x, y, z}}); }
inline ShapePtr Cube(double half = 0.5) { return Box(half, half, half); }
inline ShapePtr Ball(double radius = 0.5) { return MakeShapePtr(SphereShape{radius}); }
inline ShapePtr Ground() { return MakeShapePtr(PlaneShape{}); }

inline BodyDef Static(std::uint64_t id, ShapePtr shape, Vec3d position = {}) {
  BodyDef def;
  def.id = BodyId(id);
  def.shape = std::move(shape);
  def.motion = Motion::kStatic;
  def.mass_kg = 0;
  def.initial.position = position;
  return def;
}

inline BodyDef Dynamic(std::uint64_t id, ShapePtr shape, Vec3d position, double mass_kg = 1) {
  BodyDef def;
  def.id = BodyId(id);
  def.shape = std::move(shape);
  def.mass_kg = mass_kg;
  def.initial.position = position;
  return def;
}

inline void AddAll(World& world, const std::vector<BodyDef>& bodies) {
  for (const BodyDef& body : bodies) world.Add(body, body.initial);
}

inline void Simulate(World& world, double seconds, double dt = kDt) {
  for (int i = 0; i < static_cast<int>(seconds / dt + 0.5); ++i) world.Step(dt);
}

// Inertia of a body in world space, times w.
inline Vec3d AngularMomentum(const World& world, BodyId id) {
  const BodyState state = world.StateOf(id);
  const Quatd q = state.orientation;
  const Vec3d local = Rotate(Conjugate(q), Vec3d(state.angular_velocity)), inertia = world.InertiaOf(id);
  return Rotate(q, {inertia.x * local.x, inertia.y * local.y, inertia.z * local.z});
}

}  // namespace tessera::physics
