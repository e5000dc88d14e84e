// One test for each way in which a scene can be wrong: what is told, in full.
#include <gtest/gtest.h>

#include <limits>
#include <string>

#include "absl/strings/str_cat.h"
#include "core/world/limits.h"
#include "core/world/scene_io.h"

namespace tessera {
namespace {

constexpr char kFile[] = "scenes/x.textproto";

// A sound scene: bodies[0] is ground, bodies[1] a crate, bodies[2] a ball; templates, a joint, a player.
v1::Scene Sound() {
  auto scene = ParseScene(R"(
    name: "x"
    bounds { min { x: -10 y: -10 z: -10 } max { x: 10 y: 10 z: 10 } }
    materials { name: "wood" friction: 0.5 }
    bodies { id: 1 motion: MOTION_STATIC shape { plane { normal { y: 1 } } } }
    bodies { id: 40 name: "crate" mass: 1 material: "wood" shape { box { half_extents { x: 1 y: 1 z: 1 } } } }
    bodies { id: 41 mass: 1 shape { sphere { radius: 1 } } pose { position { y: 5 } } }
    joints { id: 1 body_a: 40 body_b: 41 point {} }
    scatters {
      first_id: 100 count: 9 spacing: 2 jitter: 1
      area { min { x: -8 y: 1 z: -8 } max { x: 8 y: 2 z: 8 } }
      templates { mass: 1 shape { sphere { radius: 0.1 } } }
    }
    fields { vortex { radius: 5 angular_velocity: 1 gain: 1 } }
    fields { uniform { bounds { max { x: 1 y: 1 z: 1 } } acceleration { y: 1 } } }
    player { body { mass: 80 shape { sphere { radius: 1 } } } spawn_points { y: 1 } max_force: 1 max_speed: 1 }
  )",
                          kFile);
  EXPECT_TRUE(scene.ok()) << scene.status();
  return *scene;
}

// The error of the sound scene after `change`, without the file, which it must begin with.
template <class Change>
std::string Error(Change change) {
  v1::Scene scene = Sound();
  change(scene);
  const auto resolved = ResolveScene(scene, kFile);
  EXPECT_EQ(resolved.status().code(), absl::StatusCode::kInvalidArgument);
  const std::string message(resolved.status().message());
  EXPECT_EQ(message.find('\n'), std::string::npos);
  const std::string start = absl::StrCat(kFile, ": ");
  EXPECT_EQ(message.substr(0, start.size()), start);
  return message.substr(std::min(start.size(), message.size()));
}

// Of bodies[1], the crate.
template <class Change>
std::string CrateError(Change change) {
  const std::string place = "bodies[1] (id 40 \"crate\"): ";
  const std::string error = Error([&](v1::Scene& scene) { change(*scene.mutable_bodies(1)); });
  EXPECT_EQ(error.substr(0, place.size()), place);
  return error.substr(std::min(place.size(), error.size()));
}

// Of the shape of bodies[0], which is static, given as text.
std::string ShapeError(const std::string& shape) {
  const auto parsed = ParseScene("bodies { shape { " + shape + " } }", kFile);
  EXPECT_TRUE(parsed.ok()) << parsed.status();
  const std::string place = "bodies[0] (id 1): ";
  const std::string error =
      Error([&](v1::Scene& scene) { *scene.mutable_bodies(0)->mutable_shape() = parsed->bodies(0).shape(); });
  EXPECT_EQ(error.substr(0, place.size()), place);
  return error.substr(std::min(place.size(), error.size()));
}

std::string JointError(const std::string& fields) {
  std::string ends;
  if (fields.find("body_a") == std::string::npos) ends += "body_a: 40 ";
  if (fields.find("body_b") == std::string::npos) ends += "body_b: 41 ";
  const auto parsed = ParseScene("joints { id: 1 " + ends + fields + " }", kFile);
  EXPECT_TRUE(parsed.ok()) << parsed.status();
  const std::string place = "joints[0] (id 1): ";
  const std::string error = Error([&](v1::Scene& scene) { *scene.mutable_joints(0) = parsed->joints(0); });
  EXPECT_EQ(error.substr(0, place.size()), place);
  return error.substr(std::min(place.size(), error.size()));
}

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInf = std::numeric_limits<double>::infinity();

TEST(BadSceneTest, TheSoundOneIsSound) {
  const auto scene = ResolveScene(Sound(), kFile);
  EXPECT_TRUE(scene.ok()) << scene.status();
}

TEST(BadSceneTest, TellsHowManyMoreFaultsThereAre) {
  EXPECT_EQ(Error([](v1::Scene& s) {
              s.mutable_bodies(1)->set_mass(-1);
              s.mutable_bodies(2)->set_mass(-2);
              s.mutable_player()->set_max_speed(0);
            }),
            "bodies[1] (id 40 \"crate\"): mass must be > 0, got -1 (and 2 more)");
}

// --- The scene as a whole ---

TEST(BadSceneTest, Name) {
  EXPECT_EQ(Error([](v1::Scene& s) { s.clear_name(); }),
            "name must be of lower case letters, digits and dashes, got \"\"");
  EXPECT_EQ(Error([](v1::Scene& s) { s.set_name("My Scene"); }),
            "name must be of lower case letters, digits and dashes, got \"My Scene\"");
  EXPECT_EQ(Error([](v1::Scene& s) { s.set_name("a\nb"); }),
            "name must be at most 63 bytes without control characters, quotes and backslashes, got \"a\\nb\"");
}

TEST(BadSceneTest, Empty) {
  EXPECT_EQ(Error([](v1::Scene& s) {
              s.clear_bodies();
              s.clear_scatters();
              s.clear_player();
              s.clear_joints();
            }),
            "the scene is empty: it has no bodies and no player");
}

TEST(BadSceneTest, Bounds) {
  EXPECT_EQ(Error([](v1::Scene& s) {
              v1::Scene none;
              none.set_name("x");
              none.mutable_player();
              s = none;
            }).substr(0, 53),
            "bounds has no volume: min.x is 0, max.x is 0 (and 4 m");
  EXPECT_EQ(Error([](v1::Scene& s) { s.mutable_bounds()->mutable_max()->set_z(kNan); }).substr(0, 48),
            "bounds.max.z must be a finite number, got nan (a");
  EXPECT_EQ(Error([](v1::Scene& s) { s.mutable_bounds()->mutable_max()->set_z(2e7); }),
            "bounds.max.z must be -1e+07 to 1e+07, got 2e+07");
}

TEST(BadSceneTest, TickRate) {
  EXPECT_EQ(Error([](v1::Scene& s) { s.set_tick_rate_hz(5); }), "tick_rate_hz must be 10 to 240, got 5");
  EXPECT_EQ(Error([](v1::Scene& s) { s.set_tick_rate_hz(1000); }), "tick_rate_hz must be 10 to 240, got 1000");
}

TEST(BadSceneTest, Gravity) {
  EXPECT_EQ(Error([](v1::Scene& s) { s.mutable_gravity()->set_y(kInf); }),
            "gravity.y must be a finite number, got inf");
  EXPECT_EQ(Error([](v1::Scene& s) { s.mutable_gravity()->set_y(-1e5); }),
            "gravity must be at most 10000 long, got 100000");
}

TEST(BadSceneTest, TooBig) {
  EXPECT_EQ(Error([](v1::Scene& s) { s.mutable_scatters(0)->set_count(4'000'000'000); }),
            "bodies, scattered ones included, must be at most 1000000, got 4000000003");
}

TEST(BadSceneTest, Materials) {
  EXPECT_EQ(Error([](v1::Scene& s) { s.mutable_materials(0)->set_friction(-1); }),
            "materials[0] (\"wood\"): friction must be >= 0, got -1");
  EXPECT_EQ(Error([](v1::Scene& s) { s.mutable_materials(0)->set_restitution(1.5); }),
            "materials[0] (\"wood\"): restitution must be 0 to 1, got 1.5");
  EXPECT_EQ(Error([](v1::Scene& s) { *s.add_materials() = s.materials(0); }),
            "materials[1] (\"wood\"): name is used twice");
  EXPECT_EQ(Error([](v1::Scene& s) { s.add_materials(); }), "materials[1]: name is missing");
}

// --- Bodies ---

TEST(BadSceneTest, Mass) {
  EXPECT_EQ(CrateError([](v1::Body& b) { b.set_mass(-1); }), "mass must be > 0, got -1");
  EXPECT_EQ(CrateError([](v1::Body& b) { b.clear_mass(); }), "mass must be > 0, got 0");
  EXPECT_EQ(CrateError([](v1::Body& b) { b.set_mass(kNan); }), "mass must be a finite number, got nan");
  EXPECT_EQ(CrateError([](v1::Body& b) { b.set_mass(-kInf); }), "mass must be a finite number, got -inf");
  EXPECT_EQ(CrateError([](v1::Body& b) { b.set_mass(1e10); }), "mass must be 1e-06 to 1e+09, got 1e+10");
}

TEST(BadSceneTest, DuplicateIds) {
  EXPECT_EQ(Error([](v1::Scene& s) { s.mutable_bodies(2)->set_id(1); }).substr(0, 50),
            "bodies[2] (id 1): id 1 is also that of bodies[0] (");
  EXPECT_EQ(Error([](v1::Scene& s) { *s.add_bodies() = s.bodies(1); }),
            "bodies[3] (id 40 \"crate\"): id 40 is also that of bodies[1] (id 40 \"crate\")");
  EXPECT_EQ(Error([](v1::Scene& s) {
              *s.add_bodies() = s.bodies(2);
              s.mutable_bodies(3)->set_id(108);
            }),
            "bodies[3] (id 108): id 108 is among the ids of scatters[0], 100 to 108");
  EXPECT_EQ(Error([](v1::Scene& s) {
              *s.add_scatters() = s.scatters(0);
              s.mutable_scatters(1)->set_first_id(92);
            }),
            "scatters[0]: first_id 100 is among the ids of scatters[1], 92 to 100");
  EXPECT_EQ(Error([](v1::Scene& s) { *s.add_joints() = s.joints(0); }),
            "joints[1] (id 1): id 1 is also that of joints[0]");
}

TEST(BadSceneTest, IdOutOfRange) {
  EXPECT_EQ(Error([](v1::Scene& s) {
              s.clear_joints();
              s.mutable_bodies(1)->set_id(0);
            }),
            "bodies[1] (id 0 \"crate\"): id must be 1 to 4294967295, got 0");
  EXPECT_EQ(Error([](v1::Scene& s) { s.mutable_bodies(0)->set_id(std::uint64_t{1} << 32); }),
            "bodies[0] (id 4294967296): id must be 1 to 4294967295, got 4294967296");
  EXPECT_EQ(Error([](v1::Scene& s) { s.mutable_joints(0)->set_id(0); }), "joints[0] (id 0): id must be > 0, got 0");
}

TEST(BadSceneTest, BodyOutsideTheWorld) {
  EXPECT_EQ(CrateError([](v1::Body& b) { b.mutable_pose()->mutable_position()->set_x(11); }),
            "pose.position is outside the scene's bounds, got (11, 0, 0)");
  EXPECT_EQ(CrateError([](v1::Body& b) { b.mutable_pose()->mutable_position()->set_x(kNan); }),
            "pose.position.x must be a finite number, got nan");
}

TEST(BadSceneTest, Orientation) {
  EXPECT_EQ(CrateError([](v1::Body& b) { b.mutable_pose()->mutable_orientation()->set_w(0.5); }),
            "pose.orientation must have length 1, got 0.5");
  EXPECT_EQ(CrateError([](v1::Body& b) { b.mutable_pose()->mutable_orientation()->set_w(kNan); }),
            "pose.orientation must have length 1, got nan");
}

TEST(BadSceneTest, BodyFields) {
  EXPECT_EQ(CrateError([](v1::Body& b) { b.set_material("cheese"); }),
            "material \"cheese\" is not among the scene's materials");
  EXPECT_EQ(CrateError([](v1::Body& b) { b.mutable_linear_velocity()->set_z(2e4); }),
            "linear_velocity must be at most 10000 long, got 20000");
  EXPECT_EQ(CrateError([](v1::Body& b) { b.mutable_angular_velocity()->set_z(kNan); }),
            "angular_velocity.z must be a finite number, got nan");
  EXPECT_EQ(CrateError([](v1::Body& b) { b.set_linear_damping(1.5); }), "linear_damping must be 0 to 1, got 1.5");
  EXPECT_EQ(CrateError([](v1::Body& b) { b.set_angular_damping(-1); }), "angular_damping must be 0 to 1, got -1");
  EXPECT_EQ(CrateError([](v1::Body& b) { b.set_gravity_scale(kInf); }),
            "gravity_scale must be a finite number, got inf");
  EXPECT_EQ(Error([](v1::Scene& s) {
              s.mutable_gravity()->set_y(-100);
              s.mutable_bodies(1)->set_gravity_scale(-200);
            }),
            "bodies[1] (id 40 \"crate\"): gravity_scale times gravity must be at most 10000, got 20000");
  EXPECT_EQ(CrateError([](v1::Body& b) { b.set_motion(static_cast<v1::Motion>(7)); }),
            "motion must be MOTION_STATIC or MOTION_DYNAMIC, got 7");
  EXPECT_EQ(Error([](v1::Scene& s) { s.mutable_bodies(1)->set_name("a\"\n"); }),
            "bodies[1] (id 40 \"a\\\"\\n\"): name must be at most 63 bytes without control characters, quotes and "
            "backslashes, got \"a\\\"\\n\"");
}

TEST(BadSceneTest, Inertia) {
  const auto error = [](double x, double y, double z) {
    return CrateError([=](v1::Body& b) {
      b.mutable_inertia()->set_x(x);
      b.mutable_inertia()->set_y(y);
      b.mutable_inertia()->set_z(z);
    });
  };
  EXPECT_EQ(error(1, 0, 1), "inertia.y must be > 0, got 0");
  EXPECT_EQ(error(1, 1e-8, 1), "inertia.y must be 1e-07 to 1e+11, got 1e-08");
  EXPECT_EQ(error(1, 1, 1e12), "inertia.z must be 1e-07 to 1e+11, got 1e+12");
  EXPECT_EQ(error(1, 3, 1), "inertia is of no body: one moment, 3, exceeds the sum of the others");
}

TEST(BadSceneTest, StaticBodies) {
  EXPECT_EQ(Error([](v1::Scene& s) { s.mutable_bodies(0)->set_mass(kNan); }),
            "bodies[0] (id 1): mass must be left out of a static body");
  EXPECT_EQ(Error([](v1::Scene& s) { s.mutable_bodies(0)->mutable_linear_velocity()->set_x(1); }),
            "bodies[0] (id 1): linear_velocity must be left out of a static body");
}

// --- Shapes ---

TEST(BadSceneTest, UnknownShape) {
  EXPECT_EQ(
      CrateError([](v1::Body& b) { b.clear_shape(); }),
      "shape is missing: give one of box, sphere, capsule, cylinder, cone, hull, compound, mesh, height_field, plane");
}

TEST(BadSceneTest, Extents) {
  EXPECT_EQ(ShapeError("box { half_extents { x: 1 y: 0 z: 1 } }"), "shape.box.half_extents.y must be > 0, got 0");
  EXPECT_EQ(ShapeError("box { half_extents { x: 1 y: 1e-9 z: 1 } }"),
            "shape.box.half_extents.y must be 0.001 to 100000, got 1e-09");
  EXPECT_EQ(ShapeError("sphere { radius: nan }"), "shape.sphere.radius must be a finite number, got nan");
  EXPECT_EQ(ShapeError("capsule { radius: 1 }"), "shape.capsule.half_height must be > 0, got 0");
  EXPECT_EQ(ShapeError("cylinder { half_height: 1 radius: -2 }"), "shape.cylinder.radius must be > 0, got -2");
  EXPECT_EQ(ShapeError("cone { radius: 1 height: inf }"), "shape.cone.height must be a finite number, got inf");
}

TEST(BadSceneTest, Hulls) {
  const std::string corners = "points {} points { x: 1 } points { y: 1 }";
  EXPECT_EQ(ShapeError("hull { " + corners + " }"), "shape.hull.points must be 4 to 255, got 3");
  EXPECT_EQ(ShapeError("hull { " + corners + " points { x: 1 y: 1 } }"),
            "shape.hull.points lie in one plane: they must be at least 0.001 m thick, got 0");
  EXPECT_EQ(ShapeError("hull { points {} points {} points {} points {} }"),
            "shape.hull.points lie in one plane: they must be at least 0.001 m thick, got 0");
  EXPECT_EQ(ShapeError("hull { points {} points { x: 1 } points { x: 2 } points { x: 3 } }"),
            "shape.hull.points lie in one plane: they must be at least 0.001 m thick, got 0");
  EXPECT_EQ(ShapeError("hull { " + corners + " points { z: nan } }"),
            "shape.hull.points[3].z must be a finite number, got nan");
  // Thick enough to a double, flat to the floats that collision computes with.
  EXPECT_EQ(ShapeError("hull { points {} points { x: 1e4 } points { y: 1e4 } points { x: 1e4 y: 1e4 z: 0.01 } }"),
            "shape.hull.points lie in one plane: they must be at least 0.1 m thick, got 0.01");
}

TEST(BadSceneTest, Compounds) {
  EXPECT_EQ(ShapeError("compound {}"), "shape.compound.children must be 1 to 255, got 0");
  EXPECT_EQ(ShapeError("compound { children { shape { compound {} } } }"),
            "shape.compound.children[0].shape must be a box, sphere, capsule, cylinder, cone or hull, got compound");
  EXPECT_EQ(ShapeError("compound { children { shape { plane {} } } }"),
            "shape.compound.children[0].shape must be a box, sphere, capsule, cylinder, cone or hull, got plane");
  EXPECT_EQ(ShapeError("compound { children { shape { sphere {} } } }"),
            "shape.compound.children[0].shape.sphere.radius must be > 0, got 0");
  EXPECT_EQ(ShapeError("compound { children {} }").substr(0, 47), "shape.compound.children[0].shape is missing: gi");
  EXPECT_EQ(ShapeError("compound { children { pose { orientation { x: 3 } } shape { sphere { radius: 1 } } } }"),
            "shape.compound.children[0].pose.orientation must have length 1, got 3");
}

TEST(BadSceneTest, Meshes) {
  const std::string vertices = "vertices {} vertices { x: 1 } vertices { z: 1 } vertices { x: 2 } ";
  EXPECT_EQ(ShapeError("mesh { " + vertices + "indices: [0, 2, 4] }"),
            "shape.mesh.indices[2] must be below 4, the number of vertices, got 4");
  EXPECT_EQ(ShapeError("mesh { " + vertices + "indices: [0, 2, 4294967295] }"),
            "shape.mesh.indices[2] must be below 4, the number of vertices, got 4294967295");
  EXPECT_EQ(ShapeError("mesh { " + vertices + "indices: [0, 2, 1, 0] }"),
            "shape.mesh.indices must be three a triangle, for 1 to 2000000 triangles, got 4");
  EXPECT_EQ(ShapeError("mesh { " + vertices + "}"),
            "shape.mesh.indices must be three a triangle, for 1 to 2000000 triangles, got 0");
  EXPECT_EQ(ShapeError("mesh { indices: [0, 1, 2] }"), "shape.mesh.vertices must be 3 to 1000000, got 0");
  EXPECT_EQ(ShapeError("mesh { " + vertices + "indices: [0, 2, 1, 0, 1, 3] }"),
            "shape.mesh.indices[3]: triangle 1 (0, 1, 3) has no area");
  EXPECT_EQ(ShapeError("mesh { " + vertices + "vertices { y: inf } indices: [0, 2, 1] }"),
            "shape.mesh.vertices[4].y must be a finite number, got inf");
}

TEST(BadSceneTest, HeightFields) {
  EXPECT_EQ(ShapeError("height_field { columns: 2 rows: 2 spacing: 1 heights: [0, 0, 0] }"),
            "shape.height_field.heights must be columns * rows = 4, got 3");
  EXPECT_EQ(ShapeError("height_field { columns: 1 rows: 2 spacing: 1 heights: [0, 0] }"),
            "shape.height_field.columns and rows must be at least 2, and their product at most 1000000, got 1 and 2");
  EXPECT_EQ(ShapeError("height_field { columns: 4294967295 rows: 4294967295 spacing: 1 }"),
            "shape.height_field.columns and rows must be at least 2, and their product at most 1000000, got 4294967295 "
            "and 4294967295");
  EXPECT_EQ(ShapeError("height_field { columns: 2 rows: 2 heights: [0, 0, 0, 0] }"),
            "shape.height_field.spacing must be > 0, got 0");
  EXPECT_EQ(ShapeError("height_field { columns: 2 rows: 2 spacing: 1 heights: [0, 0, nan, 0] }"),
            "shape.height_field.heights[2] must be a finite number, got nan");
}

TEST(BadSceneTest, Planes) {
  EXPECT_EQ(ShapeError("plane {}"), "shape.plane.normal must have length 1, got 0");
  EXPECT_EQ(ShapeError("plane { normal { y: 1 } offset: nan }"), "shape.plane.offset must be a finite number, got nan");
}

TEST(BadSceneTest, DynamicTerrain) {
  for (const char* shape : {"plane", "mesh", "height_field"}) {
    const auto parsed = ParseScene(absl::StrCat("bodies { shape { ", shape, " {} } }"), kFile);
    EXPECT_EQ(CrateError([&](v1::Body& b) { *b.mutable_shape() = parsed->bodies(0).shape(); }),
              absl::StrCat("shape.", shape, " is for static bodies only"));
  }
}

// --- Joints ---

TEST(BadSceneTest, JointToNowhere) {
  EXPECT_EQ(JointError("body_a: 77 point {}"), "body_a: there is no body 77");
  EXPECT_EQ(JointError("body_b: 78 point {}"), "body_b: there is no body 78");
  EXPECT_EQ(JointError("body_b: 4294967297 point {}"), "body_b: there is no body 4294967297");
  EXPECT_EQ(JointError("body_a: 0 point {}"), "body_a is missing");
  EXPECT_EQ(JointError("body_b: 40 point {}"), "ties body 40 to itself");
  EXPECT_EQ(JointError("body_a: 1 body_b: 0 point {}"), "ties static body 1 to the world");
  EXPECT_EQ(Error([](v1::Scene& s) {
              *s.add_bodies() = s.bodies(0);
              s.mutable_bodies(3)->set_id(2);
              s.mutable_joints(0)->set_body_a(1);
              s.mutable_joints(0)->set_body_b(2);
            }),
            "joints[0] (id 1): ties two static bodies, 1 and 2");
}

TEST(BadSceneTest, JointKinds) {
  EXPECT_EQ(
      JointError(""),
      "its kind is missing: give one of point, fixed, hinge, slider, cone_twist, six_dof, universal, hinge2, gear");
  EXPECT_EQ(JointError("hinge { limit { lower: 1 upper: -1 } }"),
            "hinge.limit.lower must not exceed upper, got 1 and -1");
  EXPECT_EQ(JointError("hinge { limit { upper: 7 } }"), "hinge.limit.upper must be -6.2832 to 6.2832, got 7");
  EXPECT_EQ(JointError("hinge { motor { max_force: -1 } }"), "hinge.motor.max_force must be >= 0, got -1");
  EXPECT_EQ(JointError("slider { limit { lower: nan } }"), "slider.limit.lower must be a finite number, got nan");
  EXPECT_EQ(JointError("cone_twist { swing_z: 4 }"), "cone_twist.swing_z must be 0 to 3.1416, got 4");
  EXPECT_EQ(JointError("six_dof { axes {} axes {} axes {} axes {} axes {} axes {} axes {} }"),
            "six_dof.axes must be at most 6, got 7");
  EXPECT_EQ(JointError("six_dof { axes {} axes { free: true limit {} } }"), "six_dof.axes[1] has a limit and is free");
  EXPECT_EQ(JointError("six_dof { axes { spring { damping: -1 } } }"),
            "six_dof.axes[0].spring.damping must be >= 0, got -1");
  EXPECT_EQ(JointError("universal { limit_b { lower: 1 } }"),
            "universal.limit_b.lower must not exceed upper, got 1 and 0");
  EXPECT_EQ(JointError("hinge2 { suspension { stiffness: inf } }"),
            "hinge2.suspension.stiffness must be a finite number, got inf");
  EXPECT_EQ(JointError("hinge { motor { target_velocity: 2e3 } }"),
            "hinge.motor.target_velocity must be -1000 to 1000, got 2000");
  EXPECT_EQ(JointError("slider { motor { target_velocity: -2e4 } }"),
            "slider.motor.target_velocity must be -10000 to 10000, got -20000");
  EXPECT_EQ(JointError("six_dof { axes {} axes {} axes {} axes { motor { target_velocity: 2e3 } } }"),
            "six_dof.axes[3].motor.target_velocity must be -1000 to 1000, got 2000");
  EXPECT_EQ(JointError("six_dof { axes {} axes {} axes {} axes {} axes { spring { rest: 7 } } }"),
            "six_dof.axes[4].spring.rest must be -6.2832 to 6.2832, got 7");
  EXPECT_EQ(JointError("gear {}"), "gear.ratio must not be 0");
  EXPECT_EQ(JointError("gear { ratio: -1e-9 }"), "gear.ratio must be at least 1e-06 either way, got -1e-09");
  EXPECT_EQ(JointError("body_b: 0 gear { ratio: 1 }"), "body_b is missing: a gear needs two bodies");
  EXPECT_EQ(JointError("point {} frame_a { orientation { y: 2 } }"), "frame_a.orientation must have length 1, got 2");
  EXPECT_EQ(JointError("point {} frame_b { position { y: nan } }"),
            "frame_b.position.y must be a finite number, got nan");
}

// --- Scatters, fields, player ---

template <class Change>
std::string ScatterError(Change change) {
  const std::string place = "scatters[0]: ";
  const std::string error = Error([&](v1::Scene& scene) { change(*scene.mutable_scatters(0)); });
  EXPECT_EQ(error.substr(0, place.size()), place);
  return error.substr(std::min(place.size(), error.size()));
}

TEST(BadSceneTest, Scatters) {
  EXPECT_EQ(ScatterError([](v1::Scatter& s) { s.set_jitter(1.01); }), "jitter must be 0 to 1, got 1.01");
  EXPECT_EQ(ScatterError([](v1::Scatter& s) { s.set_spacing(kNan); }), "spacing must be a finite number, got nan");
  EXPECT_EQ(ScatterError([](v1::Scatter& s) { s.clear_templates(); }), "templates is empty: give at least one body");
  EXPECT_EQ(ScatterError([](v1::Scatter& s) { s.set_count(0); }), "count must be > 0, got 0");
  EXPECT_EQ(ScatterError([](v1::Scatter& s) { s.set_first_id(0); }),
            "first_id must be 1 to 4294967295 with room for count = 9, got 0");
  EXPECT_EQ(ScatterError([](v1::Scatter& s) { s.set_first_id(4294967290); }),
            "first_id must be 1 to 4294967295 with room for count = 9, got 4294967290");
  EXPECT_EQ(ScatterError([](v1::Scatter& s) { s.mutable_area()->mutable_max()->set_x(-8); }),
            "area has no volume: min.x is -8, max.x is -8");
  EXPECT_EQ(ScatterError([](v1::Scatter& s) { s.mutable_area()->mutable_max()->set_x(11); }),
            "area is not inside the scene's bounds");
  EXPECT_EQ(ScatterError([](v1::Scatter& s) { s.mutable_area()->mutable_max()->set_z(-7); }),
            "area must be at least one spacing, 2 m, wide in x and z");
  EXPECT_EQ(ScatterError([](v1::Scatter& s) { s.set_count(64 * 5 + 1); }),
            "count = 321 needs layers up to 11 m, above the scene's bounds.max.y = 10");
}

TEST(BadSceneTest, Templates) {
  EXPECT_EQ(Error([](v1::Scene& s) { s.mutable_scatters(0)->mutable_templates(0)->set_mass(-1); }),
            "scatters[0].templates[0]: mass must be > 0, got -1");
  EXPECT_EQ(Error([](v1::Scene& s) {
              s.mutable_scatters(0)->mutable_templates(0)->set_name("pebble");
              s.mutable_scatters(0)->mutable_templates(0)->set_id(5);
            }),
            "scatters[0].templates[0] (\"pebble\"): id must be left out of a template, got 5");
  EXPECT_EQ(Error([](v1::Scene& s) { s.mutable_scatters(0)->mutable_templates(0)->mutable_pose(); }),
            "scatters[0].templates[0]: pose must be left out of a template");
}

TEST(BadSceneTest, Fields) {
  EXPECT_EQ(Error([](v1::Scene& s) { s.add_fields(); }), "fields[2]: its kind is missing: give one of vortex, uniform");
  EXPECT_EQ(Error([](v1::Scene& s) { s.mutable_fields(0)->mutable_vortex()->set_radius(0); }),
            "fields[0]: vortex.radius must be > 0, got 0");
  EXPECT_EQ(Error([](v1::Scene& s) { s.mutable_fields(0)->mutable_vortex()->set_gain(61); }),
            "fields[0]: vortex.gain must be 0 to 60, got 61");
  EXPECT_EQ(Error([](v1::Scene& s) { s.mutable_fields(0)->mutable_vortex()->mutable_center()->set_x(kNan); }),
            "fields[0]: vortex.center.x must be a finite number, got nan");
  EXPECT_EQ(Error([](v1::Scene& s) {
              s.mutable_fields(0)->mutable_vortex()->set_radius(1e6);
              s.mutable_fields(0)->mutable_vortex()->set_angular_velocity(-1);
            }),
            "fields[0]: vortex.angular_velocity * radius must be -10000 to 10000, got -1e+06");
  EXPECT_EQ(Error([](v1::Scene& s) { s.mutable_fields(1)->mutable_uniform()->clear_bounds(); }),
            "fields[1]: uniform.bounds has no volume: min.x is 0, max.x is 0");
  EXPECT_EQ(Error([](v1::Scene& s) { s.mutable_fields(1)->mutable_uniform()->mutable_acceleration()->set_y(kNan); }),
            "fields[1]: uniform.acceleration.y must be a finite number, got nan");
}

TEST(BadSceneTest, FieldsThatAddUpToTooMuch) {
  const auto vortex = [](v1::Scene& s, double x, double gain) {
    auto& added = *s.add_fields()->mutable_vortex();
    added.mutable_center()->set_x(x);
    added.set_radius(4);
    added.set_gain(gain);
  };
  EXPECT_EQ(
      Error([&](v1::Scene& s) { vortex(s, 8, 60); }).substr(0, 106),
      "fields[0]: vortex.gain, with that of the fields which overlap it, must be at most 60, got 61 (and 1 more)");
  v1::Scene apart = Sound();
  vortex(apart, 10, 60);
  EXPECT_TRUE(ResolveScene(apart, kFile).ok());
  EXPECT_EQ(Error([](v1::Scene& s) {
              *s.add_fields() = s.fields(1);
              s.mutable_fields(2)->mutable_uniform()->mutable_acceleration()->set_y(1e4);
            }).substr(0, 96),
            "fields[1]: uniform.acceleration, with that of the fields which overlap it, must be at most 10000");
  EXPECT_EQ(Error([](v1::Scene& s) {
              for (int i = 0; i < 255; ++i) *s.add_fields() = s.fields(1);
            }),
            "fields must be at most 256, got 257");
}

TEST(BadSceneTest, Player) {
  EXPECT_EQ(Error([](v1::Scene& s) { s.mutable_player()->mutable_body()->clear_mass(); }),
            "player.body: mass must be > 0, got 0");
  EXPECT_EQ(Error([](v1::Scene& s) { s.mutable_player()->mutable_body()->set_id(3); }),
            "player.body: id must be left out of a template, got 3");
  EXPECT_EQ(Error([](v1::Scene& s) {
              s.mutable_player()->mutable_body()->clear_mass();
              s.mutable_player()->mutable_body()->set_motion(v1::MOTION_STATIC);
            }),
            "player.body: motion must be MOTION_DYNAMIC");
  EXPECT_EQ(Error([](v1::Scene& s) { s.mutable_player()->clear_spawn_points(); }),
            "player: spawn_points is empty: give at least one");
  EXPECT_EQ(Error([](v1::Scene& s) { s.mutable_player()->add_spawn_points()->set_z(-10.5); }),
            "player: spawn_points[1] is outside the scene's bounds");
  EXPECT_EQ(Error([](v1::Scene& s) { s.mutable_player()->set_max_force(-5); }),
            "player: max_force must be >= 0, got -5");
  EXPECT_EQ(Error([](v1::Scene& s) { s.mutable_player()->set_max_force(1e6); }),
            "player: max_force must be at most 10000 m/s^2 times the body's mass, 800000, got 1e+06");
  EXPECT_EQ(Error([](v1::Scene& s) { s.mutable_player()->set_max_speed(kNan); }),
            "player: max_speed must be a finite number, got nan");
}

}  // namespace
}  // namespace tessera
