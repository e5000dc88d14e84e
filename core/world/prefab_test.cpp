#include "core/world/prefab.h"

#include <gmock/gmock.h>

#include <cmath>

#include "core/world/scene_io.h"

namespace tessera {
namespace {

using ::testing::HasSubstr;
using ::testing::SizeIs;

constexpr char kBeginning[] = R"(name: "arena" bounds { min { x: -9 y: -9 z: -9 } max { x: 9 y: 9 z: 9 } }
  bodies { id: 1 motion: MOTION_STATIC shape { box { half_extents { x: 9 y: 1 z: 9 } } } }
)";
constexpr char kBall[] = "mass: 2 kind: \"ball\" shape { sphere { radius: 0.5 } }";

absl::StatusOr<std::shared_ptr<const Scene>> Read(const std::string& prefabs) {
  const auto scene = ParseScene(kBeginning + prefabs, "arena");
  if (!scene.ok()) return scene.status();
  return ResolveScene(*scene, "arena");
}
std::string ErrorOf(const std::string& prefabs) { return std::string(Read(prefabs).status().message()); }
std::string WithBall(const std::string& more) { return std::string(kBall) + more; }

TEST(PrefabTest, OneBodyIsAPrefab) {
  const auto scene = Read("prefabs { name: \"ball\" bodies { " + WithBall("") + " } }");
  ASSERT_TRUE(scene.ok()) << scene.status();
  ASSERT_THAT((*scene)->prefabs, SizeIs(1));
  const BodyId id = SpawnedBodyId({0, 3, 4, 0});
  ASSERT_NE(PrefabBodyOf(**scene, id), nullptr);
  const BodyDef def = MakeSpawned(**scene, id);
  EXPECT_EQ(def.id, id);
  EXPECT_EQ(def.mass_kg, 2);
  EXPECT_EQ((*scene)->kinds[def.kind], "ball");
  EXPECT_EQ(PrefabBodyOf(**scene, SpawnedBodyId({0, 3, 4, 1})), nullptr) << "there is no second body";
  EXPECT_EQ(PrefabBodyOf(**scene, SpawnedBodyId({1, 3, 4, 0})), nullptr) << "there is no second prefab";
  EXPECT_EQ(PrefabBodyOf(**scene, BodyId(1)), nullptr);
}

TEST(PrefabTest, JointsConnectTheBodiesThatAreMade) {
  const auto scene = Read("prefabs { name: \"pair\" bodies { " + WithBall("") + " } bodies { " +
                          WithBall("pose { position { x: 2 } }") + " } joints { body_a: 1 body_b: 2 point {} } }");
  ASSERT_TRUE(scene.ok()) << scene.status();
  const BodyId first = SpawnedBodyId({0, 3, 4, 0}), second = WithMember(first, 1);
  const std::vector<JointDef> joints = SpawnedJoints(**scene, second);
  ASSERT_THAT(joints, SizeIs(1));
  EXPECT_EQ(joints[0].body_a, first);
  EXPECT_EQ(joints[0].body_b, second);
  EXPECT_EQ(joints[0].id, SpawnedJointId(second, JointId(1)));
}

TEST(PrefabTest, BodiesAreMadeAsOneRigidBodyAboutThePlace) {
  BodyDef body;
  body.initial.position = {1, 0, 0};
  body.initial.linear_velocity = {3, 0, 0};
  const double half = std::sqrt(0.5);  // a quarter turn about y: x becomes -z
  const BodyState state = SpawnedState(
      body,
      {.position = {10, 2, 0}, .rotation = {0, half, 0, half}, .velocity_m_s = {0, 5, 0}, .spin_rad_s = {0, 2, 0}});
  EXPECT_NEAR(Length(state.position - Vec3d(10, 2, -1)), 0, 1e-12);
  // Its own velocity along -z, that of the place, and spin x arm = (0, 2, 0) x (0, 0, -1).
  EXPECT_NEAR(Length(Vec3d(state.linear_velocity) - Vec3d(-2, 5, -3)), 0, 1e-6);
  EXPECT_NEAR(state.angular_velocity.y, 2, 1e-6);
}

TEST(PrefabTest, WhatCannotBeMadeIsRefused) {
  EXPECT_THAT(ErrorOf("prefabs { name: \"x\" }"), HasSubstr("prefabs[0]: bodies: 1 to 32 are needed, got 0"));
  EXPECT_THAT(ErrorOf("prefabs { name: \"a b\" bodies { " + WithBall("") + " } }"),
              HasSubstr("prefabs[0]: name must be of 1 to 63 letters"));
  EXPECT_THAT(ErrorOf("prefabs { name: \"x\" bodies { " + WithBall("id: 3") + " } }"),
              HasSubstr("prefabs[0].bodies[0]: id must be left out of a prefab, got 3"));
  EXPECT_THAT(ErrorOf("prefabs { name: \"x\" bodies { motion: MOTION_STATIC shape { sphere { radius: 1 } } } }"),
              HasSubstr("motion must be MOTION_DYNAMIC in a prefab"));
  const std::string two = "bodies { " + WithBall("") + " } bodies { " + WithBall("") + " }";
  EXPECT_THAT(ErrorOf("prefabs { name: \"x\" " + two + " }"), HasSubstr("joints: they do not connect all"));
  EXPECT_THAT(ErrorOf("prefabs { name: \"x\" " + two + " joints { body_a: 1 body_b: 3 point {} } }"),
              HasSubstr("prefabs[0].joints[0]: body_b must be 1 to 2, a body of the prefab, got 3"));
  const std::string ball = "prefabs { name: \"x\" bodies { " + WithBall("") + " } }";
  EXPECT_THAT(ErrorOf(ball + ball), HasSubstr("prefabs[1]: name is also that of prefabs[0]"));
}

}  // namespace
}  // namespace tessera
