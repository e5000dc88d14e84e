// Levels as exporters write them and as nobody should, and the scenes that they become.
#include "cli/gltf/gltf_import.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "cli/gltf/gltf_fixture.h"
#include "core/world/proto_math.h"

namespace tessera::cli {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;

TEST(GltfImportTest, AMeshBecomesAStaticBodyWhereItsNodesPutIt) {
  Level level;
  const int child = level.Node({{"name", "floor"}, {"mesh", level.Square()}, {"scale", {5, 1, 3}}}, false);
  // Turned about y by 90 degrees: its x becomes -z.
  const double half = std::sqrt(0.5);
  level.Node({{"name", "root"},
              {"translation", {10, 2, 0}},
              {"rotation", {0, half, 0, half}},
              {"children", json::array({child})}});
  const GltfImport imported = Imported(level);
  EXPECT_EQ(imported.static_bodies, 1u);
  EXPECT_EQ(imported.triangles, 2u);
  ASSERT_EQ(imported.scene.bodies_size(), 1);
  const v1::Body& body = imported.scene.bodies(0);
  EXPECT_EQ(body.name(), "floor");
  EXPECT_EQ(body.motion(), v1::MOTION_STATIC);
  const Vec3d at = FromProto(body.pose().position());
  EXPECT_NEAR(Length(at - Vec3d{10, 2, 0}), 0, 1e-9);
  double x = 0, z = 0;
  for (const v1::Vec3& vertex : body.shape().mesh().vertices()) {
    x = std::max(x, std::abs(vertex.x()));
    z = std::max(z, std::abs(vertex.z()));
    EXPECT_NEAR(vertex.y(), 0, 1e-9);
  }
  EXPECT_NEAR(x, 3, 1e-6);
  EXPECT_NEAR(z, 5, 1e-6);
}

// The side of a triangle that is seen from outside stays outside.
TEST(GltfImportTest, AMirroredMeshKeepsItsOutside) {
  for (const double side : {1.0, -1.0}) {
    Level level;
    level.Node({{"mesh", level.Square()}, {"scale", {side, 1, 1}}});
    const v1::Shape::TriangleMesh mesh = Imported(level).scene.bodies(0).shape().mesh();
    ASSERT_EQ(mesh.indices_size(), 6);
    const auto corner = [&](int i) { return FromProto(mesh.vertices(static_cast<int>(mesh.indices(i)))); };
    EXPECT_GT(Cross(corner(1) - corner(0), corner(2) - corner(0)).y, 0) << side;
  }
}

TEST(GltfImportTest, StripsAndFansAndListsWithoutIndicesAreTriangles) {
  const std::vector<std::array<float, 3>> strip = {{0, 0, 0}, {0, 0, 1}, {1, 0, 0}, {1, 0, 1}, {2, 0, 0}};
  for (const auto& [mode, triangles] : {std::pair(4, 1u), std::pair(5, 3u), std::pair(6, 3u)}) {
    Level level;
    level.Node({{"mesh", level.Mesh({{"attributes", {{"POSITION", level.Positions(strip)}}}, {"mode", mode}})}});
    const GltfImport imported = Imported(level);
    const v1::Shape::TriangleMesh& mesh = imported.scene.bodies(0).shape().mesh();
    // One triangle of the fan is flat: 0, (1, 0, 0) and (2, 0, 0) lie on one line, but those are not neighbours in it.
    EXPECT_EQ(imported.triangles, triangles) << mode;
    if (mode == 6) continue;  // this fan folds over itself
    for (int i = 0; i + 2 < mesh.indices_size(); i += 3) {
      const auto corner = [&](int k) { return FromProto(mesh.vertices(static_cast<int>(mesh.indices(i + k)))); };
      EXPECT_GT(Cross(corner(1) - corner(0), corner(2) - corner(0)).y, 0) << "mode " << mode << " triangle " << i / 3;
    }
  }
}

TEST(GltfImportTest, BodiesOfOmiPhysicsBecomeWhatTheySay) {
  Level level;
  level.Node({{"mesh", level.Square()}});
  const int box = level.Shape({{"type", "box"}, {"box", {{"size", {1, 2, 3}}}}});
  const int ball = level.Shape({{"type", "sphere"}, {"sphere", {{"radius", 0.25}}}});
  json crate = Physics("dynamic", {{"mass", 12.5}, {"linearVelocity", {1, 0, 0}}});
  crate["collider"] = {{"shape", box}};
  level.Node({{"name", "crate"}, {"translation", {0, 5, 0}}, {"extensions", {{"OMI_physics_body", crate}}}});
  level.Node({{"name", "goal"},
              {"translation", {4, 1, 0}},
              {"extensions", {{"OMI_physics_body", {{"trigger", {{"shape", ball}}}}}}}});
  json lift = Physics("kinematic");
  lift["collider"] = {{"shape", box}};
  level.Node({{"name", "lift"}, {"translation", {-4, 1, 0}}, {"extensions", {{"OMI_physics_body", lift}}}});
  const GltfImport imported = Imported(level);
  EXPECT_EQ(imported.dynamic_bodies, 1u);
  EXPECT_EQ(imported.triggers, 1u);
  EXPECT_EQ(imported.kinematic_bodies, 1u);
  EXPECT_EQ(imported.static_bodies, 1u);
  for (const v1::Body& body : imported.scene.bodies()) {
    if (body.name() != "crate") continue;
    EXPECT_EQ(body.mass(), 12.5);
    EXPECT_EQ(body.linear_velocity().x(), 1);
    EXPECT_EQ(body.shape().box().half_extents().z(), 1.5);
  }
}

TEST(GltfImportTest, AMotionIsTakenAsItSaysAndWhatItHasBesideIsSaid) {
  Level level;
  const int capsule = level.Shape({{"type", "capsule"}, {"capsule", {{"radius", 0.5}, {"height", 2}}}});
  const int cylinder = level.Shape({{"type", "cylinder"}, {"cylinder", {{"radius", 0.25}, {"height", 3}}}});
  const auto add = [&](const char* name, int shape, const json& motion) {
    json body = Physics("dynamic", motion);
    body["collider"] = {{"shape", shape}};
    level.Node({{"name", name}, {"translation", {0, 5, 0}}, {"extensions", {{"OMI_physics_body", body}}}});
  };
  add("balloon", capsule,
      {{"mass", 2}, {"gravityFactor", -0.5}, {"angularVelocity", {0, 3, 0}}, {"centerOfMass", {0, 0, 0}}});
  add("skittle", cylinder, {{"mass", 3}, {"centerOfMass", {0, -0.5, 0}}, {"inertiaDiagonal", {1, 2, 3}}});
  const GltfImport imported = Imported(level);
  ASSERT_EQ(imported.dynamic_bodies, 2u);
  for (const v1::Body& body : imported.scene.bodies()) {
    if (body.name() == "balloon") {
      EXPECT_EQ(body.gravity_scale(), -0.5);
      EXPECT_EQ(body.angular_velocity().y(), 3);
      EXPECT_EQ(body.shape().capsule().radius(), 0.5);
      EXPECT_EQ(body.shape().capsule().half_height(), 1);
    } else {
      EXPECT_FALSE(body.has_inertia());
      EXPECT_EQ(body.shape().cylinder().radius(), 0.25);
      EXPECT_EQ(body.shape().cylinder().half_height(), 1.5);
    }
  }
  EXPECT_THAT(imported.notes, Contains("left out: 1 centres of mass beside those of their shapes"));
  EXPECT_THAT(imported.notes, Contains("left out: 1 moments of inertia beside those of their shapes"));
}

// All that hangs below a body that moves is part of it, and the body is where its mass is.
TEST(GltfImportTest, ShapesBelowABodyAreOneBodyAboutItsCentreOfMass) {
  Level level;
  const int box = level.Shape({{"type", "box"}, {"box", {{"size", {1, 1, 1}}}}});
  const json part = {{"OMI_physics_body", {{"collider", {{"shape", box}}}}}};
  const int right = level.Node({{"translation", {3, 0, 0}}, {"extensions", part}}, false);
  const int left = level.Node({{"translation", {1, 0, 0}}, {"extensions", part}}, false);
  level.Node({{"name", "dumb-bell"},
              {"translation", {0, 10, 0}},
              {"children", json::array({right, left})},
              {"extensions", {{"OMI_physics_body", Physics("dynamic", {{"mass", 4}})}}}});
  const GltfImport imported = Imported(level);
  ASSERT_EQ(imported.scene.bodies_size(), 1);
  const v1::Body& body = imported.scene.bodies(0);
  EXPECT_EQ(body.shape().compound().children_size(), 2);
  EXPECT_NEAR(Length(FromProto(body.pose().position()) - Vec3d{2, 10, 0}), 0, 1e-6);
}

TEST(GltfImportTest, WhatIsLeftOutIsSaid) {
  Level level;
  level.Node({{"mesh", level.Square()}, {"extensions", {{"KHR_lights_punctual", {{"light", 0}}}}}});
  const int points = level.Positions({{0, 0, 0}, {1, 0, 0}});
  level.Node({{"mesh", level.Mesh({{"attributes", {{"POSITION", points}}}, {"mode", 0}})}});
  const int flat = level.Positions({{0, 0, 0}, {1, 0, 0}, {2, 0, 0}});
  level.Node({{"mesh", level.Mesh({{"attributes", {{"POSITION", flat}}}})}});
  const GltfImport imported = Imported(level);
  EXPECT_EQ(imported.static_bodies, 1u);
  EXPECT_THAT(imported.notes, Contains("left out: 1 lights"));
  EXPECT_THAT(imported.notes, Contains("left out: 1 primitives of points or lines"));
  EXPECT_THAT(imported.notes, Contains("left out: 1 triangles without area"));
  EXPECT_THAT(imported.notes, Contains("left out: 2 meshes without a triangle"));
  EXPECT_THAT(imported.notes, Contains(HasSubstr("nobody can play in it")));
}

TEST(GltfImportTest, EmptyNodesNamedSpawnAreWherePlayersBegin) {
  Level level;
  level.Node({{"mesh", level.Square()}});
  level.Node({{"name", "Spawn.001"}, {"translation", {0.5, 0, 0.5}}});
  const GltfImport imported = Imported(level);
  EXPECT_EQ(imported.spawn_points, 1u);
  ASSERT_EQ(imported.scene.player().spawn_points_size(), 1);
  EXPECT_NEAR(imported.scene.player().spawn_points(0).y(), 0.95, 1e-9);
}

// --- What a file may claim.

TEST(GltfImportTest, IndicesLengthsAndOffsetsAreChecked) {
  const auto broken = [](const std::function<void(json&)>& change) {
    Level level;
    level.Node({{"mesh", level.Square()}});
    change(level.document);
    return FaultOf(level);
  };
  EXPECT_THAT(broken([](json& d) { d["accessors"][0]["count"] = 5; }), HasSubstr("elements end beyond"));
  EXPECT_THAT(broken([](json& d) { d["accessors"][0]["count"] = 4'000'000'000u; }), HasSubstr("elements end beyond"));
  EXPECT_THAT(broken([](json& d) { d["accessors"][0]["byteOffset"] = 1000; }), HasSubstr("elements end beyond"));
  EXPECT_THAT(broken([](json& d) { d["bufferViews"][0]["byteLength"] = 100'000; }), HasSubstr("beyond its buffer"));
  EXPECT_THAT(broken([](json& d) { d["bufferViews"][0]["byteStride"] = 4; }), HasSubstr("stride"));
  EXPECT_THAT(broken([](json& d) { d["nodes"][0]["mesh"] = 7; }), HasSubstr("there is no mesh 7"));
  EXPECT_THAT(broken([](json& d) { d["accessors"][0]["type"] = "VEC2"; }), HasSubstr("elements of another type"));
  EXPECT_THAT(broken([](json& d) { d["meshes"][0]["primitives"][0]["indices"] = 9; }),
              HasSubstr("indices accessor out of bounds"));
  Level beyond;
  const int positions = beyond.Positions({{0, 0, 0}, {0, 0, 1}, {1, 0, 0}});
  const int indices = beyond.Indices<std::uint32_t>({0, 1, 3}, kUnsignedInt);
  beyond.Node({{"mesh", beyond.Mesh({{"attributes", {{"POSITION", positions}}}, {"indices", indices}})}});
  EXPECT_THAT(FaultOf(beyond), HasSubstr("index 2 is 3, of 3 vertices"));
}

TEST(GltfImportTest, NodesThatAreBelowThemselvesOrNowhereAreRefused) {
  Level cycle;
  cycle.Node({{"mesh", cycle.Square()}, {"children", json::array({0})}});
  EXPECT_THAT(FaultOf(cycle), HasSubstr("below two nodes, or below itself"));
  Level missing;
  missing.Node({{"mesh", missing.Square()}, {"children", json::array({5})}});
  EXPECT_THAT(FaultOf(missing), HasSubstr("5"));
  Level far;
  far.Node({{"mesh", far.Square()}, {"scale", {1e9, 1e9, 1e9}}});
  EXPECT_THAT(FaultOf(far), HasSubstr("Is its scale in metres?"));
  Level empty;
  empty.Node({{"name", "nothing"}});
  EXPECT_THAT(FaultOf(empty), HasSubstr("has nothing that a body could be made of"));
}

TEST(GltfImportTest, WhatNeedsMoreThanIsKnownIsRefusedByName) {
  Level level;
  level.Node({{"mesh", level.Square()}});
  level.document["extensionsUsed"] = {"KHR_draco_mesh_compression"};
  level.document["extensionsRequired"] = {"KHR_draco_mesh_compression"};
  EXPECT_THAT(FaultOf(level), HasSubstr("KHR_draco_mesh_compression"));
}

TEST(GltfImportTest, ShapesThatCannotBeAreRefusedByTheirNode) {
  const auto with = [](json shape, json node) {
    Level level;
    const int number = level.Shape(std::move(shape));
    json physics = Physics("dynamic");
    physics["collider"] = {{"shape", number}};
    node["name"] = "thing";
    node["extensions"] = {{"OMI_physics_body", physics}};
    level.Node(std::move(node));
    return FaultOf(level);
  };
  EXPECT_THAT(with({{"type", "sphere"}, {"sphere", json::object()}}, {{"scale", {1, 2, 1}}}),
              HasSubstr("node 0 \"thing\""));
  EXPECT_THAT(with({{"type", "torus"}}, json::object()), HasSubstr("type \"torus\" is not"));
  EXPECT_THAT(with({{"type", "box"}}, {{"scale", {0, 1, 1}}}), HasSubstr("sheared or flat"));
  EXPECT_THAT(with({{"type", "trimesh"}, {"trimesh", {{"mesh", 3}}}}, json::object()), HasSubstr("there is no mesh 3"));
}

TEST(GltfImportTest, ValuesOfAnotherKindAreAsIfTheyWereNotThere) {
  // Each field of a shape that takes a number, a list or an object, one after the other.
  const json wrong = {5, "text", json::array({1}), true};
  for (const json& value : wrong) {
    SCOPED_TRACE(value.dump());
    for (const std::string type : {"box", "sphere", "capsule", "cylinder", "trimesh"}) {
      Level level;
      json physics = Physics("dynamic");
      physics["collider"] = {{"shape", level.Shape({{"type", type}, {type, value}})}};
      level.Node({{"extensions", {{"OMI_physics_body", physics}}}});
      EXPECT_EQ(FaultOf(level).empty(), type != "trimesh") << FaultOf(level);
    }
    Level listed;
    listed.Node({{"mesh", listed.Square()}});
    listed.document["extensions"]["OMI_physics_shape"] = value;
    EXPECT_EQ(FaultOf(listed), "");
    Level body;
    body.Node({{"mesh", body.Square()}, {"extensions", {{"OMI_physics_body", {{"motion", value}}}}}});
    EXPECT_THAT(FaultOf(body), HasSubstr("motion.type is \"\""));
  }
}

TEST(GltfImportTest, BuffersThatAreMissingAreRefused) {
  Level level;
  level.Node({{"mesh", level.Square()}});
  json beside = level.document;
  beside["buffers"] = json::array({{{"uri", "nowhere.bin"}, {"byteLength", 60}}});
  const std::string text = beside.dump();
  const absl::Status status =
      ImportGltf({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()}, ".", "level").status();
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(status.message()), HasSubstr("nowhere.bin"));
  EXPECT_EQ(status.message().find('\n'), std::string::npos);
  Level hollow;  // says that it has a buffer, and has none
  hollow.document = level.document;
  hollow.document["buffers"] = json::array({{{"byteLength", 60}}});
  EXPECT_NE(FaultOf(hollow), "");
}

TEST(GltfImportTest, AMillionNodesAreRefused) {
  std::string nodes = "{}";
  for (int i = 1; i < 1'000'000; ++i) nodes += ",{}";
  const std::string text = R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[)" + nodes + "]}";
  const absl::Status status =
      ImportGltf({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()}, ".", "level").status();
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(status.message()), HasSubstr("has 1000000 nodes; at most 500000 are taken"));
}

TEST(GltfImportTest, RubbishIsRefusedInALine) {
  for (const std::string rubbish : {"", "glTF", "{}", "hello", "glTF\x02\0\0\0\xff\xff\xff\xff"}) {
    const std::vector<std::uint8_t> bytes(rubbish.begin(), rubbish.end());
    const absl::Status status = ImportGltf(bytes, ".", "level").status();
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument) << rubbish;
    EXPECT_EQ(status.message().find('\n'), std::string::npos);
  }
  // A level that was cut anywhere.
  Level level;
  level.Node({{"mesh", level.Square()}});
  const std::vector<std::uint8_t> whole = level.Glb();
  for (std::size_t size = 0; size < whole.size(); size += 7) {
    EXPECT_FALSE(ImportGltf(std::span(whole).first(size), ".", "level").ok()) << size;
  }
}

}  // namespace
}  // namespace tessera::cli
