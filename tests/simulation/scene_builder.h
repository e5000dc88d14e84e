// SceneBuilder: small worlds for tests, said in a few words. Bodies get ids 1, 2, 3 ... in the order of adding.
#pragma once

#include <memory>
#include <utility>

#include "core/world/scene.h"

namespace tessera::simulation {

template <class Form>
ShapePtr MakeShape(Form form) {
  return std::make_shared<const Shape>(Shape{std::move(form)});
}
inline ShapePtr Ball(double radius_m) { return MakeShape(SphereShape{radius_m}); }
inline ShapePtr Box(double half_m) { return MakeShape(BoxShape{{half_m, half_m, half_m}}); }

class SceneBuilder {
 public:
  // A square of ground from -half to half in x and z; no gravity unless asked for.
  explicit SceneBuilder(double half_m) {
    scene_.name = "test";
    scene_.bounds = {{-half_m, -half_m, -half_m}, {half_m, half_m, half_m}};
    scene_.gravity_m_s2 = {};
  }

  SceneBuilder& Gravity() {
    scene_.gravity_m_s2 = {0, -9.81, 0};
    return *this;
  }
  SceneBuilder& Floor(double friction = 0.5) {
    BodyDef& def = Next(MakeShape(PlaneShape{}), {});
    def.motion = Motion::kStatic;
    def.mass_kg = 0;
    def.material.friction = friction;
    return *this;
  }
  // The caller may change what it returns until the next call.
  BodyDef& Add(ShapePtr shape, Vec3d position, Vec3f velocity = {}, double mass_kg = 1) {
    BodyDef& def = Next(std::move(shape), position);
    def.initial.linear_velocity = velocity;
    def.mass_kg = mass_kg;
    return def;
  }
  void Tie(BodyId a, BodyId b, Vec3d at_in_a, Vec3d at_in_b) {
    JointDef joint;
    joint.id = JointId(static_cast<std::uint32_t>(scene_.joints.size() + 1));
    joint.body_a = a;
    joint.body_b = b;
    joint.frame_a.position = at_in_a;
    joint.frame_b.position = at_in_b;
    joint.kind = PointJoint{};
    scene_.joints.push_back(joint);
  }
  Scene& scene() { return scene_; }
  std::shared_ptr<const Scene> Build() const { return std::make_shared<const Scene>(scene_); }

 private:
  BodyDef& Next(ShapePtr shape, Vec3d position) {
    BodyDef def;
    def.id = BodyId(scene_.bodies.size() + 1);
    def.shape = std::move(shape);
    def.initial.position = position;
    scene_.bodies.push_back(std::move(def));
    return scene_.bodies.back();
  }
  Scene scene_;
};

// Balls that fly about in a square of walls from -half to half, across all borders, and bounce without loss.
inline SceneBuilder Swarm(double half_m, int balls) {
  SceneBuilder builder(half_m);
  for (const double side : {-1.0, 1.0}) {
    for (const bool along : {false, true}) {
      BodyDef& wall = builder.Add(MakeShape(BoxShape{along ? Vec3d{1, 3, half_m} : Vec3d{half_m, 3, 1}}),
                                  along ? Vec3d{side * half_m, 0, 0} : Vec3d{0, 0, side * half_m});
      wall.motion = Motion::kStatic;
      wall.mass_kg = 0;
    }
  }
  const int columns = static_cast<int>(half_m) - 2;
  for (int i = 0; i < balls; ++i) {
    BodyDef& ball = builder.Add(Ball(0.3), {3 - half_m + i % columns * 2, 0, 3 - half_m + i / columns * 2},
                                {static_cast<float>(5 - i % 11), 0, static_cast<float>(i % 7 - 3)});
    ball.material.restitution = 1;
    ball.material.friction = 0;
    ball.may_sleep = false;
  }
  return builder;
}

}  // namespace tessera::simulation
