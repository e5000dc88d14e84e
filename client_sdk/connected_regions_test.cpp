#include "client_sdk/connected_regions.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "client_sdk/testing/test_now.h"

namespace tessera::client {
namespace {

// Four regions in a row, each 100 m wide, of which a client sees 50 m about its body. Nothing is sent.
struct ConnectedRegionsTest : testing::Test {
  static constexpr RegionId kWest{1}, kNear{2}, kFar{3}, kEast{4};
  using Left = ConnectedRegions::Left;
  using News = ConnectedRegions::News;

  // Without region `without`, whose place kWest has then.
  static PartitionMap Map(std::uint64_t version, RegionId without = RegionId()) {
    std::vector<Cell> cells;
    std::vector<MapRegion> all;
    for (std::uint32_t i = 0; i < 4; ++i) {
      const RegionId region(i + 1);
      cells.push_back({.area = {100.0 * i, 0, 100.0 * (i + 1), 100},
                       .owner = region == without ? kWest : region,
                       .epoch = Epoch(1)});
      if (region != without) all.push_back({region, RegionId()});
    }
    return *PartitionMap::Create(MapVersion(version), {0, 0, 400, 100}, cells, all);
  }
  static replication::AnnouncedMap Announced(const PartitionMap& map) {
    return {.version = map.version(),
            .bounds = map.bounds(),
            .cells = {map.cells().begin(), map.cells().end()},
            .regions = {map.regions().begin(), map.regions().end()},
            .terms = map.terms()};
  }
  static std::vector<RegionEndpoint> Endpoints() {
    std::vector<RegionEndpoint> endpoints;
    for (const RegionId region : {kWest, kNear, kFar, kEast}) {
      endpoints.push_back({region, "127.0.0.1", static_cast<std::uint16_t>(1000 + region.value()), Incarnation(1)});
    }
    return endpoints;
  }
  static Scene MadeScene() {
    Scene scene;
    scene.bounds = {{0, -10, 0}, {400, 10, 100}};
    scene.view.radius_m = 50;
    return scene;
  }
  // All of them welcome the client, and the world starts.
  void Play() {
    regions.Begin(scene);
    for (RegionConnection& connection : regions.all()) Welcome(connection);
    regions.Start();
  }
  void Welcome(RegionConnection& connection) {
    connection.Accepted(net::PeerHandle());
    regions.Welcomed(connection);
  }
  RegionConnection& At(RegionId region) { return *std::ranges::find(regions.all(), region, &RegionConnection::region); }
  std::vector<RegionId> Follow(double x, std::optional<RegionId> owner = std::nullopt) {
    interest = {.centre = Vec3d(x, 0, 50), .owner = owner};
    (void)regions.DropGone(network);
    (void)regions.DropFar(interest, network);
    (void)regions.MoveToEndpoints(kTestNow, network);
    regions.AddNear(interest);
    std::vector<RegionId> all;
    for (const RegionConnection& connection : regions.all()) all.push_back(connection.region());
    return all;
  }

  const Scene scene = MadeScene();
  ClientEndpoint network{nullptr};
  ConnectedRegions regions{Map(1), Endpoints(), scene};
  ConnectedRegions::Interest interest;
};

using Regions = std::vector<RegionId>;

TEST_F(ConnectedRegionsTest, KeepsThoseThatItsInterestTouches) {
  regions.Begin(scene);
  EXPECT_EQ(Follow(150), Regions({kWest, kNear, kFar, kEast}));  // the world has not started
  Play();
  EXPECT_EQ(Follow(150), Regions({kWest, kNear, kFar}));
  EXPECT_EQ(Follow(270), Regions({kNear, kFar, kEast}));  // kNear, for it is dropped later than it is added
  EXPECT_EQ(Follow(290), Regions({kFar, kEast}));
  EXPECT_EQ(Follow(270), Regions({kFar, kEast}));
  EXPECT_EQ(Follow(290, kWest), Regions({kWest, kFar, kEast}));  // the owner of the own body, wherever it is
}

TEST_F(ConnectedRegionsTest, FollowsTheNewestMapAndEndpoints) {
  Play();
  const PartitionMap without = Map(3, kNear);
  EXPECT_EQ(regions.AdoptMap(Announced(without)), News::kNew);
  EXPECT_EQ(regions.AdoptMap(Announced(Map(2))), News::kOld);
  replication::AnnouncedMap bad = Announced(Map(4));
  bad.cells.pop_back();
  EXPECT_EQ(regions.AdoptMap(bad), News::kMalformed);
  EXPECT_EQ(Follow(150), Regions({kWest, kFar}));  // kWest is where kNear was

  EXPECT_EQ(regions.AdoptEndpoints({{.region = 3, .game_port = 0, .host = "127.0.0.1", .incarnation = 9},
                                    {.region = 1, .game_port = 2000, .host = "127.0.0.1", .incarnation = 2},
                                    {.region = 1, .game_port = 3000, .host = "127.0.0.1", .incarnation = 1}}),
            1u);
  EXPECT_EQ(regions.MoveToEndpoints(kTestNow, network), Regions({kWest}));
  EXPECT_EQ(At(kWest).where().port, 2000);
  EXPECT_FALSE(At(kWest).welcomed());
  EXPECT_TRUE(regions.Welcomed(At(kWest)));  // it was lost, and is back
  EXPECT_FALSE(regions.Welcomed(At(kWest)));
}

TEST_F(ConnectedRegionsTest, AfterTheLastRegionTheMapSaysWhatIsLeft) {
  Play();
  ASSERT_EQ(Follow(50), Regions({kWest, kNear}));
  At(kWest).Stop(network);
  EXPECT_EQ(regions.AfterStop(interest), Left::kSome);
  At(kNear).Stop(network);
  EXPECT_EQ(regions.AfterStop(interest), Left::kOthers);  // far away, so all are dialled
  EXPECT_TRUE(regions.searching());
  EXPECT_EQ(Follow(50), Regions({kWest, kNear, kFar, kEast}));
  for (RegionConnection& connection : regions.all()) connection.Stop(network);
  EXPECT_EQ(regions.AfterStop(interest), Left::kNone);
  At(kEast).NoteGoesOn();
  EXPECT_EQ(regions.AfterStop(interest), Left::kSame);
  regions.DialAgain(kTestNow, "restart");
  EXPECT_EQ(At(kWest).state(), RegionConnection::State::kIdle);
  EXPECT_TRUE(regions.Welcomed(At(kWest)));
}

TEST_F(ConnectedRegionsTest, ASearchGoesOnUntilARegionThatIsNearIsFound) {
  Play();
  ASSERT_EQ(Follow(50), Regions({kWest, kNear}));
  regions.Search();
  EXPECT_TRUE(regions.FollowDue());
  ASSERT_EQ(Follow(50), Regions({kWest, kNear, kFar, kEast}));
  (void)regions.Disconnected(kTestNow, At(kWest));
  (void)regions.Disconnected(kTestNow, At(kNear));
  Welcome(At(kEast));
  regions.EndSearchIfFound(interest);
  EXPECT_TRUE(regions.searching());
  Welcome(At(kNear));
  regions.EndSearchIfFound(interest);
  EXPECT_FALSE(regions.searching());
  EXPECT_EQ(Follow(50), Regions({kWest, kNear}));
}

TEST_F(ConnectedRegionsTest, KnowsWhoHasWelcomedIt) {
  EXPECT_FALSE(regions.AnyWelcomed());
  EXPECT_EQ(regions.Mute()->region(), kWest);
  Welcome(At(kWest));
  EXPECT_TRUE(regions.AnyWelcomed());
  EXPECT_FALSE(regions.AllWelcomed());
  EXPECT_EQ(regions.Welcomed(), Regions({kWest}));
  for (RegionConnection& connection : regions.all()) Welcome(connection);
  EXPECT_TRUE(regions.AllWelcomed());
  EXPECT_EQ(regions.Mute(), nullptr);
}

}  // namespace
}  // namespace tessera::client
