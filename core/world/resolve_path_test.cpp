// Kinematic bodies of a scene: what a sound one becomes, and each way in which one can be wrong.
#include "core/world/resolve_path.h"

#include <gtest/gtest.h>

#include <functional>
#include <string>

#include "core/world/scene_faults.h"

namespace tessera {
namespace {

using namespace scene_faults;

// The sound scene with a platform, body 60, that has this path.
v1::Scene WithPath(const std::string& path) {
  v1::Scene scene = Sound();
  const auto parsed = ParseScene(
      "bodies { id: 60 name: \"lift\" shape { box { half_extents { x: 1 y: 0.1 z: 1 } } } pose { position { y: 3 } } "
      "kinematic { path { " +
          path + " } } }",
      kFile);
  EXPECT_TRUE(parsed.ok()) << parsed.status();
  *scene.add_bodies() = parsed->bodies(0);
  return scene;
}

std::shared_ptr<const Scene> Resolved(const v1::Scene& scene) {
  auto resolved = ResolveScene(scene, kFile);
  EXPECT_TRUE(resolved.ok()) << resolved.status();
  return resolved.ok() ? *resolved : nullptr;
}

std::string PathError(const std::string& path) {
  const auto resolved = ResolveScene(WithPath(path), kFile);
  const std::string message(resolved.status().message());
  const std::string start = std::string(kFile) + ": bodies[3] (id 60 \"lift\"): ";
  EXPECT_EQ(message.substr(0, start.size()), start);
  return message.substr(std::min(start.size(), message.size()));
}

std::string LiftError(const std::function<void(v1::Body&)>& change) {
  v1::Scene scene = WithPath("spin { y: 1 }");
  change(*scene.mutable_bodies(3));
  const std::string message(ResolveScene(scene, kFile).status().message());
  return message.substr(message.find("): ") + 3);
}

TEST(KinematicBodyTest, APathBeginsAtTheBodysPose) {
  const auto scene =
      Resolved(WithPath("points { position { y: 5 } time: 2 } points { position { y: 3 x: 4 } speed: 2 } repeat: "
                        "REPEAT_PING_PONG spin { y: 0.5 }"));
  ASSERT_NE(scene, nullptr);
  const auto body = std::ranges::find(scene->bodies, BodyId(60), &BodyDef::id);
  ASSERT_TRUE(body != scene->bodies.end() && body->path != nullptr);
  EXPECT_TRUE(body->kinematic);
  EXPECT_EQ(body->motion, Motion::kStatic);
  EXPECT_EQ(body->mass_kg, 0);
  const BodyPath& path = *body->path;
  ASSERT_EQ(path.points.size(), 3u);
  EXPECT_EQ(path.points[0].pose.position, Vec3d(0, 3, 0));
  EXPECT_EQ(path.points[1].time_s, 2);
  EXPECT_NEAR(path.points[2].time_s, 2 + std::sqrt(20) / 2, 1e-12);
  EXPECT_EQ(path.repeat, PathRepeat::kPingPong);
  EXPECT_EQ(path.spin_rad_s, Vec3d(0, 0.5, 0));
}

TEST(KinematicBodyTest, WithoutAPathAGameMovesIt) {
  v1::Scene proto = WithPath("spin { y: 1 }");
  proto.mutable_bodies(3)->mutable_kinematic()->clear_path();
  const auto scene = Resolved(proto);
  ASSERT_NE(scene, nullptr);
  const auto body = std::ranges::find(scene->bodies, BodyId(60), &BodyDef::id);
  EXPECT_TRUE(body->kinematic);
  EXPECT_EQ(body->path, nullptr);
  EXPECT_EQ(body->motion, Motion::kDynamic);
  EXPECT_EQ(body->gravity_scale, 0);
}

TEST(KinematicBodyTest, MayBeATriggerAndHoldJoints) {
  v1::Scene proto = WithPath("spin { y: 1 }");
  proto.mutable_bodies(3)->set_trigger(true);
  v1::Joint& joint = *proto.add_joints();
  joint.set_id(9);
  joint.set_body_a(60);
  joint.set_body_b(41);
  joint.mutable_point();
  EXPECT_NE(Resolved(proto), nullptr);
}

TEST(BadKinematicBodyTest, Points) {
  EXPECT_EQ(PathError(""), "kinematic.path has neither points nor spin: leave it out for a body that a game moves");
  EXPECT_EQ(PathError("points { position { y: 5 } time: 1 }"),
            "kinematic.path.points: a loop needs at least two, the last one at the body's own pose");
  EXPECT_EQ(PathError("points { position { y: 5 } time: 1 } points { position { y: 4 } time: 2 }"),
            "kinematic.path.points: the last one of a loop must be the body's own pose");
  EXPECT_EQ(PathError("repeat: REPEAT_ONCE points { position { y: 50 } time: 1 }"),
            "kinematic.path.points[0].position is outside the scene's bounds");
  EXPECT_EQ(PathError("repeat: REPEAT_ONCE points { position { y: nan } time: 1 }"),
            "kinematic.path.points[0].position.y must be a finite number, got nan");
  EXPECT_EQ(PathError("repeat: REPEAT_ONCE points { position { y: 5 } orientation { w: 3 } time: 1 }"),
            "kinematic.path.points[0].orientation must have length 1, got 3");
  EXPECT_EQ(PathError("repeat: 7 spin { y: 1 }"),
            "kinematic.path.repeat must be REPEAT_LOOP, REPEAT_PING_PONG or REPEAT_ONCE, got 7");
  EXPECT_EQ(PathError("spin { y: 11 }").substr(0, 19), "kinematic.path.spin");
}

TEST(BadKinematicBodyTest, Times) {
  const std::string once = "repeat: REPEAT_ONCE ";
  EXPECT_EQ(PathError(once + "points { position { y: 5 } }"), "kinematic.path.points[0] needs either time or speed");
  EXPECT_EQ(PathError(once + "points { position { y: 5 } time: 1 speed: 1 }"),
            "kinematic.path.points[0] needs either time or speed");
  EXPECT_EQ(PathError(once + "points { position { y: 5 } time: 2 } points { position { y: 6 } time: 1 }"),
            "kinematic.path.points[1].time must be at least 0.01 s after the point before, at 2, got 1");
  EXPECT_EQ(PathError(once + "points { position { y: 5 } time: -1 }").substr(0, 29), "kinematic.path.points[0].time");
  EXPECT_EQ(PathError(once + "points { position { y: 5 } speed: -1 }").substr(0, 30), "kinematic.path.points[0].speed");
  EXPECT_EQ(PathError(once + "points { position { y: 3 } speed: 1 }"),
            "kinematic.path.points[0].speed: it is in the place of the point before, so it needs time");
  EXPECT_EQ(PathError(once + "points { position { y: 8 } time: 0.02 }"),
            "kinematic.path.points[0] is reached at 250 m/s, at most 100");
}

TEST(BadKinematicBodyTest, WhatOnlyOtherBodiesHave) {
  EXPECT_EQ(LiftError([](v1::Body& b) { b.set_mass(5); }), "mass must be left out of a kinematic body");
  EXPECT_EQ(LiftError([](v1::Body& b) { b.set_motion(v1::MOTION_STATIC); }),
            "motion must be left out of a kinematic body");
  EXPECT_EQ(LiftError([](v1::Body& b) { b.mutable_linear_velocity()->set_x(1); }),
            "linear_velocity must be left out of a kinematic body");
  EXPECT_EQ(LiftError([](v1::Body& b) { b.set_gravity_scale(1); }),
            "gravity_scale must be left out of a kinematic body");
  EXPECT_EQ(LiftError([](v1::Body& b) { b.set_never_sleeps(true); }),
            "never_sleeps must be left out of a kinematic body");
  EXPECT_EQ(LiftError([](v1::Body& b) { b.mutable_shape()->mutable_plane()->mutable_normal()->set_y(1); }),
            "shape.plane is for static bodies only");
}

TEST(BadKinematicBodyTest, Templates) {
  EXPECT_EQ(Error([](v1::Scene& s) {
              v1::Body& body = *s.mutable_scatters(0)->mutable_templates(0);
              body.clear_mass();
              body.mutable_kinematic();
            }).substr(0, 68),
            "scatters[0].templates[0]: kinematic must be left out of a template");
}

}  // namespace
}  // namespace tessera
