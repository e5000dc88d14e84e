// One test for each way in which a scene's shapes and joints can be wrong, with the error in full.
#include "core/world/scene_faults.h"

namespace tessera {
namespace {

using namespace scene_faults;

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
  // Thick enough in doubles, flat in the floats that collision computes with.
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

TEST(BadSceneTest, Visuals) {
  const std::string box = "box { half_extents { x: 1 y: 1 z: 1 } } ", hash(64, 'a');
  const auto visual = [&](const std::string& fields) {
    return ShapeError(box + "visuals { sha256: \"" + hash + "\" " + fields + " }");
  };
  EXPECT_EQ(ShapeError(box + "visuals { sha256: \"" + std::string(64, 'A') + "\" }"),
            "shape.visuals[0].sha256 must be 64 lower-case hexadecimal digits");
  EXPECT_EQ(ShapeError(box + "visuals {}"), "shape.visuals[0].sha256 must be 64 lower-case hexadecimal digits");
  EXPECT_EQ(visual("scale { x: 1 y: 0 z: -1 }"),
            "shape.visuals[0].scale.y must be 1e-06 to 1e+06 or the negative of it, got 0");
  EXPECT_EQ(visual("scale { x: nan }"),
            "shape.visuals[0].scale.x must be 1e-06 to 1e+06 or the negative of it, got nan");
  EXPECT_EQ(visual("pose { position { x: 1e9 } }"),
            "shape.visuals[0].pose.position.x must be -100000 to 100000, got 1e+09");
  std::string many;
  for (int i = 0; i < 65; ++i) many += "visuals { sha256: \"" + hash + "\" } ";
  EXPECT_EQ(ShapeError(box + many), "shape.visuals must be at most 64, got 65");
  EXPECT_EQ(ShapeError("compound { children { shape { " + box + "visuals { sha256: \"" + hash + "\" } } } }"),
            "shape.compound.children[0].shape.visuals: give them to the compound");
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
            "shape.height_field.columns and rows must be at least 2, and their product at most 1050625, got 1 and 2");
  EXPECT_EQ(ShapeError("height_field { columns: 4294967295 rows: 4294967295 spacing: 1 }"),
            "shape.height_field.columns and rows must be at least 2, and their product at most 1050625, got 4294967295 "
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

}  // namespace
}  // namespace tessera
