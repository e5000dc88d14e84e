#include "client_sdk/world_properties.h"

#include <gtest/gtest.h>

#include <string>
#include <utility>
#include <vector>

namespace tessera::client {
namespace {

struct WorldPropertiesTest : testing::Test {
  using News = WorldProperties::News;

  WorldPropertiesTest() {
    defs = {{.name = "phase", .initial = std::int64_t{1}}, {.name = "score", .initial = std::int64_t{0}}};
  }
  replication::NewsOfWorld Says(std::uint32_t epoch, std::uint64_t tick, std::int64_t score) const {
    PropertySet set;
    EXPECT_TRUE(set.Set(defs, "score", score).ok());
    return {.epoch = epoch, .tick = tick, .properties = set.Encode()};
  }
  // The names in the events since the last call.
  std::string Changed() {
    std::string names;
    for (const ClientEvent& event : std::exchange(events, {})) names += event.property + ";";
    return names;
  }
  std::optional<PropertyValue> Score() const { return ValueOf(defs, {}, properties.changed(), "score"); }

  WorldProperties::Defs defs;
  WorldProperties properties;
  std::vector<ClientEvent> events;
};

TEST_F(WorldPropertiesTest, OlderNewsNeverReplaceOthers) {
  EXPECT_EQ(properties.Take(Says(2, 10, 5), &defs, events), News::kNew);
  EXPECT_EQ(Changed(), "score;");
  EXPECT_EQ(properties.Take(Says(2, 10, 6), &defs, events), News::kOld);
  EXPECT_EQ(properties.Take(Says(1, 99, 6), &defs, events), News::kOld);
  EXPECT_EQ(properties.Take(Says(2, 11, 5), &defs, events), News::kSame);
  EXPECT_EQ(Changed(), "");
  EXPECT_EQ(Score(), PropertyValue(std::int64_t{5}));
  EXPECT_EQ(properties.Take(Says(3, 1, 7), &defs, events), News::kNew);
  EXPECT_EQ(Score(), PropertyValue(std::int64_t{7}));
}

TEST_F(WorldPropertiesTest, WaitForTheScene) {
  EXPECT_EQ(properties.Take(Says(1, 1, 5), nullptr, events), News::kNew);
  EXPECT_EQ(Changed(), "");
  properties.Begin(defs, events);
  EXPECT_EQ(Changed(), "score;");
  EXPECT_EQ(Score(), PropertyValue(std::int64_t{5}));
}

TEST_F(WorldPropertiesTest, AValueThatIsTheScenesOwnIsNoChange) {
  EXPECT_EQ(properties.Take(Says(1, 1, 0), &defs, events), News::kNew);
  EXPECT_EQ(Changed(), "");
}

TEST_F(WorldPropertiesTest, MalformedNewsChangeNothing) {
  replication::NewsOfWorld bad = Says(1, 1, 5);
  bad.properties = {255, 255, 255};
  EXPECT_EQ(properties.Take(bad, &defs, events), News::kMalformed);
  EXPECT_EQ(properties.Take(Says(1, 1, 5), &defs, events), News::kNew);  // they were not taken for the newest
}

TEST_F(WorldPropertiesTest, AWorldThatStartsOverMayGoBack) {
  EXPECT_EQ(properties.Take(Says(5, 100, 5), &defs, events), News::kNew);
  properties.ForgetNews();
  EXPECT_EQ(properties.Take(Says(1, 1, 3), &defs, events), News::kNew);
  EXPECT_EQ(Score(), PropertyValue(std::int64_t{3}));
}

}  // namespace
}  // namespace tessera::client
