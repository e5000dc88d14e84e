// Properties that are changed while a region runs: where they are kept, and all the ways that they go with a body.
#include <gmock/gmock.h>

#include "core/region/frame.h"
#include "core/region/frame_check.h"
#include "core/region/log.h"
#include "core/region/record_table.h"
#include "core/region/region.h"
#include "core/region/standby_copy.h"

namespace tessera::region {
namespace {

using ::testing::HasSubstr;

const std::vector<PropertyDef> kDefs = {{"health", std::int64_t{100}}, {"team", std::string("none")}};

// Two balls that fall for ever; a player.
std::shared_ptr<const Scene> MakeScene() {
  auto scene = std::make_shared<Scene>();
  scene->bounds = {{-50, -50, -50}, {50, 50, 50}};
  scene->properties = kDefs;
  for (const std::uint64_t id : {7, 8}) {
    BodyDef def;
    def.id = BodyId(id);
    def.shape = std::make_shared<const Shape>(Shape{SphereShape{0.4}});
    def.initial.position = {static_cast<double>(id), 10, 0};
    scene->bodies.push_back(def);
  }
  scene->player.emplace().body.shape = std::make_shared<const Shape>(Shape{SphereShape{0.5}});
  return scene;
}

Config PropertiesConfig(const std::shared_ptr<const Scene>& scene) {
  return {.self = RegionId(1),
          .incarnation = Incarnation(1),
          .scene = scene,
          .map = *MakeGridMap(scene->ground(), 1),
          .settings = {}};
}

PropertyValue Value(const std::vector<std::uint8_t>& bytes, const char* name) {
  const auto set = PropertySet::Decode(bytes, kDefs);
  EXPECT_TRUE(set.ok()) << set.status();
  return ValueOf(kDefs, {}, *set, name).value();
}

CarriedRecord Carried(std::int64_t health, std::uint64_t change) {
  PropertySet set;
  EXPECT_TRUE(set.Set(kDefs, "health", health).ok());
  return {change, set.Encode()};
}

TEST(PropertyTableTest, ChangesAddUpAndAnOldOneComesTooLate) {
  RecordTable table;
  EXPECT_TRUE(table.Of(BodyId(8)).empty());
  ASSERT_TRUE(table.Set(BodyId(8), kDefs, "health", std::int64_t{50}, 3).ok());
  ASSERT_TRUE(table.Set(BodyId(7), kDefs, "team", std::string("blue"), 1).ok());
  ASSERT_TRUE(table.Set(BodyId(8), kDefs, "team", std::string("red"), 4).ok());
  ASSERT_TRUE(table.Set(BodyId(8), kDefs, "health", std::int64_t{99}, 3).ok()) << "late, and no error";
  ASSERT_EQ(table.all().size(), 2U);
  EXPECT_EQ(table.all()[0].body, BodyId(7));
  const CarriedRecord carried = table.Of(BodyId(8));
  EXPECT_EQ(carried.change, 4U);
  EXPECT_EQ(Value(carried.bytes, "health"), PropertyValue(std::int64_t{50}));
  EXPECT_EQ(Value(carried.bytes, "team"), PropertyValue(std::string("red")));
  table.Release(BodyId(8));
  EXPECT_TRUE(table.Of(BodyId(8)).empty());
}

TEST(PropertyTableTest, AWrongChangeIsRefusedByNameAndChangesNothing) {
  RecordTable table;
  ASSERT_TRUE(table.Set(BodyId(8), kDefs, "health", std::int64_t{50}, 1).ok());
  const CarriedRecord before = table.Of(BodyId(8));
  EXPECT_EQ(table.Set(BodyId(8), kDefs, "mana", std::int64_t{1}, 2).message(), "no property \"mana\"");
  EXPECT_EQ(table.Set(BodyId(8), kDefs, "health", true, 2).message(), "property \"health\" is a whole number");
  EXPECT_EQ(table.Of(BodyId(8)), before);
}

TEST(FramePropertiesTest, AGrantCarriesThemAndBadOnesAreRefused) {
  const Catalog catalog(MakeScene());
  BorderFrame frame;
  frame.sender = RegionId(2);
  Grant grant;
  grant.bodies = {{BodyId(7), Epoch(2), {}, Carried(-3, 900)}};
  frame.grants = {grant};
  BorderFrame without = frame;
  without.grants[0].bodies[0].record = {};
  const auto bytes = Encode(frame, {});
  const auto back = Decode(bytes, {});
  ASSERT_TRUE(back.ok()) << back.status();
  EXPECT_EQ(back->grants[0].bodies[0].record, grant.bodies[0].record);
  EXPECT_TRUE(CheckFrame(*back, catalog).ok());
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    EXPECT_FALSE(Decode(std::span(bytes).first(size), {}).ok()) << size;
  }
  EXPECT_EQ(Encode(without, {}).size() + 2 + 1 + grant.bodies[0].record.bytes.size() + 4, bytes.size())
      << "a body without any costs nothing";

  const auto refusal = [&](CarriedRecord properties) {
    frame.grants[0].bodies[0].record = std::move(properties);
    return std::string(CheckFrame(frame, catalog).message());
  };
  EXPECT_EQ(refusal({5, {9, 0}}), "body 7: properties: not declared");
  EXPECT_EQ(refusal({5, {1, 4, 'r'}}), "body 7: properties: truncated");
  EXPECT_EQ(refusal({5, std::vector<std::uint8_t>(513)}), "body 7: properties: too long");
  EXPECT_THAT(refusal({5, {}}), HasSubstr("changed to nothing"));
  EXPECT_THAT(refusal({5, {}}), HasSubstr("to nothing"));
}

TEST(RegionPropertiesTest, OnlyAnOwnedBodyCanBeChanged) {
  const auto scene = MakeScene();
  Region region(PropertiesConfig(scene));
  (void)region.Start();
  EXPECT_TRUE(region.SetProperty(BodyId(7), "health", std::int64_t{1}, 1).ok());
  EXPECT_EQ(region.SetProperty(BodyId(9), "health", std::int64_t{1}, 2).message(), "body 9 is not owned here");
  EXPECT_EQ(region.SetProperty(BodyId(7), "mana", std::int64_t{1}, 2).message(), "no property \"mana\"");
  const BodyId player = PlayerBodyId(PlayerNumber(3));
  EXPECT_FALSE(region.SetProperty(player, "health", std::int64_t{1}, 2).ok());
  region.SpawnPlayer(PlayerNumber(3));
  (void)region.Step();
  EXPECT_TRUE(region.SetProperty(player, "health", std::int64_t{1}, 2).ok());
  ASSERT_EQ(region.records().all().size(), 2U);
  region.RemovePlayer(PlayerNumber(3));
  (void)region.Step();
  EXPECT_EQ(region.records().all().size(), 1U) << "they leave with their body";
}

// By whole states and by changes, through a checkpoint too.
TEST(RegionPropertiesTest, TheStandbyAndARestoredRegionHaveThem) {
  const auto scene = MakeScene();
  Region region(PropertiesConfig(scene));
  (void)region.Start();
  ASSERT_TRUE(region.SetProperty(BodyId(7), "team", std::string("red"), 1).ok());
  region.SetStandby(true);
  StandbyCopy standby_copy(RegionId(1), region.catalog());
  ASSERT_TRUE(standby_copy.Receive(region.Step().log).ok());
  EXPECT_EQ(EncodeState(standby_copy.state()), region.SaveState());
  const std::size_t quiet = region.Step().log.size();
  region.SetStandby(true);
  ASSERT_TRUE(standby_copy.Receive(region.Step().log).ok());

  ASSERT_TRUE(region.SetProperty(BodyId(8), "health", std::int64_t{5}, 2).ok());
  ASSERT_TRUE(region.SetProperty(BodyId(7), "health", std::int64_t{6}, 3).ok());
  const Bytes log = region.Step().log;
  EXPECT_GT(log.size(), quiet);
  ASSERT_TRUE(standby_copy.Receive(log).ok());
  EXPECT_EQ(EncodeState(standby_copy.state()), region.SaveState());
  ASSERT_EQ(standby_copy.state().records.size(), 2U);
  EXPECT_EQ(standby_copy.state().RecordOf(BodyId(7)).change, 3U);

  const auto saved = DecodeState(region.SaveState(), region.catalog());
  ASSERT_TRUE(saved.ok()) << saved.status();
  const auto merged = MergeStates(std::span(&*saved, 1));
  ASSERT_TRUE(merged.ok());
  Config config = PropertiesConfig(scene);
  config.initial = std::make_shared<RegionState>(*merged);
  const Region restored(config);
  ASSERT_EQ(restored.records().all().size(), 2U);
  EXPECT_EQ(Value(*restored.records().all()[0].bytes, "team"), PropertyValue(std::string("red")));
  EXPECT_EQ(Value(*restored.records().all()[0].bytes, "health"), PropertyValue(std::int64_t{6}));
  EXPECT_EQ(Value(*restored.records().all()[1].bytes, "health"), PropertyValue(std::int64_t{5}));
}

TEST(RegionPropertiesTest, ABadOneInAStateIsRefusedByName) {
  const Catalog catalog(MakeScene());
  RegionState state;
  state.bodies = {{BodyId(7), Epoch(1), {}}};
  state.records[BodyId(7)] = Carried(1, 1);
  EXPECT_TRUE(DecodeState(EncodeState(state), catalog).ok());
  state.records[BodyId(8)] = Carried(1, 1);
  EXPECT_EQ(DecodeState(EncodeState(state), catalog).status().message(), "records: body 8 is not there");
  state.records.erase(BodyId(8));
  state.records[BodyId(7)] = {1, {77, 0}};
  EXPECT_EQ(DecodeState(EncodeState(state), catalog).status().message(), "body 7: properties: not declared");
}

}  // namespace
}  // namespace tessera::region
