#include "core/world/scene_io.h"

#include <gmock/gmock.h>
#include <google/protobuf/stubs/logging.h>
#include <google/protobuf/util/json_util.h>
#include <gtest/gtest.h>
#include <sodium.h>

#include <array>
#include <bit>
#include <filesystem>
#include <fstream>
#include <random>
#include <set>
#include <sstream>

#include "absl/strings/str_cat.h"
#include "core/world/partition_map.h"
#include "core/world/proto_math.h"

namespace tessera {
namespace {

v1::Scene Parsed(const std::string& text) {
  auto scene = ParseScene(text, "test");
  EXPECT_TRUE(scene.ok()) << scene.status();
  return *scene;
}

std::shared_ptr<const Scene> Resolved(const v1::Scene& scene) {
  auto resolved = ResolveScene(scene, "test");
  EXPECT_TRUE(resolved.ok()) << resolved.status();
  return resolved.ok() ? *resolved : std::make_shared<const Scene>();
}

v1::Scene FromFile(const std::filesystem::path& path) {
  std::ifstream file(path);
  std::stringstream text;
  text << file.rdbuf();
  auto scene = ParseScene(text.str(), path.string());
  EXPECT_TRUE(scene.ok()) << scene.status();
  return *scene;
}

const std::filesystem::path kScenes = std::filesystem::path(TESSERA_SOURCE_DIR) / "scenes";

constexpr char kBounds[] = "name: \"x\" bounds { min { x: -10 y: -10 z: -10 } max { x: 10 y: 10 z: 10 } } ";

TEST(ResolveSceneTest, BodiesOfOneKindShareItsPlace) {
  const auto scene =
      Resolved(Parsed(absl::StrCat(kBounds,
                                   "bodies { id: 1 kind: \"crate\" mass: 2 shape { sphere { radius: 1 } } }"
                                   "bodies { id: 2 mass: 2 shape { sphere { radius: 1 } } }"
                                   "bodies { id: 3 kind: \"door_2\" mass: 2 shape { sphere { radius: 1 } } }"
                                   "bodies { id: 4 kind: \"crate\" mass: 2 shape { sphere { radius: 1 } } }")));
  EXPECT_EQ(scene->kinds, (std::vector<std::string>{"", "crate", "door_2"}));
  EXPECT_EQ(scene->bodies[0].kind, 1);
  EXPECT_EQ(scene->bodies[1].kind, 0);
  EXPECT_EQ(scene->bodies[2].kind, 2);
  EXPECT_EQ(scene->bodies[3].kind, 1);
}

TEST(ResolveSceneTest, LayersIgnoreEachOtherFromBothSides) {
  const auto scene = Resolved(Parsed(
      absl::StrCat(kBounds,
                   "layers { name: \"debris\" ignores: \"debris\" ignores: \"players\" } layers { name: \"players\" }"
                   "layers { name: \"default\" ignores: \"players\" }"
                   "bodies { id: 1 mass: 2 shape { sphere { radius: 1 } } layer: \"debris\" }"
                   "bodies { id: 2 mass: 2 shape { sphere { radius: 1 } } layer: \"default\" }"
                   "bodies { id: 3 mass: 2 shape { sphere { radius: 1 } } }"
                   "player { body { mass: 1 layer: \"players\" shape { sphere { radius: 1 } } } spawn_points {}"
                   " max_force: 1 max_speed: 1 }")));
  EXPECT_EQ(scene->layers, (std::vector<std::string>{"default", "debris", "players"}));
  const CollisionLayer debris = scene->bodies[0].layer, given = scene->bodies[1].layer, none = scene->bodies[2].layer;
  const CollisionLayer players = scene->player->body.layer;
  EXPECT_EQ(given, none);
  EXPECT_FALSE(debris.CollidesWith(debris));
  EXPECT_FALSE(debris.CollidesWith(players) || players.CollidesWith(debris));
  EXPECT_FALSE(none.CollidesWith(players) || players.CollidesWith(none));
  EXPECT_TRUE(debris.CollidesWith(none) && none.CollidesWith(debris));
  EXPECT_TRUE(none.CollidesWith(none) && players.CollidesWith(players));
}

TEST(ResolveSceneTest, WithoutLayersAllBodiesCollide) {
  const auto scene = Resolved(Parsed(absl::StrCat(kBounds, "bodies { id: 1 mass: 2 shape { sphere { radius: 1 } } }")));
  EXPECT_EQ(scene->layers, (std::vector<std::string>{"default"}));
  EXPECT_EQ(scene->bodies[0].layer, CollisionLayer());
  EXPECT_EQ(scene->bodies[0].layer.collides, ~0u);
}

TEST(ResolveSceneTest, FillsInDefaults) {
  const auto scene = Resolved(Parsed(absl::StrCat(kBounds, "bodies { id: 1 mass: 2 shape { sphere { radius: 1 } } }")));
  EXPECT_EQ(scene->gravity_m_s2, Vec3d(0, -9.81, 0));
  EXPECT_EQ(scene->tick_rate_hz, 60u);
  EXPECT_FALSE(scene->player.has_value());
  ASSERT_EQ(scene->bodies.size(), 1u);
  const BodyDef& body = scene->bodies[0];
  EXPECT_EQ(body.motion, Motion::kDynamic);
  EXPECT_EQ(body.material.friction, 0.5);
  EXPECT_EQ(body.material.restitution, 0);
  EXPECT_EQ(body.gravity_scale, 1);
  EXPECT_TRUE(body.may_sleep);
  EXPECT_FALSE(body.inertia_kg_m2.has_value());
  EXPECT_EQ(body.initial, BodyState{});
}

TEST(ResolveSceneTest, ZeroIsNotLeftOutWhereItMatters) {
  const auto scene = Resolved(Parsed(
      absl::StrCat(kBounds, "gravity {} bodies { id: 1 mass: 2 gravity_scale: 0 shape { sphere { radius: 1 } } }")));
  EXPECT_EQ(scene->gravity_m_s2, Vec3d());
  EXPECT_EQ(scene->bodies[0].gravity_scale, 0);
}

TEST(ResolveSceneTest, KeepsWhatIsWritten) {
  const auto scene = Resolved(Parsed(absl::StrCat(kBounds, R"(
      gravity { y: -1 } tick_rate_hz: 30
      materials { name: "m" friction: 0.1 rolling_friction: 0.2 spinning_friction: 0.3 restitution: 0.4 }
      bodies {
        id: 9 name: "b" mass: 2 inertia { x: 1 y: 2 z: 2.5 } material: "m" linear_damping: 0.1 angular_damping: 0.2
        pose { position { x: 1 y: 2 z: 3 } orientation { y: 0.6 w: 0.8 } }
        linear_velocity { x: 4 } angular_velocity { z: 5 } gravity_scale: -1 trigger: true never_sleeps: true
        shape { compound { children { pose { position { y: 1 } } shape { cone { radius: 1 height: 2 } } } } }
      }
      bodies { id: 3 motion: MOTION_STATIC shape { height_field {
        columns: 2 rows: 3 spacing: 0.5 heights: [1, 2, 3, 4, 5, 6] } } }
      joints { id: 4 body_a: 9 body_b: 3 frame_b { position { z: 2 } } six_dof {
        axes { limit { lower: -1 upper: 2 } } axes { free: true } axes { spring { stiffness: 7 } } } }
      joints { id: 2 body_a: 9 hinge {} }
      fields { vortex { center { x: 1 } radius: 2 angular_velocity: 3 gain: 4 } }
      player { body { mass: 80 shape { capsule { radius: 0.4 half_height: 0.5 } } }
               spawn_points { x: 1 } spawn_points { x: 2 } max_force: 3 max_speed: 4 })")));
  EXPECT_EQ(scene->tick_rate_hz, 30u);
  ASSERT_EQ(scene->bodies.size(), 2u);
  EXPECT_EQ(scene->bodies[0].id, BodyId(3));  // ascending
  const auto& field = std::get<HeightFieldShape>(scene->bodies[0].shape->form);
  EXPECT_EQ(field.heights_m[1 * field.columns + 0], 3.f);
  EXPECT_EQ(scene->bodies[0].mass_kg, 0);
  const BodyDef& body = scene->bodies[1];
  EXPECT_EQ(body.material.spinning_friction, 0.3);
  EXPECT_EQ(*body.inertia_kg_m2, Vec3d(1, 2, 2.5));
  EXPECT_EQ(body.initial.position, Vec3d(1, 2, 3));
  EXPECT_EQ(body.initial.orientation, Quatd(0, 0.6, 0, 0.8));
  EXPECT_EQ(body.initial.linear_velocity, Vec3f(4, 0, 0));
  EXPECT_EQ(body.initial.angular_velocity, Vec3f(0, 0, 5));
  EXPECT_EQ(body.gravity_scale, -1);
  EXPECT_TRUE(body.trigger);
  EXPECT_FALSE(body.may_sleep);
  const auto& child = std::get<CompoundShape>(body.shape->form).children.at(0);
  EXPECT_EQ(child.pose.position, Vec3d(0, 1, 0));
  EXPECT_EQ(std::get<ConeShape>(child.shape->form).height_m, 2);
  ASSERT_EQ(scene->joints.size(), 2u);
  EXPECT_TRUE(std::get<HingeJoint>(scene->joints[0].kind).limit_rad.free());
  EXPECT_EQ(scene->joints[0].body_b, BodyId());
  const auto& axes = std::get<SixDofJoint>(scene->joints[1].kind).axes;
  EXPECT_EQ(axes[0].limit.upper, 2);
  EXPECT_TRUE(axes[1].limit.free());
  EXPECT_EQ(axes[2].spring.stiffness, 7);
  EXPECT_EQ(axes[5].limit.lower, 0);  // left out at the end: locked
  EXPECT_FALSE(axes[5].limit.free());
  EXPECT_EQ(std::get<VortexField>(scene->fields[0]).gain_per_s, 4);
  EXPECT_EQ(scene->player->spawn_points.size(), 2u);
  EXPECT_EQ(scene->player->body.mass_kg, 80);
}

// A force of more than the weight would lift a body for ever.
TEST(ResolveSceneTest, NobodyFliesUnlessTheSceneSaysSo) {
  const auto rules = [](const std::string& gravity, const std::string& more) {
    const auto scene = Resolved(
        *ParseScene(absl::StrCat(R"(name: "s" bounds { min { x: -9 y: -9 z: -9 } max { x: 9 y: 9 z: 9 } })", gravity,
                                 "player { body { mass: 2 shape { sphere { radius: 0.4 } } } spawn_points {} ",
                                 "max_force: 800 max_speed: 4 ", more, "}"),
                    "s.textproto"));
    return *scene->player;
  };
  EXPECT_NEAR(rules("", "").max_force_up_n, 9.81, 1e-9);
  EXPECT_EQ(rules("", "max_force_up: 50").max_force_up_n, 50);
  EXPECT_EQ(rules("", "max_force_up: 0").max_force_up_n, 0);
  EXPECT_GT(rules("gravity {}", "").max_force_up_n, 1e100);
  EXPECT_EQ(rules("gravity { x: 5 }", "").up, Vec3d(-1, 0, 0));
  EXPECT_EQ(rules("gravity { x: 5 }", "").max_force_up_n, 5);
}

TEST(ResolveSceneTest, ACharacterStandsUprightAndHasDefaults) {
  const auto scene = Resolved(*ParseScene(R"(name: "s" bounds { min { x: -9 y: -9 z: -9 } max { x: 9 y: 9 z: 9 } }
      player { body { mass: 70 shape { capsule { radius: 0.4 half_height: 0.5 } } } spawn_points {}
               character { walk_speed: 3 air_control: 0 } })",
                                          "s.textproto"));
  const PlayerRules& player = *scene->player;
  ASSERT_TRUE(player.character.has_value());
  EXPECT_EQ(player.character->walk_speed_m_s, 3);
  EXPECT_EQ(player.character->run_speed_m_s, 3);
  EXPECT_EQ(player.character->air_control, 0);
  EXPECT_EQ(player.character->jump_speed_m_s, 0);
  EXPECT_EQ(player.character->step_height_m, 0.3);
  EXPECT_EQ(player.character->push_mass_kg, 70);
  EXPECT_EQ(player.body.material.friction, 0);
  EXPECT_GT(player.body.inertia_kg_m2->x, 1e6 * player.body.inertia_kg_m2->y);
}

TEST(ResolveSceneTest, NormalisesQuaternions) {
  const auto scene = Resolved(Parsed(absl::StrCat(
      kBounds,
      "bodies { id: 1 mass: 1 shape { sphere { radius: 1 } } pose { orientation { x: 0.70711 w: 0.70711 } } }")));
  EXPECT_NEAR(Length(scene->bodies[0].initial.orientation), 1, 1e-15);
}

TEST(ResolveSceneTest, BodiesThatLookAlikeShareAShape) {
  const auto scene = Resolved(Parsed(absl::StrCat(kBounds, R"(
      bodies { id: 1 mass: 1 shape { sphere { radius: 1 } } }
      bodies { id: 2 mass: 9 shape { sphere { radius: 1 } } }
      bodies { id: 3 mass: 1 shape { sphere { radius: 2 } } }
      scatters { first_id: 10 count: 4 spacing: 2 area { max { x: 9 y: 1 z: 9 } }
                 templates { mass: 1 shape { sphere { radius: 1 } } } templates { mass: 1 shape { cone { radius: 1 height: 1 } } } })")));
  const auto& bodies = scene->bodies;
  ASSERT_EQ(bodies.size(), 7u);
  EXPECT_EQ(bodies[0].shape, bodies[1].shape);
  EXPECT_NE(bodies[0].shape, bodies[2].shape);
  EXPECT_EQ(bodies[3].shape, bodies[0].shape);
  EXPECT_EQ(bodies[4].shape, bodies[6].shape);
}

TEST(ScatterTest, BodiesStandInsideTheAreaAndApart) {
  v1::Scene scene = Parsed(absl::StrCat(kBounds, R"(
      scatters { first_id: 10 spacing: 1 jitter: 0.25 seed: 5 area { min { x: -9 y: 1 z: -3 } max { x: 9 y: 2 z: 6.5 } }
                 templates { mass: 1 shape { sphere { radius: 0.1 } } } })"));
  for (const std::uint32_t count : {1u, 2u, 3u, 7u, 100u, 161u, 162u, 163u, 500u, 1000u}) {
    scene.mutable_scatters(0)->set_count(count);
    const auto resolved = Resolved(scene);
    ASSERT_EQ(resolved->bodies.size(), count);
    for (std::size_t i = 0; i < count; ++i) {
      const Vec3d p = resolved->bodies[i].initial.position;
      ASSERT_EQ(resolved->bodies[i].id, BodyId(10 + i));
      ASSERT_TRUE(p.x >= -9 && p.x <= 9 && p.z >= -3 && p.z <= 6.5) << p;
      ASSERT_EQ(p.y, 1 + std::floor(static_cast<double>(i) / (18 * 9))) << p;  // layers of 18 by 9
      for (std::size_t j = 0; j < i; ++j) {  // two jitters can take at most half the spacing
        ASSERT_GE(Length(p - resolved->bodies[j].initial.position), 0.5) << i << " and " << j;
      }
    }
  }
}

TEST(ScatterTest, OneBodyForEachRegionOfASquareWorld) {
  v1::Scene scene = FromFile(kScenes / "dissertation.textproto");
  for (std::uint32_t n = 1; n <= 9; ++n) {
    scene.mutable_scatters(0)->set_count(n);
    const auto resolved = Resolved(scene);
    const auto map = MakeGridMap(resolved->ground(), n);
    std::set<RegionId> owners;
    for (const BodyDef& body : resolved->bodies) {
      if (body.motion == Motion::kDynamic) owners.insert(map->OwnerOf(body.initial.position));
    }
    EXPECT_EQ(owners.size(), n);
  }
}

TEST(ScatterTest, SeedMovesBodiesAndNothingElseDoes) {
  const v1::Scene scene = FromFile(kScenes / "dissertation.textproto");
  const auto positions = [](const v1::Scene& from) {
    std::vector<Vec3d> all;
    const auto resolved = Resolved(from);
    for (const BodyDef& body : resolved->bodies) all.push_back(body.initial.position);
    return all;
  };
  v1::Scene other = scene;
  other.mutable_scatters(0)->set_seed(1);
  EXPECT_EQ(positions(scene), positions(scene));
  EXPECT_NE(positions(scene), positions(other));
}

TEST(SceneHashTest, TellsScenesApart) {
  const v1::Scene scene = FromFile(kScenes / "minimal.textproto");
  v1::Scene other = scene;
  other.mutable_bodies(1)->mutable_pose()->mutable_position()->set_x(3.0000000001);
  EXPECT_EQ(SceneHash(scene).size(), 64u);
  EXPECT_EQ(SceneHash(scene), SceneHash(v1::Scene(scene)));
  EXPECT_NE(SceneHash(scene), SceneHash(other));
  // BLAKE2b-256 of nothing, as RFC 7693's function gives it.
  EXPECT_EQ(SceneHash(v1::Scene()), "0e5751c026e543b2e8ab2eb06099daa1d1e5df47778f7787faab45cdf12fe3a8");
}

TEST(SceneHashTest, IsThatOfTheSceneWhereverItCameFrom) {
  const v1::Scene scene = FromFile(kScenes / "shapes.textproto");
  std::string json;
  ASSERT_TRUE(google::protobuf::util::MessageToJsonString(scene, &json).ok());
  const auto from_json = ParseScene(json, "json");
  ASSERT_TRUE(from_json.ok()) << from_json.status();
  EXPECT_EQ(SceneHash(*from_json), SceneHash(scene));
  v1::Scene from_wire;
  ASSERT_TRUE(from_wire.ParseFromString(scene.SerializeAsString()));
  EXPECT_EQ(SceneHash(from_wire), SceneHash(scene));
}

TEST(ProtoMathTest, ThereAndBack) {
  const Pose pose{{1, 2, 3}, {0.1, 0.2, 0.3, 0.4}};
  EXPECT_EQ(FromProto(ToProto(pose)), pose);
  EXPECT_EQ(FromProto(v1::Quat()), Quatd());
  const Aabb box{{1, 2, 3}, {4, 5, 6}};
  EXPECT_EQ(FromProto(ToProto(box)), box);
}

TEST(ShippedScenesTest, AllParseAndResolveUnderTheirOwnName) {
  int count = 0;
  for (const auto& entry : std::filesystem::directory_iterator(kScenes)) {
    if (entry.path().extension() != ".textproto" && entry.path().extension() != ".json") continue;
    SCOPED_TRACE(entry.path());
    ++count;
    const auto scene = Resolved(FromFile(entry.path()));
    EXPECT_EQ(scene->name, entry.path().stem());
    EXPECT_FALSE(scene->bodies.empty());
  }
  EXPECT_GE(count, 6);
}

// Any bytes from the wire end in a scene or a status.
TEST(ResolveSceneTest, SurvivesDamagedMessages) {
  const std::string sound = FromFile(kScenes / "shapes.textproto").SerializeAsString();
  const google::protobuf::LogSilencer silence;  // names are not always UTF-8
  std::mt19937 random(1);
  int parsed = 0, resolved = 0;
  for (int i = 0; i < 20'000; ++i) {
    std::string damaged = sound;
    for (auto flips = 1 + random() % 4; flips > 0; --flips) {
      damaged[random() % damaged.size()] = static_cast<char>(random() % 256);
    }
    v1::Scene scene;
    if (!scene.ParseFromString(damaged)) continue;
    ++parsed;
    // Millions of scattered bodies are legal, and not the point here.
    for (v1::Scatter& scatter : *scene.mutable_scatters()) scatter.set_count(std::min(scatter.count(), 50u));
    const auto result = ResolveScene(scene, "wire");
    EXPECT_TRUE(result.ok() || result.status().code() == absl::StatusCode::kInvalidArgument);
    resolved += result.ok();
  }
  EXPECT_GT(parsed, 1000);
  EXPECT_GT(resolved, 100);
}

// BLAKE2b over ids and places of all bodies as little-endian 64-bit values.
std::string PlacesHash(const Scene& scene) {
  std::vector<unsigned char> bytes;
  const auto put = [&](std::uint64_t value) {
    for (int shift = 0; shift < 64; shift += 8) bytes.push_back(static_cast<unsigned char>(value >> shift));
  };
  for (const BodyDef& body : scene.bodies) {
    const Vec3d p = body.initial.position;
    for (const std::uint64_t value : {body.id.value(), std::bit_cast<std::uint64_t>(p.x),
                                      std::bit_cast<std::uint64_t>(p.y), std::bit_cast<std::uint64_t>(p.z)}) {
      put(value);
    }
  }
  std::array<unsigned char, 16> digest{};
  crypto_generichash(digest.data(), digest.size(), bytes.data(), bytes.size(), nullptr, 0);
  std::string hex(2 * digest.size() + 1, '\0');
  sodium_bin2hex(hex.data(), hex.size(), digest.data(), digest.size());
  hex.pop_back();
  return hex;
}

// A machine that places plaza's bodies elsewhere would disagree with the others about the world from tick 0 on.
TEST(ShippedScenesTest, PlazaIsTheSameOnEveryMachine) {
  EXPECT_EQ(PlacesHash(*Resolved(FromFile(kScenes / "plaza.textproto"))), "d3a65109fcd35e356b984de89b8a28c2");
}

}  // namespace
}  // namespace tessera
