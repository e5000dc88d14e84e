#include "client_sdk/own_body.h"

#include <gtest/gtest.h>

#include <vector>

#include "client_sdk/testing/test_now.h"

namespace tessera::client {
namespace {

TEST(OwnBodyTest, TheGameMayGiveAnotherBody) {
  OwnBody own(PlayerNumber(2));
  const BodyId other(7);
  EXPECT_EQ(own.id(), PlayerBodyId(PlayerNumber(2)));
  own.Control(other);
  EXPECT_EQ(own.id(), other);
  EXPECT_EQ(own.MovedBy(own.player_body()), other);  // inputs go on naming the player's
  EXPECT_EQ(own.MovedBy(BodyId(9)), BodyId(9));
  own.NoteMovedByGame(own.player_body());
  EXPECT_FALSE(own.MovedByGame());  // that one stands aside
  own.Control(BodyId());
  EXPECT_EQ(own.id(), own.player_body());
  EXPECT_TRUE(own.MovedByGame());
}

TEST(OwnBodyTest, APlaceStandsInForABodyThatIsNotInSight) {
  OwnBody own(PlayerNumber(2));
  WorldView world(60, 2);
  Scene scene;
  EXPECT_EQ(own.Position(world, scene), std::nullopt);
  scene.player.emplace();
  EXPECT_EQ(own.Position(world, scene), std::nullopt);
  scene.player->spawn_points = {{1, 0, 0}, {2, 0, 0}};
  EXPECT_EQ(own.Position(world, scene), Vec3d(2, 0, 0));  // by its number, as the region does
  EXPECT_EQ(OwnBody(PlayerNumber(kFirstViewer)).Position(world, scene), std::nullopt) << "a viewer comes nowhere";
  own.LookFrom(Vec3d(3, 0, 0));
  EXPECT_EQ(own.Position(world, scene), Vec3d(3, 0, 0));
  replication::ReceivedSnapshot snapshot;
  snapshot.tick = Tick(10);
  replication::BodyRecord body;
  body.id = own.player_body();
  body.state.position = {4, 0, 0};
  snapshot.bodies.push_back(body);
  std::vector<ClientEvent> events;
  world.Take(kTestNow, RegionId(1), snapshot, events);
  EXPECT_EQ(own.Position(world, scene), Vec3d(4, 0, 0));
}

}  // namespace
}  // namespace tessera::client
