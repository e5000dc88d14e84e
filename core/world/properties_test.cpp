#include "core/world/properties.h"

#include <google/protobuf/text_format.h>
#include <gtest/gtest.h>

#include <limits>
#include <random>

#include "core/world/scene_io.h"

namespace tessera {
namespace {

const std::vector<PropertyDef> kDefs = {
    {"health", std::int64_t{100}}, {"team", std::string("none")}, {"armed", false}, {"speed", 1.5}};

TEST(PropertiesTest, WhatIsSetComesBackAndTheRestIsAsDeclared) {
  PropertySet set, of_scene;
  ASSERT_TRUE(of_scene.Set(kDefs, "team", std::string("red")).ok());
  ASSERT_TRUE(set.Set(kDefs, "health", std::int64_t{-7}).ok());
  ASSERT_TRUE(set.Set(kDefs, "armed", true).ok());
  ASSERT_TRUE(set.Set(kDefs, "health", std::numeric_limits<std::int64_t>::min()).ok());
  const auto again = PropertySet::Decode(set.Encode(), kDefs);
  ASSERT_TRUE(again.ok()) << again.status();
  EXPECT_EQ(*again, set);
  EXPECT_EQ(ValueOf(kDefs, of_scene, *again, "health"), PropertyValue(std::numeric_limits<std::int64_t>::min()));
  EXPECT_EQ(ValueOf(kDefs, of_scene, *again, "team"), PropertyValue(std::string("red")));
  EXPECT_EQ(ValueOf(kDefs, of_scene, *again, "speed"), PropertyValue(1.5));
  EXPECT_EQ(ValueOf(kDefs, of_scene, *again, "mana"), std::nullopt);
}

TEST(PropertiesTest, WrongOnesAreRefusedByNameAndChangeNothing) {
  PropertySet set;
  EXPECT_EQ(set.Set(kDefs, "mana", std::int64_t{1}).message(), "no property \"mana\"");
  EXPECT_EQ(set.Set(kDefs, "health", 1.0).message(), "property \"health\" is a whole number");
  EXPECT_EQ(set.Set(kDefs, "speed", std::nan("")).message(), "property \"speed\" is not finite");
  EXPECT_EQ(set.Set(kDefs, "team", std::string(64, 'x')).message(), "property \"team\" is longer than 63 bytes");
  EXPECT_TRUE(set.empty());
}

TEST(PropertiesTest, VectorsBodiesAndBytesComeBackToo) {
  const std::vector<PropertyDef> defs = {
      {"home", Vec3d{1, 2, 3}}, {"target", BodyId()}, {"secret", PropertyBytes{{0, 255}}}};
  PropertySet set;
  EXPECT_EQ(set.Set(defs, "home", Vec3d{0, std::nan(""), 0}).message(), "property \"home\" is not finite");
  EXPECT_EQ(set.Set(defs, "home", Vec3d{0, 0, -2e18}).message(), "property \"home\" is beyond 1e+18");
  EXPECT_EQ(set.Set(defs, "target", std::int64_t{7}).message(), "property \"target\" is a body");
  EXPECT_EQ(set.Set(defs, "secret", PropertyBytes{std::vector<std::uint8_t>(257)}).message(),
            "property \"secret\" is longer than 256 bytes");
  EXPECT_TRUE(set.empty());
  ASSERT_TRUE(set.Set(defs, "home", Vec3d{-0.5, 4, 1e9}).ok());
  ASSERT_TRUE(set.Set(defs, "target", BodyId(std::uint64_t{1} << 63 | 9)).ok());
  ASSERT_TRUE(set.Set(defs, "secret", PropertyBytes{std::vector<std::uint8_t>(256, 7)}).ok());
  const auto again = PropertySet::Decode(set.Encode(), defs);
  ASSERT_TRUE(again.ok()) << again.status();
  EXPECT_EQ(*again, set);
  EXPECT_EQ(PropertyText(*again->Find(0)), "(-0.5, 4, 1e+09)");
  EXPECT_EQ(PropertyText(*again->Find(1)), "body 9223372036854775817");
  EXPECT_EQ(PropertyText(*again->Find(2)), "256 bytes");
}

TEST(PropertiesTest, EachIsWrittenOnlyForThoseWhoMaySeeIt) {
  const std::vector<PropertyDef> defs = {{"team", std::string("none")},
                                         {"ammunition", std::int64_t{0}, Visibility::kPlayer},
                                         {"cheats", std::int64_t{0}, Visibility::kServers}};
  PropertySet set;
  for (const char* name : {"ammunition", "cheats"}) ASSERT_TRUE(set.Set(defs, name, std::int64_t{3}).ok());
  EXPECT_TRUE(set.EncodeFor(defs, PropertySet::Viewer::kAnybody).empty());
  ASSERT_TRUE(set.Set(defs, "team", std::string("red")).ok());
  const auto others = PropertySet::Decode(set.EncodeFor(defs, PropertySet::Viewer::kAnybody), defs);
  const auto own = PropertySet::Decode(set.EncodeFor(defs, PropertySet::Viewer::kPlayer), defs);
  ASSERT_TRUE(others.ok() && own.ok());
  EXPECT_NE(others->Find(0), nullptr);
  EXPECT_EQ(others->Find(1), nullptr);
  EXPECT_EQ(others->Find(2), nullptr);
  EXPECT_NE(own->Find(1), nullptr);
  EXPECT_EQ(own->Find(2), nullptr);
}

TEST(PropertiesTest, FaultsOfTeamsAreNamed) {
  const auto fault = [](const std::string& text) {
    v1::Scene scene;
    EXPECT_TRUE(google::protobuf::TextFormat::ParseFromString(
        R"(name: "arena" bounds { min { x: -9 y: -9 z: -9 } max { x: 9 y: 9 z: 9 } }
           properties { name: "team" text: "" } properties { name: "alive" flag: true }
           bodies { id: 9 mass: 1 shape { sphere { radius: 1 } } pose { position { } } } )" +
            text,
        &scene));
    return ResolveScene(scene, "arena").status().ToString();
  };
  const std::string sphere = R"(shape { sphere { radius: 1 } } pose { position { } } )";
  EXPECT_EQ(fault(R"(team_property: "team")"), "OK");
  EXPECT_EQ(fault(R"(team_property: "team" bodies { id: 1 mass: 1 visible_to: VISIBILITY_TEAM )" + sphere + "}"), "OK");
  EXPECT_NE(fault(R"(team_property: "tema")").find("team_property: is no property that is a text or a number"),
            std::string::npos);
  EXPECT_NE(fault(R"(team_property: "alive")").find("is no property that is a text or a number"), std::string::npos);
  EXPECT_NE(
      fault(R"(properties { name: "plan" number: 0 visible_to: VISIBILITY_TEAM })").find("team_property: is missing"),
      std::string::npos);
  EXPECT_NE(fault(R"(bodies { id: 1 mass: 1 visible_to: VISIBILITY_PLAYER )" + sphere + "}")
                .find("visible_to: of a body it is VISIBILITY_EVERYONE"),
            std::string::npos);
  EXPECT_NE(fault(R"(bodies { id: 1 motion: MOTION_STATIC visible_to: VISIBILITY_SERVERS )" + sphere + "}")
                .find("visible_to: the body does not move"),
            std::string::npos);
}

TEST(PropertiesTest, ATeamSeesWhatIsForTeams) {
  const std::vector<PropertyDef> defs = {{"plan", std::int64_t{0}, Visibility::kTeam}};
  PropertySet set;
  ASSERT_TRUE(set.Set(defs, "plan", std::int64_t{3}).ok());
  EXPECT_TRUE(set.EncodeFor(defs, PropertySet::Viewer::kAnybody).empty());
  EXPECT_FALSE(set.EncodeFor(defs, PropertySet::Viewer::kTeam).empty());
  EXPECT_FALSE(set.EncodeFor(defs, PropertySet::Viewer::kPlayer).empty());

  const TeamId red = TeamOf(std::string("red")), blue = TeamOf(std::string("blue"));
  EXPECT_NE(red, blue);
  EXPECT_NE(TeamOf(std::int64_t{1}), TeamOf(std::int64_t{256}));
  EXPECT_EQ(TeamOf(std::string()), TeamId{0});
  EXPECT_EQ(TeamOf(std::int64_t{0}), TeamId{0});
  EXPECT_EQ(TeamOf(true), TeamId{0}) << "no team property";
  EXPECT_TRUE(MaySee(Visibility::kEveryone, red, 0));
  EXPECT_TRUE(MaySee(Visibility::kTeam, red, red));
  EXPECT_FALSE(MaySee(Visibility::kTeam, red, blue));
  EXPECT_FALSE(MaySee(Visibility::kTeam, 0, 0)) << "those in no team are none";
  EXPECT_FALSE(MaySee(Visibility::kServers, red, red));
}

TEST(PropertiesTest, NoiseIsAnErrorOrSaysWhatItSays) {
  std::mt19937 random(1);
  for (int i = 0; i < 100'000; ++i) {
    std::vector<std::uint8_t> noise(random() % 20);
    for (std::uint8_t& byte : noise) byte = static_cast<std::uint8_t>(random() % (i % 2 == 0 ? 6 : 256));
    const auto set = PropertySet::Decode(noise, kDefs);
    if (!set.ok()) continue;
    const auto again = PropertySet::Decode(set->Encode(), kDefs);
    ASSERT_TRUE(again.ok());
    EXPECT_EQ(*again, *set);
  }
}

TEST(PropertiesTest, ASceneDeclaresThemAndItsBodiesDiffer) {
  constexpr char kScene[] = R"(
    name: "arena" bounds { min { x: -9 y: -9 z: -9 } max { x: 9 y: 9 z: 9 } }
    properties { name: "health" number: 100 } properties { name: "team" text: "none" }
    instance_properties { name: "score" number: 3 }
    bodies {
      id: 1 mass: 1 shape { sphere { radius: 1 } } properties { name: "team" text: "red" }
    })";
  const auto written = ParseScene(kScene, "arena");
  ASSERT_TRUE(written.ok()) << written.status();
  const auto scene = ResolveScene(*written, "arena");
  ASSERT_TRUE(scene.ok()) << scene.status();
  const Scene& arena = **scene;
  EXPECT_EQ(ValueOf(arena.properties, arena.bodies[0].properties, {}, "team"), PropertyValue(std::string("red")));
  EXPECT_EQ(ValueOf(arena.properties, arena.bodies[0].properties, {}, "health"), PropertyValue(std::int64_t{100}));
  EXPECT_EQ(ValueOf(arena.instance_properties, {}, {}, "score"), PropertyValue(std::int64_t{3}));

  v1::Scene wrong = *written;
  wrong.mutable_bodies(0)->mutable_properties(0)->set_number(3);
  EXPECT_NE(ResolveScene(wrong, "arena").status().ToString().find("number: property \"team\" is a text"),
            std::string::npos);
  wrong = *written;
  wrong.mutable_bodies(0)->mutable_properties(0)->set_visible_to(v1::VISIBILITY_SERVERS);
  EXPECT_NE(ResolveScene(wrong, "arena").status().ToString().find("visible_to is said where the scene declares it"),
            std::string::npos);
  wrong = *written;
  wrong.mutable_properties(0)->set_visible_to(static_cast<v1::Visibility>(9));
  EXPECT_NE(ResolveScene(wrong, "arena").status().ToString().find("visible_to: unknown, 9"), std::string::npos);
  wrong = *written;
  *wrong.add_properties() = wrong.properties(1);
  EXPECT_NE(ResolveScene(wrong, "arena").status().ToString().find("name is also that of properties[1]"),
            std::string::npos);
  wrong = *written;
  *wrong.add_instance_properties() = wrong.instance_properties(0);
  EXPECT_NE(ResolveScene(wrong, "arena").status().ToString().find("name is also that of instance_properties[0]"),
            std::string::npos);
}

}  // namespace
}  // namespace tessera
