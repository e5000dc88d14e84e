// Bodies that lie in each other's hollows, and bodies that are wedged in where there is no room for them.
#include <gmock/gmock.h>

#include <algorithm>
#include <numbers>

#include "core/physics/testing/bodies.h"

namespace tessera::physics {
namespace {

ShapePtr Dumbbell() {
  return MakeShapePtr(
      CompoundShape{{{{{-0.5, 0, 0}, {}}, Ball(0.35)}, {{}, Box(0.4, 0.12, 0.12)}, {{{0.5, 0, 0}, {}}, Ball(0.35)}}});
}

// Each dumbbell touches the other's bar with a ball, and reaches past that contact with its other ball. Nothing has
// passed through anything by that.
TEST(CompoundTest, TwoThatLieInEachOthersHollowsTravelFreely) {
  const float speed_m_s = 7, press_n = 30;
  World world({.gravity_m_s2 = {}});
  BodyDef one = Dynamic(1, Dumbbell(), {0, 0, 0}, 3), other = Dynamic(2, Dumbbell(), {0.5, 0, 0.5}, 3);
  one.initial.linear_velocity = other.initial.linear_velocity = {-speed_m_s, 0, 0};
  AddAll(world, {one, other});
  for (int i = 0; i < 60; ++i) {
    world.ApplyForce(BodyId(1), {0, 0, press_n}, {});
    world.ApplyForce(BodyId(2), {0, 0, -press_n}, {});
    world.Step(kDt);
  }
  const Vec3d centre = (world.StateOf(BodyId(1)).position + world.StateOf(BodyId(2)).position) * 0.5;
  EXPECT_NEAR(centre.x, 0.25 - speed_m_s, 0.001);
}

// The arm can go neither up nor down, and the plate is thicker than what is left under it.
TEST(WedgeTest, APlateUnderADrivenArmDoesNotBurst) {
  World world({});
  const Quatd upright = Normalized(Quatd{-std::numbers::sqrt2 / 2, 0, 0, std::numbers::sqrt2 / 2});
  JointDef hinge;
  hinge.id = JointId(1);
  hinge.body_a = BodyId(2);
  hinge.frame_a = {{-2.4, 0, 0}, upright};
  hinge.frame_b = {{0, 0.7, 0}, upright};
  hinge.kind = HingeJoint{.limit_rad = {}, .motor = {.target_velocity = 0.8, .max_force = 8000}};
  AddAll(world, {Static(1, Ground()), Dynamic(2, Box(2, 0.6, 0.15), {2.4, 0.7, 0}, 30),
                 Dynamic(3, Box(1.5, 0.2, 1.5), {2.4, 0.2, 0.1}, 30)});
  world.AddJoint(hinge);
  float fastest_plate = 0, fastest_arm = 0;
  for (int i = 0; i < 1200; ++i) {
    world.Step(kDt);
    fastest_plate = std::max(fastest_plate, Length(world.StateOf(BodyId(3)).linear_velocity));
    fastest_arm = std::max(fastest_arm, Length(world.StateOf(BodyId(2)).angular_velocity));
  }
  EXPECT_LT(fastest_plate, 1);
  EXPECT_LT(fastest_arm, 2);
}

}  // namespace
}  // namespace tessera::physics
