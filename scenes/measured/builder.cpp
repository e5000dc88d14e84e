#include "scenes/measured/builder.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numbers>

namespace tessera::scenes {
namespace {

template <class Form>
ShapePtr Make(Form form) {
  return std::make_shared<const Shape>(Shape{std::move(form)});
}

}  // namespace

ShapePtr BoxOf(double half_x, double half_y, double half_z) { return Make(BoxShape{{half_x, half_y, half_z}}); }
ShapePtr BallOf(double radius_m) { return Make(SphereShape{radius_m}); }
ShapePtr CapsuleOf(double radius_m, double half_height_m) { return Make(CapsuleShape{radius_m, half_height_m}); }
ShapePtr CylinderOf(double radius_m, double half_height_m) { return Make(CylinderShape{radius_m, half_height_m}); }
ShapePtr HullOf(std::vector<Vec3f> points) { return Make(ConvexHullShape{std::move(points)}); }
ShapePtr PlaneOf(Vec3d normal, double offset_m) { return Make(PlaneShape{normal, offset_m}); }

// Taylor series within an eighth of a turn of the nearest quarter: exact to rounding with these terms.
SinCos SinCosOf(double angle_rad) {
  const double quarters = std::nearbyint(angle_rad / (std::numbers::pi / 2));
  const double x = angle_rad - quarters * (std::numbers::pi / 2), xx = x * x;
  double sin = 0, cos = 0;
  for (int i = 18; i > 0; i -= 2) {
    cos = (1 + cos) * -xx / (i * (i - 1));
    sin = (1 + sin) * -xx / (i * (i + 1));
  }
  cos += 1;
  sin = (sin + 1) * x;
  switch (static_cast<long>(quarters) & 3) {
    case 0:
      return {sin, cos};
    case 1:
      return {cos, -sin};
    case 2:
      return {-sin, -cos};
    default:
      return {-cos, sin};
  }
}

Quatd Turn(Vec3d unit_axis, double angle_rad) {
  const SinCos half = SinCosOf(angle_rad / 2);
  return {unit_axis.x * half.sin, unit_axis.y * half.sin, unit_axis.z * half.sin, half.cos};
}

double Random::Unit() {
  state_ += 0x9e3779b97f4a7c15;
  std::uint64_t z = state_;
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9;
  z = (z ^ (z >> 27)) * 0x94d049bb133111eb;
  z ^= z >> 31;
  return static_cast<double>(z >> 11) * 0x1p-53;
}

Builder::Builder(std::string name) { scene_.name = std::move(name); }

BodyDef& Builder::NewBody(ShapePtr shape, Vec3d position, Material material) {
  BodyDef& body = scene_.bodies.emplace_back();
  body.id = BodyId(scene_.bodies.size());
  body.shape = std::move(shape);
  body.material = material;
  body.may_sleep = false;
  body.initial.position = position;
  return body;
}

BodyDef& Builder::Static(ShapePtr shape, Vec3d position, Material material) {
  BodyDef& body = NewBody(std::move(shape), position, material);
  body.motion = Motion::kStatic;
  body.mass_kg = 0;
  return body;
}

BodyDef& Builder::Dynamic(ShapePtr shape, Vec3d position, double mass_kg, Material material) {
  BodyDef& body = NewBody(std::move(shape), position, material);
  body.mass_kg = mass_kg;
  return body;
}

BodyId Builder::Ground(Material material) { return Static(PlaneOf({0, 1, 0}), {}, material).id; }

JointDef& Builder::NewJoint(BodyId a, BodyId b, Pose frame_a, Pose frame_b) {
  JointDef& joint = scene_.joints.emplace_back();
  joint.id = JointId(static_cast<std::uint32_t>(scene_.joints.size()));
  joint.body_a = a;
  joint.body_b = b;
  joint.frame_a = frame_a;
  joint.frame_b = frame_b;
  return joint;
}

Pose Builder::LocalTo(BodyId body, const Pose& world) const {
  if (body == BodyId()) return world;
  const BodyState& state = BodyOf(scene_, body).initial;
  const Quatd inverse = Conjugate(Quatd(state.orientation));
  return {Rotate(inverse, world.position - state.position), inverse * world.orientation};
}

Scene Builder::Take() {
  Aabb around{{-100, -100, -100}, {100, 100, 100}};
  for (const BodyDef& body : scene_.bodies) {
    const Vec3d place = body.initial.position;
    around = around.United(Aabb{place, place}.Expanded(100));
  }
  scene_.bounds = around;
  return std::move(scene_);
}

const BodyDef& BodyOf(const Scene& scene, BodyId id) {
  assert(id != BodyId() && id.value() <= scene.bodies.size());
  return scene.bodies[id.value() - 1];
}

void AllowSleep(Scene& scene, bool allowed) {
  for (BodyDef& body : scene.bodies) body.may_sleep = allowed;
}

void Shift(Scene& scene, Vec3d by) {
  scene.bounds = {scene.bounds.min + by, scene.bounds.max + by};
  for (BodyDef& body : scene.bodies) body.initial.position += by;
  for (JointDef& joint : scene.joints) {
    if (joint.body_b == BodyId()) joint.frame_b.position += by;
  }
}

void TurnAbout(BodyDef& body, Vec3d center, Vec3d rate_rad_s) {
  body.initial.angular_velocity = Vec3f(rate_rad_s);
  body.initial.linear_velocity = Vec3f(Cross(rate_rad_s, body.initial.position - center));
}

}  // namespace tessera::scenes
