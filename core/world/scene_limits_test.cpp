// scene.proto states the limits that are checked.
#include <gmock/gmock.h>

#include <fstream>
#include <map>
#include <sstream>
#include <string>

#include "absl/strings/ascii.h"
#include "absl/strings/numbers.h"
#include "core/world/limits.h"
#include "core/world/scene_io.h"

namespace tessera {
namespace {

// The list at the head of scene.proto: "//   what it limits    number".
std::map<std::string, double> StatedLimits() {
  std::map<std::string, double> stated;
  std::ifstream file(std::string(TESSERA_SOURCE_DIR) + "/proto/tessera/v1/scene.proto");
  for (std::string line; std::getline(file, line) && !line.starts_with("syntax");) {
    if (!line.starts_with("//   ")) continue;
    const std::size_t number = line.rfind(' ') + 1;
    double value = 0;
    EXPECT_TRUE(absl::SimpleAtod(line.substr(number), &value)) << line;
    stated[std::string(absl::StripAsciiWhitespace(line.substr(5, number - 5)))] = value;
  }
  return stated;
}

TEST(SceneLimitsTest, TheProtoStatesWhatIsChecked) {
  const std::map<std::string, double> checked = {
      {"bodies, scattered ones included", kMaxBodies},
      {"joints", kMaxJoints},
      {"fields", kMaxFields},
      {"kinds of bodies", kMaxKinds},
      {"bytes of a kind's name", kMaxKindLength},
      {"layers, \"default\" included", kMaxLayers},
      {"bytes of a layer's name", kMaxLayerLength},
      {"bytes of another name", kMaxNameLength},
      {"points of a path", kMaxPathPoints},
      {"points of a hull", kMaxHullPoints},
      {"children of a compound", kMaxCompoundChildren},
      {"vertices of a mesh", kMaxMeshVertices},
      {"triangles of a mesh", kMaxMeshTriangles},
      {"samples of a height field", kMaxHeightSamples},
      {"visuals of a shape", kMaxVisuals},
      {"least tick_rate_hz", kMinTickRateHz},
      {"largest tick_rate_hz", kMaxTickRateHz},
      {"m of a coordinate", kMaxCoordinate_m},
      {"m of a shape's extent", kMaxExtent_m},
      {"m of a shape's least extent", kMinExtent_m},
      {"kg of a body", kMaxMass_kg},
      {"kg of a body, at least", kMinMass_kg},
      {"m/s of a body at the start", kMaxSpeed_m_s},
      {"rad/s of a body at the start", kMaxAngularSpeed_rad_s},
      {"m/s^2 of gravity and fields", kMaxAcceleration_m_s2},
      {"N, N m of motors, N/m of springs", kMaxForce},
      {"bytes of a scene's text", kMaxSceneText},
  };
  EXPECT_EQ(StatedLimits(), checked);
}

absl::Status HeightField(std::uint32_t columns, std::uint32_t rows) {
  auto scene = ParseScene(R"(
      name: "x"
      bounds { min { x: -600 y: -10 z: -600 } max { x: 600 y: 10 z: 600 } }
      bodies { id: 1 motion: MOTION_STATIC shape { height_field { spacing: 1 } } })",
                          "x.textproto");
  EXPECT_TRUE(scene.ok()) << scene.status();
  v1::Shape::HeightField& field = *scene->mutable_bodies(0)->mutable_shape()->mutable_height_field();
  field.set_columns(columns);
  field.set_rows(rows);
  field.mutable_heights()->Resize(static_cast<int>(columns * rows), 0.5F);
  return ResolveScene(*scene, "x.textproto").status();
}

TEST(SceneLimitsTest, ATerrainOfTheUsualSizeFits) {
  EXPECT_EQ(HeightField(1025, 1025), absl::OkStatus());
  EXPECT_EQ(
      HeightField(1026, 1025).message(),
      "x.textproto: bodies[0] (id 1): shape.height_field.columns and rows must be at least 2, and their product at "
      "most 1050625, got 1026 and 1025");
}

}  // namespace
}  // namespace tessera
