#include "core/world/packed_scene.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>

#include "core/world/scene_load.h"
#include "core/world/testing/same_scene.h"
#include "scenes/measured/golden.h"

namespace tessera {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;
using PackedBytes = std::vector<std::uint8_t>;

std::shared_ptr<const Scene> SceneOf(const std::string& text) {
  auto loaded = LoadScene(SceneForm::kText, text, "test.textproto");
  EXPECT_TRUE(loaded.ok()) << loaded.status();
  return loaded->scene;
}

// Packs, unpacks and compares; the same scene must give the same bytes again.
void ExpectComesBack(const Scene& scene) {
  const PackedBytes packed = PackScene(scene);
  const auto same = UnpackScene(packed);
  ASSERT_TRUE(same.ok()) << scene.name << ": " << same.status();
  EXPECT_EQ(SceneDifference::Between(scene, **same), "") << scene.name;
  EXPECT_EQ(PackScene(**same), packed) << scene.name;
}

// All that no scene of the repository has.
constexpr const char* kEverything = R"(
  name: "everything" bounds { min { x: -50 y: -5 z: -50 } max { x: 50 y: 50 z: 50 } } tick_rate_hz: 120
  gravity { x: 0.5 y: -3 }
  properties { name: "flag" flag: true } properties { name: "n" number: -9000000000 } properties { name: "r" real: 0.1 }
  properties { name: "team" text: "red" } properties { name: "v" vector { x: 1 y: -2 z: 3 } visible_to: VISIBILITY_TEAM }
  properties { name: "of" body: 4294967297 } properties { name: "b" bytes: "\000\377" visible_to: VISIBILITY_SERVERS }
  instance_properties { name: "round" number: 3 } team_property: "team"
  layers { name: "stone" } layers { name: "air" ignores: "stone" }
  materials { name: "wood" friction: 0.3 rolling_friction: 0.01 spinning_friction: 0.02 restitution: 0.4 }
  view { radius: 20 bytes_per_second: 20000 }
  fields { uniform { bounds { min { x: 0 y: 0 z: 0 } max { x: 5 y: 5 z: 5 } } acceleration { x: 3 } } }
  fields { vortex { center { x: -9 } radius: 4 angular_velocity: -2 gain: 0.5 } }
  bodies { id: 1 motion: MOTION_STATIC trigger: true layer: "stone" shape { sphere { radius: 2 } } }
  bodies {
    id: 7 name: "crate" mass: 3 inertia { x: 1 y: 1.5 z: 2 } layer: "air" kind: "crate" material: "wood"
    linear_damping: 0.25 angular_damping: 0.5 gravity_scale: -2 never_sleeps: true visible_to: VISIBILITY_TEAM
    linear_velocity { x: -1 y: 2 z: 3 } angular_velocity { z: 5 }
    pose { position { x: 3 y: 4 z: -5 } orientation { x: 0.6 w: -0.8 } }
    properties { name: "team" text: "blue" } properties { name: "b" bytes: "\001\002" }
    shape {
      compound {
        children { shape { box { half_extents { x: 1 y: 2 z: 3 } } } }
        children { pose { position { y: 4 } orientation { z: 1 w: 0 } } shape { sphere { radius: 2 } } }
      }
    }
  }
  bodies {
    id: 9 shape { box { half_extents { x: 1 y: 2 z: 3 } } } pose { position { y: 9 } }
    kinematic {
      path { repeat: REPEAT_PING_PONG spin { y: 1 }
             points { position { x: 8 y: 9 } speed: 2 } points { position { y: 9 } time: 30 } }
    }
  }
  bodies { id: 10 shape { cone { radius: 1 height: 2 } } pose { position { y: 20 } } kinematic {} }
  player {
    body { mass: 70 shape { capsule { radius: 0.4 half_height: 0.5 } } gravity_scale: 2 }
    spawn_points { y: 1 } spawn_points { x: 4 y: 1 }
    max_force: 100 max_speed: 5 max_force_up: 3
  }
  prefabs {
    name: "flail"
    bodies { mass: 1 shape { sphere { radius: 0.25 } } }
    bodies { mass: 2 shape { sphere { radius: 0.25 } } pose { position { x: 1 } } }
    joints { body_a: 1 body_b: 2 hinge { limit { lower: -1 upper: 1 } motor { target_velocity: 2 max_force: 3 } } }
  })";

TEST(PackedSceneTest, EveryTextSceneComesBackFieldByField) {
  int scenes = 0;
  for (const auto& entry : std::filesystem::directory_iterator(std::string(TESSERA_SOURCE_DIR) + "/scenes")) {
    if (entry.path().extension() != ".textproto") continue;
    std::ifstream file(entry.path());
    const std::string text(std::istreambuf_iterator<char>(file), {});
    ExpectComesBack(*SceneOf(text));
    ++scenes;
  }
  EXPECT_GE(scenes, 9);
}

TEST(PackedSceneTest, EveryGoldenSceneComesBackFieldByField) {
  for (const scenes::GoldenScene& golden : scenes::GoldenScenes()) ExpectComesBack(golden.make());
}

TEST(PackedSceneTest, WhatNoSceneHasComesBackToo) { ExpectComesBack(*SceneOf(kEverything)); }

// A scene of two boxes of one form, of which one is drawn by meshes.
Scene SceneWithVisuals() {
  Scene scene = *SceneOf(kEverything);
  Shape drawn{BoxShape{{1, 2, 3}}};
  drawn.visuals = {{.sha256 = std::string(64, 'a'), .mesh = 3, .pose = {{1, -2, 0.1}, {0, 0, 0.6, 0.8}}},
                   {.sha256 = std::string(64, 'b'), .mesh = 0, .pose = {}, .scale = {-0.01, 0.01, 2}}};
  scene.bodies[0].shape = std::make_shared<const Shape>(Shape{BoxShape{{1, 2, 3}}});
  scene.bodies[1].shape = std::make_shared<const Shape>(drawn);
  return scene;
}

TEST(PackedSceneTest, VisualsComeBackAndShapesThatDifferInThemAreTwo) {
  const Scene scene = SceneWithVisuals();
  ExpectComesBack(scene);
  const auto same = UnpackScene(PackScene(scene));
  ASSERT_TRUE(same.ok()) << same.status();
  EXPECT_TRUE((*same)->bodies[0].shape->visuals.empty());
  ASSERT_EQ((*same)->bodies[1].shape->visuals.size(), 2u);
  EXPECT_EQ((*same)->bodies[1].shape->visuals[1].scale, (Vec3d{-0.01, 0.01, 2}));
}

TEST(PackedSceneTest, ASceneWithoutVisualsIsPackedAsBeforeThereWereAny) {
  EXPECT_EQ(PackScene(*SceneOf(kEverything))[4], 1);
  EXPECT_EQ(PackScene(SceneWithVisuals())[4], 2);
}

TEST(PackedSceneTest, DamagedVisualsAreNamed) {
  const auto fault = [](auto change) {
    Scene scene = SceneWithVisuals();
    Shape shape = *scene.bodies[1].shape;
    change(shape);
    scene.bodies[1].shape = std::make_shared<const Shape>(shape);
    return std::string(UnpackScene(PackScene(scene)).status().message());
  };
  EXPECT_THAT(fault([](Shape& s) { s.visuals[0].sha256[5] = 'G'; }), HasSubstr("visuals[0].sha256: is no hash"));
  EXPECT_THAT(fault([](Shape& s) { s.visuals[1].scale.y = 0; }), HasSubstr("visuals[1].scale: is too small"));
  EXPECT_THAT(fault([](Shape& s) { s.visuals.resize(65, s.visuals[0]); }), HasSubstr("visuals: 65 of them"));
  EXPECT_THAT(fault([](Shape& s) {
                CompoundShape compound;
                compound.children.push_back({{}, SceneWithVisuals().bodies[1].shape});
                s.form = compound;
              }),
              HasSubstr("children[0].shape: has visuals"));
}

TEST(PackedSceneTest, ADifferenceIsNamed) {
  const Scene scene = *SceneOf(kEverything);
  Scene other = scene;
  other.bodies[1].initial.position.x = -0.0;
  EXPECT_EQ(SceneDifference::Between(scene, other), "bodies[1].initial.pose");
  other = scene;
  other.prefabs[0].joints[0].kind = PointJoint{};
  EXPECT_EQ(SceneDifference::Between(scene, other), "prefabs[0].joints[0].kind");
}

TEST(PackedSceneTest, RandomStatesComeBackToTheBit) {
  std::mt19937_64 random(7);
  const auto real = [&](double most) { return (static_cast<double>(random() >> 11) / (1ull << 52) - 1) * most; };
  const auto vector = [&](double most) { return Vec3d{real(most), real(most), real(most)}; };
  for (int round = 0; round < 50; ++round) {
    Scene scene = *SceneOf(kEverything);
    for (int i = 0; i < 100; ++i) {
      BodyDef body = scene.bodies[1];
      body.id = BodyId(scene.bodies.back().id.value() + 1 + random() % 1000);
      body.name = std::string(random() % 64, 'x');
      body.shape = scene.bodies[random() % 2].shape;
      body.mass_kg = 1 + std::abs(real(1000));
      body.inertia_kg_m2.reset();
      if (random() % 2 == 0) body.initial = BodyState();
      body.initial.position = vector(1e6);
      body.initial.position.x = random() % 2 == 0 ? -0.0 : body.initial.position.x;
      if (random() % 2 == 0) {
        body.initial.orientation = Normalized(Quatd{real(1), real(1), real(1), 1.5});
        body.initial.linear_velocity = Vec3f(vector(5000));
        body.initial.angular_velocity = {-0.0f, 0, 0};
      }
      body.material = random() % 2 == 0 ? Material() : body.material;
      body.properties = random() % 2 == 0 ? PropertySet() : body.properties;
      body.trigger = random() % 2 == 0;
      scene.bodies.push_back(std::move(body));
    }
    ExpectComesBack(scene);
  }
}

TEST(PackedSceneTest, ShapesThatAreAlikeStandOnce) {
  Scene one = *SceneOf(kEverything);
  for (int i = 0; i < 1000; ++i) {
    BodyDef body = one.bodies[1];
    body.id = BodyId(1000 + static_cast<std::uint64_t>(i));
    body.shape = std::make_shared<const Shape>(*body.shape);  // a copy with the same content
    one.bodies.push_back(std::move(body));
  }
  const auto same = UnpackScene(PackScene(one));
  ASSERT_TRUE(same.ok()) << same.status();
  EXPECT_EQ((*same)->bodies[5].shape, (*same)->bodies[900].shape);
  EXPECT_LT(PackScene(one).size(), 1000u * 300);
}

TEST(PackedSceneTest, NoPartOfItIsASceneAndNothingMayFollow) {
  PackedBytes packed = PackScene(*SceneOf(kEverything));
  for (std::size_t size = 0; size < packed.size(); ++size) {
    const auto read = UnpackScene(std::span(packed).first(size));
    ASSERT_EQ(read.status().code(), absl::StatusCode::kInvalidArgument) << size;
    ASSERT_THAT(std::string(read.status().message()), StartsWith("packed scene: ")) << size;
  }
  packed.push_back(0);
  EXPECT_EQ(UnpackScene(packed).status().message(), "packed scene: more bytes follow");
}

// A changed byte is refused, or gives a scene that packs again.
TEST(PackedSceneTest, AnyChangedByteIsReadOrRefusedInOrder) {
  const PackedBytes packed = PackScene(*SceneOf(kEverything));
  for (std::size_t at = 0; at < packed.size(); ++at) {
    for (const int change : {1, 0x40, 0x80, 0xff}) {
      PackedBytes changed = packed;
      changed[at] = static_cast<std::uint8_t>(changed[at] ^ change);
      const auto read = UnpackScene(changed);
      if (read.ok()) ExpectComesBack(**read);
    }
  }
}

TEST(PackedSceneTest, NamesThePlaceThatIsWrong) {
  const auto fault = [](auto change) {
    Scene scene = *SceneOf(kEverything);
    change(scene);
    return std::string(UnpackScene(PackScene(scene)).status().message());
  };
  EXPECT_THAT(fault([](Scene& s) { s.bodies[1].mass_kg = -1; }),
              StartsWith("packed scene: bodies[1].mass_kg: -1 is not within"));
  EXPECT_THAT(fault([](Scene& s) { s.bodies[1].mass_kg = 1e-9; }), StartsWith("packed scene: bodies[1]."));
  EXPECT_THAT(fault([](Scene& s) { s.bodies[1].initial.position.y = 1e9; }),
              StartsWith("packed scene: bodies[1].position: 1e+09 is not within"));
  EXPECT_EQ(fault([](Scene& s) { s.bodies[2].id = BodyId(7); }), "packed scene: bodies[2].id: does not ascend");
  EXPECT_THAT(fault([](Scene& s) { s.bodies[1].kind = 77; }), StartsWith("packed scene: bodies[1].kind: 77"));
  EXPECT_THAT(fault([](Scene& s) { s.bounds.max.x = s.bounds.min.x; }), StartsWith("packed scene: bounds: "));
  EXPECT_THAT(fault([](Scene& s) { s.prefabs[0].joints[0].body_b = BodyId(9); }),
              StartsWith("packed scene: prefabs[0].joints[0].body_a: is not in the prefab"));
  EXPECT_THAT(fault([](Scene& s) { s.player->spawn_points.clear(); }),
              StartsWith("packed scene: spawn_points: 0 of them"));
  EXPECT_THAT(fault([](Scene& s) {
                JointDef& joint = s.joints.emplace_back();
                joint.id = JointId(1);
                joint.body_a = BodyId(7);
                joint.body_b = BodyId(8);
              }),
              HasSubstr("joints[0].body_b: there is no such body"));
  EXPECT_THAT(fault([](Scene& s) { s.bodies[1].shape = std::make_shared<Shape>(Shape{PlaneShape{}}); }),
              HasSubstr("bodies[1].shape: is for static bodies only"));
  EXPECT_THAT(fault([](Scene& s) {
                s.bodies[0].shape =
                    std::make_shared<Shape>(Shape{TriangleMeshShape{{{0, 0, 0}, {1, 0, 0}, {2, 0, 0}}, {{0, 1, 2}}}});
              }),
              HasSubstr("triangles[0].area: there is none"));
  PackedBytes other = PackScene(*SceneOf(kEverything));
  other[4] = 4;
  EXPECT_EQ(UnpackScene(other).status().message(), "packed scene: of version 4; this program reads 1 to 3");
  other[4] = 3;
  EXPECT_EQ(UnpackScene(other).status().message(), "packed scene: TILE: truncated");
}

// Ten bytes at a time, and the same comes out, or the same fault.
TEST(PackedSceneTest, ReadInGoesItIsTheSame) {
  const PackedBytes packed = PackScene(*SceneOf(kEverything));
  const auto in_goes = [](std::span<const std::uint8_t> bytes, std::size_t at_once, int* goes) {
    SceneUnpacker unpacker(bytes);
    for (*goes = 1; !unpacker.Go(at_once); ++*goes) {
    }
    return unpacker.Take();
  };
  int goes = 0;
  const auto same = in_goes(packed, 10, &goes);
  ASSERT_TRUE(same.ok()) << same.status();
  EXPECT_EQ(SceneDifference::Between(**UnpackScene(packed), **same), "");
  EXPECT_GE(goes, 6) << "one for each body, and more";
  for (std::size_t at = 0; at < packed.size(); at += 7) {
    PackedBytes changed = packed;
    changed[at] = static_cast<std::uint8_t>(changed[at] ^ 0x55);
    EXPECT_EQ(in_goes(changed, 10, &goes).status(), UnpackScene(changed).status()) << at;
  }
}

// A mesh and a height field of many parts, of which each go takes its share.
TEST(PackedSceneTest, NoGoTakesALargeShapeWhole) {
  Scene scene = *SceneOf(kEverything);
  TriangleMeshShape mesh;
  for (std::uint32_t i = 0; i < 30'000; ++i) {
    const auto x = static_cast<float>(i);
    mesh.vertices.insert(mesh.vertices.end(), {{x, 0, 0}, {x, 0, 1}, {x + 1, 0, 0}});
    mesh.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
  }
  HeightFieldShape field{.columns = 400, .rows = 300, .spacing_m = 1, .heights_m = std::vector<float>(120'000, 2.5f)};
  scene.bodies[0].shape = std::make_shared<const Shape>(Shape{std::move(mesh)});
  BodyDef ground = scene.bodies[0];
  ground.id = BodyId(2);
  ground.shape = std::make_shared<const Shape>(Shape{std::move(field)});
  scene.bodies.insert(scene.bodies.begin() + 1, ground);
  const PackedBytes packed = PackScene(scene);
  constexpr std::size_t kAtOnce = 10'000;
  SceneUnpacker unpacker(packed);
  std::size_t goes = 1;
  while (!unpacker.Go(kAtOnce)) ++goes;
  EXPECT_GE(goes, packed.size() / kAtOnce / 2);
  EXPECT_LE(goes, packed.size() / kAtOnce + 10);
  const auto same = unpacker.Take();
  ASSERT_TRUE(same.ok()) << same.status();
  EXPECT_EQ(SceneDifference::Between(scene, **same), "");
}

TEST(PackedSceneTest, TheHeadAloneSaysWhetherItIsOne) {
  PackedBytes packed = PackScene(*SceneOf(kEverything));
  EXPECT_TRUE(CheckPackedScene(packed).ok());
  EXPECT_EQ(CheckPackedScene(std::span(packed).first(packed.size() - 1)).code(), absl::StatusCode::kInvalidArgument);
  packed[0] = 'X';
  EXPECT_EQ(CheckPackedScene(packed).message(), "packed scene: this is none");
}

}  // namespace
}  // namespace tessera
