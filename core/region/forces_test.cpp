#include "core/region/forces.h"

#include <gtest/gtest.h>

#include "core/region/testing/small_world.h"

namespace tessera::region {
namespace {

Scene Windy() {
  Scene scene = Balls({{-1, 0, 0}, {-4, 0, 0}, {1, 0, 0}});
  scene.gravity_m_s2 = {0, -10, 0};
  UniformField wind;
  wind.bounds = {{-2, -2, -2}, {2, 2, 2}};
  wind.acceleration_m_s2 = {3, 0, 0};
  scene.fields.emplace_back(wind);
  AllowPlayers(scene);
  return scene;
}

class ForcesTest : public ::testing::Test {
 protected:
  Vec3d On(std::size_t index) { return forces.Find(world.bodies, players, records)[index].acceleration_m_s2; }

  SmallWorld world{Windy()};
  RegionPlayers players;
  RecordTable records;
  BodyForces forces{*world.scene, SmallWorld::kTick_s};
};

TEST_F(ForcesTest, AreGravityAndFieldsAndNoneOnASleeper) {
  world.Own(1);
  world.Own(2);
  EXPECT_EQ(On(0), Vec3d(3, -10, 0));
  EXPECT_EQ(On(1), Vec3d(0, -10, 0));  // outside the field
  BodyState asleep = world.InitialOf(3);
  asleep.asleep = true;
  world.Own(3, asleep);
  EXPECT_EQ(On(2), Vec3d());
}

TEST_F(ForcesTest, APlayersInputActsThroughItsMass) {
  const PlayerNumber player(1);
  world.bodies.Own(PlayerBodyId(player), Epoch(1), world.catalog.MakePlayer(player).initial);
  PlayerControl control;
  control.committed = true;
  control.next.force_n = {4, 0, 0};
  players.Adopt(player, control);
  EXPECT_NEAR(On(0).x, 4 / world.catalog.MassOf(PlayerBodyId(player)), 1e-12);
}

// Without fields nobody but those whom players move is looked at.
TEST(ForcesWithoutFieldsTest, InputsPushOwnBodiesAndThoseThatPlayersMove) {
  Scene scene = Balls({{-5, 0, 5}, {-5, 0, -5}});
  AllowPlayers(scene);
  SmallWorld world(std::move(scene));
  world.Own(1);
  world.Own(2);
  const PlayerNumber player(1);
  const BodyId own = PlayerBodyId(player);
  world.bodies.Own(own, Epoch(1), world.catalog.MakePlayer(player).initial);
  world.bodies.NotePlaces();
  RegionPlayers players;
  PlayerControl control;
  control.next.force_n = {4, 0, 0};
  players.Adopt(player, control);
  RecordTable records;
  BodyForces forces{*world.scene, SmallWorld::kTick_s};
  for (const BodyId moved : {own, BodyId(2)}) {
    if (moved != own) players.SetDriven({{own, moved}});
    const std::span<const physics::Forces> found = forces.Find(world.bodies, players, records);
    std::vector<Vec3f> before;
    for (const OwnedBody& body : world.bodies.owned()) before.push_back(body.state.linear_velocity);
    for (std::size_t i = 0; i < before.size(); ++i) {
      EXPECT_EQ(found[i].acceleration_m_s2.x > 0, world.bodies.owned()[i].def->id == moved) << i;
    }
    forces.Apply(players, records, world.bodies);
    world.Step();
    for (std::size_t i = 0; i < before.size(); ++i) {
      const OwnedBody& body = world.bodies.owned()[i];
      EXPECT_EQ(body.state.linear_velocity.x > before[i].x, body.def->id == moved) << i;
    }
  }
}

TEST_F(ForcesTest, AFieldIsEvaluatedOnceForEachState) {
  world.Own(1);
  EXPECT_EQ(On(0).x, 3);
  world.bodies.RemoveOwned(BodyId(1));
  BodyState outside = world.InitialOf(1);
  outside.position.x = -5;
  world.Own(1, outside, Epoch(2));
  EXPECT_EQ(On(0).x, 0);  // another ownership, another note
  forces.StatesChanged();
  EXPECT_EQ(On(0).x, 0);
  forces.Validate();
}

// An owner and a region that has the body as a ghost push it alike.
TEST_F(ForcesTest, AGhostIsPushedByWhatItsOwnerReportedAndByFields) {
  world.AddGhost(3, 2);
  world.ghosts[0].record.force_n = {0, 0, 6};
  world.ghosts[0].record.load_ns = {0, static_cast<float>(10 * SmallWorld::kTick_s), 0};
  world.bodies.PlaceGhosts(world.ghosts);
  forces.Apply(players, records, world.bodies);
  world.bodies.Step(SmallWorld::kTick_s, Tick());
  const Vec3d speed(world.bodies.world().StateOf(BodyId(3)).linear_velocity);
  EXPECT_NEAR(speed.x, 3 * SmallWorld::kTick_s, 1e-6);
  EXPECT_NEAR(speed.y, 0, 1e-6);  // the load bears its weight
  EXPECT_NEAR(speed.z, 6 * SmallWorld::kTick_s, 1e-6);
}

}  // namespace
}  // namespace tessera::region
