// Warnings name things that are hardly meant, and nothing else; the scenes that come along have none.
#include "core/world/scene_warnings.h"

#include <gmock/gmock.h>

#include <array>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "core/world/scene_load.h"

namespace tessera {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

// A scene with ground at y = 0, a player at (0, 1, 0), and these parts.
std::vector<std::string> WarningsOf(const std::string& parts, const std::string& player = "max_force: 100 max_speed: 5",
                                    const std::string& spawn = "y: 1") {
  const auto loaded = LoadScene(SceneForm::kText,
                                R"(
      name: "x"
      bounds { min { x: -50 y: -50 z: -50 } max { x: 50 y: 50 z: 50 } }
      bodies { id: 1 name: "ground" motion: MOTION_STATIC shape { plane { normal { y: 1 } } } }
      player { body { mass: 80 shape { sphere { radius: 0.5 } } } spawn_points { )" +
                                    spawn + " } " + player + " } " + parts,
                                "x.textproto");
  EXPECT_TRUE(loaded.ok()) << loaded.status();
  return loaded.ok() ? SceneWarnings(*loaded->scene) : std::vector<std::string>{"does not load"};
}

// A wedge 2 m wide, long and high, whose slope falls along x: its corners, and triangles that face outward.
constexpr char kRampHull[] =
    "hull { points { z: -1 } points { x: 2 z: -1 } points { y: 2 z: -1 } points { z: 1 } "
    "points { x: 2 z: 1 } points { y: 2 z: 1 } }";
std::string RampMesh(std::initializer_list<std::array<int, 3>> triangles) {
  std::string text =
      "mesh { vertices { z: -1 } vertices { x: 2 z: -1 } vertices { y: 2 z: -1 } vertices { z: 1 } "
      "vertices { x: 2 z: 1 } vertices { y: 2 z: 1 } ";
  for (const auto& triangle : triangles) {
    for (const int corner : triangle) text += "indices: " + std::to_string(corner) + " ";
  }
  return text + "}";
}

TEST(SceneWarningsTest, ASoundSceneHasNone) {
  EXPECT_THAT(WarningsOf(R"(
      bodies { id: 40 mass: 1 pose { position { x: 5 y: 3 } } shape { box { half_extents { x: 1 y: 1 z: 1 } } } }
      bodies { id: 41 mass: 1 pose { position { x: 7 y: 3 } } shape { sphere { radius: 0.5 } } }
      joints { id: 1 body_a: 40 body_b: 41 frame_a { position { x: 1 } } frame_b { position { x: -1 } } point {} })"),
              IsEmpty());
}

TEST(SceneWarningsTest, ASpawnPointInsideAStaticBodyIsNamedByItsShape) {
  EXPECT_THAT(WarningsOf("", "max_force: 100 max_speed: 5", "y: -1"),
              ElementsAre("player: spawn_points[0] is inside static body 1 \"ground\""));
  const auto buried = [](const std::string& shape, const std::string& spawn) {
    return WarningsOf("bodies { id: 7 motion: MOTION_STATIC pose { position { y: 10 } } shape { " + shape + " } }",
                      "max_force: 100 max_speed: 5", spawn);
  };
  const std::string says = "player: spawn_points[0] is inside static body 7";
  const std::string ramp =
      RampMesh({{3, 4, 5}, {0, 2, 1}, {0, 1, 4}, {0, 4, 3}, {0, 3, 5}, {0, 5, 2}, {1, 2, 5}, {1, 5, 4}});
  struct Row {
    std::string shape, inside, outside;
  };
  for (const Row& row : {
           Row{"box { half_extents { x: 1 y: 1 z: 1 } }", "x: 0.9 y: 10.9", "x: 1.1 y: 10"},
           Row{"sphere { radius: 1 }", "y: 10.9", "x: 0.8 y: 10.8"},
           Row{"capsule { radius: 1 half_height: 2 }", "y: 12.9", "x: 0.8 y: 12.8"},
           Row{"cylinder { radius: 1 half_height: 2 }", "x: 0.8 y: 11.9", "x: 0.8 y: 10 z: 0.8"},
           Row{"cone { radius: 1 height: 2 }", "x: 0.8 y: 9.1", "x: 0.8 y: 9.9"},
           Row{"compound { children { pose { position { x: 3 } } shape { sphere { radius: 1 } } } }", "x: 3 y: 10",
               "x: 1 y: 10"},
           Row{"height_field { columns: 2 rows: 2 spacing: 4 heights: 1 heights: 1 heights: 1 heights: 1 }", "y: 10.5",
               "y: 11.5"},
           Row{kRampHull, "x: 1.8 y: 10.1", "x: 1.8 y: 10.3"},
           Row{ramp, "x: 1.8 y: 10.1", "x: 1.8 y: 10.3"},
           Row{ramp, "x: 0.5 y: 11.4", "x: -0.1 y: 11.4"},
       }) {
    EXPECT_THAT(buried(row.shape, row.inside), ElementsAre(says)) << row.shape;
    EXPECT_THAT(buried(row.shape, row.outside), IsEmpty()) << row.shape;
  }
}

TEST(SceneWarningsTest, AnOpenMeshAndARoomHaveNobodyInsideThem) {
  const auto spawned_in = [](const std::string& mesh) {
    return WarningsOf("bodies { id: 7 motion: MOTION_STATIC pose { position { y: 10 } } shape { " + mesh + " } }",
                      "max_force: 100 max_speed: 5", "x: 1.8 y: 10.1");
  };
  EXPECT_THAT(spawned_in(RampMesh({{3, 4, 5}, {0, 2, 1}, {0, 3, 5}, {0, 5, 2}, {1, 2, 5}, {1, 5, 4}})), IsEmpty());
  EXPECT_THAT(
      spawned_in(RampMesh({{3, 5, 4}, {0, 1, 2}, {0, 4, 1}, {0, 3, 4}, {0, 5, 3}, {0, 2, 5}, {1, 5, 2}, {1, 4, 5}})),
      ElementsAre("body 7: the mesh is closed and its triangles face inward: bodies fall in and are held there"));
}

TEST(SceneWarningsTest, WhatAPlayerPassesThroughBuriesNobody) {
  const std::string box = "shape { box { half_extents { x: 1 y: 1 z: 1 } } } pose { position { y: 1 } } ";
  EXPECT_THAT(WarningsOf("bodies { id: 7 motion: MOTION_STATIC trigger: true " + box + "}"), IsEmpty());
  EXPECT_THAT(WarningsOf("layers { name: \"air\" ignores: \"default\" } "
                         "bodies { id: 7 motion: MOTION_STATIC layer: \"air\" " +
                         box + "}"),
              IsEmpty());
  EXPECT_THAT(WarningsOf("bodies { id: 7 mass: 1 " + box + "}"), IsEmpty()) << "it moves away";
}

TEST(SceneWarningsTest, FramesThatAreApartTearAJoint) {
  const auto joint = [](const std::string& kind, const std::string& frame) {
    return WarningsOf(
        "bodies { id: 40 mass: 1 pose { position { x: 5 y: 3 } } shape { sphere { radius: 0.5 } } } "
        "joints { id: 3 body_a: 40 frame_b { position { x: 5 y: 3 } } frame_a { position { " +
        frame + " } } " + kind + " }");
  };
  const std::string torn = "joints (id 3): the frames are 0.4 m apart at the start; the joint pulls them together";
  for (const char* kind : {"point {}", "fixed {}", "hinge {}", "universal {}", "six_dof {}"}) {
    EXPECT_THAT(joint(kind, "y: 0.4"), ElementsAre(torn)) << kind;
    EXPECT_THAT(joint(kind, "y: 0.04"), IsEmpty()) << kind;
  }
  EXPECT_THAT(joint("slider {}", "x: 0.4"), IsEmpty()) << "it slides along x";
  EXPECT_THAT(joint("slider {}", "z: 0.4"), ElementsAre(torn));
  EXPECT_THAT(joint("six_dof { axes { limit { lower: -1 upper: 1 } } }", "x: 0.4"), IsEmpty());
}

TEST(SceneWarningsTest, TriggersThatFallAndPlayersWhomNothingMoves) {
  EXPECT_THAT(WarningsOf("bodies { id: 40 name: \"zone\" mass: 1 trigger: true pose { position { x: 5 y: 3 } } "
                         "shape { sphere { radius: 0.5 } } }"),
              ElementsAre("body 40 \"zone\": is dynamic and a trigger: it falls through everything"));
  EXPECT_THAT(WarningsOf("bodies { id: 40 mass: 1 trigger: true gravity_scale: 0 pose { position { x: 5 y: 3 } } "
                         "shape { sphere { radius: 0.5 } } }"),
              IsEmpty());
  EXPECT_THAT(WarningsOf("", "max_speed: 5"),
              ElementsAre("player: max_force is 0 and there is no character, so inputs move nobody"));
}

TEST(SceneWarningsTest, AClosedMeshThatFacesInwardIsNamedAndAnOpenOneIsNot) {
  const auto tetrahedron = [](const std::string& indices) {
    return WarningsOf(
        "bodies { id: 7 motion: MOTION_STATIC pose { position { x: 20 } } shape { mesh { vertices {} "
        "vertices { x: 1 } vertices { y: 1 } vertices { z: 1 } " +
        indices + " } } }");
  };
  const auto triangles = [](std::initializer_list<int> corners) {
    std::string text;
    for (const int corner : corners) text += "indices: " + std::to_string(corner) + " ";
    return text;
  };
  EXPECT_THAT(tetrahedron(triangles({0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3})), IsEmpty());
  EXPECT_THAT(
      tetrahedron(triangles({0, 1, 2, 0, 3, 1, 0, 2, 3, 1, 3, 2})),
      ElementsAre("body 7: the mesh is closed and its triangles face inward: bodies fall in and are held there"));
  EXPECT_THAT(tetrahedron(triangles({0, 1, 2, 0, 3, 1, 0, 2, 3})), IsEmpty()) << "a room that one looks into";
}

TEST(SceneWarningsTest, ThereAreTwentyAtMostAndThenHowManyMore) {
  std::string zones;
  for (int i = 0; i < 25; ++i) {
    zones += "bodies { id: " + std::to_string(40 + i) +
             " mass: 1 trigger: true pose { position { x: 5 y: 3 } } "
             "shape { sphere { radius: 0.5 } } } ";
  }
  const auto warnings = WarningsOf(zones);
  ASSERT_EQ(warnings.size(), kMaxSceneWarnings + 1);
  EXPECT_EQ(warnings.back(), "and 5 more");
}

TEST(SceneWarningsTest, TheScenesThatComeAlongHaveNone) {
  int scenes = 0;
  for (const char* folder : {"/scenes", "/games"}) {
    for (const auto& entry : std::filesystem::recursive_directory_iterator(std::string(TESSERA_SOURCE_DIR) + folder)) {
      const std::string path = entry.path().string();
      if (entry.path().filename() != "scene.json" && !path.ends_with(".textproto")) continue;
      std::ifstream file(path);
      std::stringstream text;
      text << file.rdbuf();
      const auto loaded = LoadScene(SceneForm::kText, text.str(), path);
      if (!loaded.ok()) continue;  // another kind of file
      ++scenes;
      EXPECT_THAT(SceneWarnings(*loaded->scene), IsEmpty()) << path;
    }
  }
  EXPECT_GE(scenes, 3);
}

}  // namespace
}  // namespace tessera
