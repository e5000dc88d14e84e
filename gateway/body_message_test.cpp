// Details of one body, and values of one property of all, out of a client's view of a world.
#include <gmock/gmock.h>

#include <cstdint>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "client_sdk/client_fixture.h"
#include "core/world/properties.h"
#include "gateway/gateway_message.h"

namespace tessera::gateway {
namespace {

using client::kBall;
using client::Moving;
using nlohmann::json;
using replication::BodyRecord;

class BodyMessageTest : public client::ClientFixture {
 protected:
  static constexpr char kWall[] = R"(
    bodies { id: 3 name: "wall" motion: MOTION_STATIC shape { box { half_extents { x: 1 y: 1 z: 1 } } }
             pose { position { x: 4 y: 5 z: 6 } } } )";

  void PlayBesideAWall() {
    Make(1, kWall);
    ASSERT_NO_FATAL_FAILURE(Join());
    ASSERT_NO_FATAL_FAILURE(Play());
  }
  // The ball, hurt and spinning, and the own body of a player with a name.
  void ShowBoth() {
    BodyState spins = Moving(1.5, 3);
    spins.angular_velocity = {0, 2, 0};
    const std::vector<BodyRecord> bodies = {{kBall, Epoch(4), spins, Changed(80, "")},
                                            {client->own_body(), Epoch(1), Moving(-2, 0), Changed(55, "ada")}};
    Advance([&](Tick at) { instance->regions[0]->Snapshot(at, bodies); });
  }
  std::shared_ptr<const replication::Bytes> Changed(std::int64_t health, const std::string& player_name) const {
    PropertySet set;
    EXPECT_TRUE(set.Set(instance->scene->properties, "health", health).ok());
    set.set_player_name(player_name);
    return std::make_shared<const replication::Bytes>(set.Encode());
  }
  json Detail(BodyId body) const { return json::parse(DetailMessage(*client, body)); }
};

TEST_F(BodyMessageTest, DetailsAreAllThatIsKnownOfABody) {
  ASSERT_NO_FATAL_FAILURE(PlayBesideAWall());
  ASSERT_NO_FATAL_FAILURE(ShowBoth());
  const json ball = Detail(kBall);
  EXPECT_EQ(ball.at("type"), "detail");
  EXPECT_EQ(ball.at("body"), "1");
  EXPECT_EQ(ball.at("name"), "");
  EXPECT_EQ(ball.at("mass_kg"), 1);
  EXPECT_EQ(ball.at("owner"), 1);
  EXPECT_EQ(ball.at("epoch"), 4);
  EXPECT_EQ(ball.at("tick"), client->tick().value());
  EXPECT_NEAR(ball.at("position").at(0).get<double>(), 1.5, 1e-3);
  EXPECT_NEAR(ball.at("linear_velocity").at(0).get<double>(), 3, 0.02);
  EXPECT_NEAR(ball.at("angular_velocity").at(1).get<double>(), 2, 0.02);
  EXPECT_EQ(ball.at("asleep"), false);
  EXPECT_EQ(ball.at("properties"),
            (json{{"health", 80}, {"team", "red"}, {"home", {1, 2, 3}}, {"target", "0"}, {"secret", "3 bytes"}}));
  EXPECT_FALSE(ball.contains("gone"));
  EXPECT_EQ(Detail(client->own_body()).at("name"), "ada") << "the player's, for its body has none";
  EXPECT_EQ(Detail(client->own_body()).at("properties").at("health"), 55);
}

TEST_F(BodyMessageTest, ABodyThatNeverMovesHasNoOwnerAndNoMotion) {
  ASSERT_NO_FATAL_FAILURE(PlayBesideAWall());
  const json wall = Detail(BodyId(3));
  EXPECT_EQ(wall.at("name"), "wall");
  EXPECT_EQ(wall.at("position"), (json{4, 5, 6}));
  EXPECT_EQ(wall.at("properties").at("health"), 100);
  for (const char* moving : {"owner", "epoch", "tick", "linear_velocity", "angular_velocity", "asleep", "gone"}) {
    EXPECT_FALSE(wall.contains(moving)) << moving;
  }
}

TEST_F(BodyMessageTest, ABodyThatIsNotSeenIsGone) {
  ASSERT_NO_FATAL_FAILURE(PlayBesideAWall());
  EXPECT_EQ(Detail(kBall), (json{{"type", "detail"}, {"body", "1"}, {"gone", true}})) << "the scene has it";
  EXPECT_EQ(Detail(BodyId(77)), (json{{"type", "detail"}, {"body", "77"}, {"gone", true}})) << "nobody has it";
  ASSERT_NO_FATAL_FAILURE(ShowBoth());
  EXPECT_FALSE(Detail(kBall).contains("gone"));
  const std::vector<replication::DepartureRecord> leaves = {{kBall, Epoch(4), RegionId()}};
  Advance([&](Tick at) { instance->regions[0]->Snapshot(at, {}, leaves); });
  EXPECT_EQ(Detail(kBall).value("gone", false), true);
}

TEST_F(BodyMessageTest, ValuesAreThoseOfAllBodiesThatAreSeen) {
  ASSERT_NO_FATAL_FAILURE(PlayBesideAWall());
  EXPECT_TRUE(ValuesOf(*client, "health").empty()) << "none is seen yet";
  ASSERT_NO_FATAL_FAILURE(ShowBoth());
  const BodyId own = client->own_body();
  EXPECT_EQ(ValuesOf(*client, "health"), (PropertyValues{{kBall, "80"}, {own, "55"}}));
  EXPECT_EQ(ValuesOf(*client, "team"), (PropertyValues{{kBall, R"("red")"}, {own, R"("none")"}}));
  EXPECT_EQ(json::parse(ValuesOf(*client, "home").at(kBall)), (json{1, 2, 3}));
  EXPECT_TRUE(ValuesOf(*client, "mana").empty()) << "the scene declares none";
  const json message = json::parse(ValuesMessage("health", ValuesOf(*client, "health")));
  EXPECT_EQ(message.at("property"), "health");
  EXPECT_EQ(message.at("values"), (json{{"1", 80}, {std::to_string(own.value()), 55}}));
}

}  // namespace
}  // namespace tessera::gateway
