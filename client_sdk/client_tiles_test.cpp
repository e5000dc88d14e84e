// A large level comes in tiles, from the regions or from a folder, as the view reaches them.
#include <gmock/gmock.h>

#include <filesystem>
#include <fstream>
#include <limits>
#include <set>

#include "client_sdk/client_fixture.h"

namespace tessera::client {
namespace {

constexpr double kView_m = 60;

// A square kilometre of two million triangles, and what players see of it.
std::string WideLevel() {
  constexpr int kSamples = 1025;
  std::string text = "view { radius: " + std::to_string(kView_m) +
                     " } bodies { id: 500 motion: MOTION_STATIC shape { height_field { columns: 1025 rows: 1025 "
                     "spacing: 1 heights: [0";
  for (int i = 1; i < kSamples * kSamples; ++i) {
    text += i % 3 == 0 ? ", 0.5" : i % 5 == 0 ? ", -1" : ", 0";
  }
  return text + "] } } }";
}

struct ClientTilesTest : ClientFixture {
  void MakeWide(std::uint32_t regions) {
    static const std::string wide = WideLevel();
    Make(regions, wide);
    level = PackLevel(*instance->scene);
    ASSERT_GT(level.tiles.size(), 8u);
  }
  void JoinBy(const GrantOptions& asked = {}) {
    GrantOptions options = asked;
    options.bind_address = "127.0.0.1";
    auto joined = Client::JoinByGrant(instance->Grant(), options);
    ASSERT_TRUE(joined.ok()) << joined.status();
    client = *std::move(joined);
    events.clear();
    ASSERT_TRUE(Until([&] { return client->state() != ClientState::kJoining; }));
    for (const auto& region : instance->regions) region->Start(tick);
    ASSERT_TRUE(Until([&] { return client->state() == ClientState::kPlaying; }));
    ASSERT_NE(client->Tiles(), nullptr);
  }
  FakeRegion& Region(std::size_t index = 0) { return *instance->regions[index]; }
  // The own body is at this place from now on.
  void Stand(double x, double z) {
    BodyState own;
    own.position = {x, 1, z};
    const std::vector<replication::BodyRecord> bodies = {{PlayerBodyId(client->player()), Epoch(1), own}};
    Advance([&](Tick at) { Region().Snapshot(at, bodies); });
  }
  std::set<std::uint32_t> Near(double x, double z, double radius_m) const {
    std::set<std::uint32_t> near;
    for (std::uint32_t tile = 0; tile < client->Tiles()->tiles.size(); ++tile) {
      const Aabb& box = client->Tiles()->tiles[tile].bounds;
      if (Rect{box.min.x, box.min.z, box.max.x, box.max.z}.DistanceTo(x, z) <= radius_m) near.insert(tile);
    }
    return near;
  }
  std::set<std::uint32_t> Here() const {
    std::set<std::uint32_t> here;
    for (std::uint32_t tile = 0; tile < client->Tiles()->tiles.size(); ++tile) {
      if (client->TileAt(tile) != nullptr) here.insert(tile);
    }
    return here;
  }
  bool Have(const std::set<std::uint32_t>& tiles) {
    return Until([&] { return std::ranges::includes(Here(), tiles); }, true);
  }
  std::uint64_t SentOf(std::size_t region) const {
    std::uint64_t sent = 0;
    for (const auto& [tile, bytes] : instance->regions[region]->tiles.sent) sent += bytes;
    return sent;
  }
  std::uint64_t BytesOf(const std::set<std::uint32_t>& tiles) const {
    std::uint64_t bytes = 0;
    for (const std::uint32_t tile : tiles) bytes += level.tiles[tile].size();
    return bytes;
  }

  PackedLevel level;
  host::TemporaryFolder folder;
};

TEST_F(ClientTilesTest, WhoeverStandsInAPlaceLoadsOnlyWhatIsNearAndGetsTheRestOnTheWay) {
  ASSERT_NO_FATAL_FAILURE(MakeWide(1));
  ASSERT_NO_FATAL_FAILURE(JoinBy());
  EXPECT_TRUE(client->scene().bodies.size() == 1 && client->scene().bodies[0].id == kBall);
  const std::set<std::uint32_t> spawn = Near(0, 0, kView_m), corner = Near(-500, -500, kView_m);
  ASSERT_LT(spawn.size(), level.tiles.size() / 2);
  Stand(0, 0);
  ASSERT_TRUE(Have(spawn));
  for (int i = 0; i < 50; ++i) PollOnce();
  EXPECT_EQ(Here(), spawn);
  EXPECT_EQ(SentOf(0), BytesOf(spawn));
  EXPECT_EQ(Count(ClientEvent::Kind::kTileCame), static_cast<int>(spawn.size()));
  // The own body walks into the corner: what is there comes, and what is far away goes.
  for (double at = 0; at >= -500; at -= 25) Stand(at, at);
  ASSERT_TRUE(Have(corner));
  const std::set<std::uint32_t> here = Here();
  for (const std::uint32_t tile : here) EXPECT_TRUE(Near(-500, -500, kView_m + client->Tiles()->edge_m).contains(tile));
  EXPECT_GT(Count(ClientEvent::Kind::kTileGone), 0);
  EXPECT_EQ(Count(ClientEvent::Kind::kTileCame) - Count(ClientEvent::Kind::kTileGone), static_cast<int>(here.size()));
  EXPECT_EQ(client->Stats().tiles, here.size());
  EXPECT_EQ(client->Stats().tile_bytes, BytesOf(here));
  // All of it, and it is what the level holds.
  client->ViewTiles(std::nullopt, std::numeric_limits<double>::infinity());
  std::set<std::uint32_t> all;
  for (std::uint32_t tile = 0; tile < level.tiles.size(); ++tile) all.insert(tile);
  ASSERT_TRUE(Have(all));
  for (const std::uint32_t tile : all) {
    EXPECT_EQ(PackTile(*client->TileAt(tile), *client->Tiles(), client->scene()), level.tiles[tile]) << tile;
  }
  ASSERT_NE(client->DefOf(BodyId(500)), nullptr);
  EXPECT_EQ(client->Stats().decode_errors, 0u);
}

TEST_F(ClientTilesTest, TheNearestTileComesFirstAndAPlaceOfTheCallersCounts) {
  ASSERT_NO_FATAL_FAILURE(MakeWide(1));
  Region().tiles.chunks_left = 0;
  ASSERT_NO_FATAL_FAILURE(JoinBy());
  client->ViewTiles(Vec3d{400, 0, 400}, 300);
  ASSERT_TRUE(Until(
      [&] {
        return !Region().tiles.requests.empty() && Region().tiles.requests.back().wishes.size() > 3 &&
               Near(400, 400, 0).contains(Region().tiles.requests.back().wishes[0].tile);
      },
      true));
  const auto distance = [&](const replication::TileRequest::Wish& wish) {
    const Aabb& box = client->Tiles()->tiles[wish.tile].bounds;
    return Rect{box.min.x, box.min.z, box.max.x, box.max.z}.DistanceTo(400, 400);
  };
  const auto& wishes = Region().tiles.requests.back().wishes;
  EXPECT_TRUE(std::ranges::is_sorted(wishes, {}, distance));
  EXPECT_LE(distance(wishes.back()), 300);
}

TEST_F(ClientTilesTest, AnotherRegionGoesOnWithATileWhereOneDied) {
  ASSERT_NO_FATAL_FAILURE(MakeWide(2));
  for (std::size_t i = 0; i < 2; ++i) Region(i).tiles.chunks_left = 0;
  ASSERT_NO_FATAL_FAILURE(JoinBy());
  ASSERT_TRUE(Until([&] { return !Region(0).tiles.requests.empty() || !Region(1).tiles.requests.empty(); }, true));
  const std::size_t first = Region(0).tiles.requests.empty() ? 1 : 0, other = 1 - first;
  const std::set<std::uint32_t> spawn = Near(0, 0, kView_m);
  ASSERT_GT(BytesOf(spawn), 5 * replication::kMaxSceneChunkBytes);
  Region(first).tiles.chunks_left = 3;
  ASSERT_TRUE(Until([&] { return Region(first).tiles.chunks_left == 0; }, true));
  for (int i = 0; i < 20; ++i) PollOnce();
  instance->BecomeAnother(first);
  Region(other).tiles.chunks_left = 1000;
  ASSERT_TRUE(Have(spawn));
  EXPECT_EQ(SentOf(other), BytesOf(spawn) - SentOf(first)) << "nothing comes twice";
  EXPECT_GT(SentOf(first), 0u);
}

TEST_F(ClientTilesTest, ATileThatIsNotTheOneOfTheListIsNotShownAndIsAskedForAgain) {
  ASSERT_NO_FATAL_FAILURE(MakeWide(1));
  ASSERT_NO_FATAL_FAILURE(JoinBy());
  const std::set<std::uint32_t> spawn = Near(0, 0, kView_m), corner = Near(-500, -500, kView_m);
  const std::uint32_t bad = *corner.begin();
  ASSERT_TRUE(Have(spawn));
  Region().tiles.spoiled = {bad};
  Stand(-500, -500);
  std::set<std::uint32_t> good = corner;
  good.erase(bad);
  ASSERT_TRUE(Have(good));
  ASSERT_TRUE(Until([&] { return client->Stats().tiles_damaged >= 2; }, true));
  EXPECT_EQ(client->TileAt(bad), nullptr);
  EXPECT_EQ(client->Stats().last_tile_damage, "tile " + std::to_string(bad) + ": is not the one that the scene lists");
  EXPECT_EQ(client->state(), ClientState::kPlaying);
  Region().tiles.spoiled.clear();
  EXPECT_TRUE(Have(corner));
}

TEST_F(ClientTilesTest, TilesThatWereKeptAreNotFetchedAgainAndADamagedOneIs) {
  ASSERT_NO_FATAL_FAILURE(MakeWide(1));
  GrantOptions options;
  options.scene_cache_dir = folder.path();
  ASSERT_NO_FATAL_FAILURE(JoinBy(options));
  const std::set<std::uint32_t> spawn = Near(0, 0, kView_m);
  ASSERT_TRUE(Have(spawn));
  for (int i = 0; i < 50; ++i) PollOnce();  // the last one is kept
  ASSERT_EQ(SentOf(0), BytesOf(spawn));
  Region().tiles.sent.clear();
  client.reset();
  instance->Service();
  ASSERT_NO_FATAL_FAILURE(JoinBy(options));
  ASSERT_TRUE(Have(spawn));
  EXPECT_EQ(SentOf(0), 0u);
  std::string kept;
  for (const auto& entry : std::filesystem::directory_iterator(folder.path())) {
    if (entry.path().extension() == ".tile") kept = entry.path().string();
  }
  ASSERT_NE(kept, "");
  {
    std::fstream file(kept, std::ios::in | std::ios::out | std::ios::binary);
    file.seekp(200);
    file.put('\x7f');
    ASSERT_TRUE(file.good());
  }
  client.reset();
  instance->Service();
  ASSERT_NO_FATAL_FAILURE(JoinBy(options));
  ASSERT_TRUE(Have(spawn));
  EXPECT_EQ(Region().tiles.sent.size(), 1u);
  EXPECT_EQ(client->Stats().tiles_damaged, 0u);
}

TEST_F(ClientTilesTest, PredictionBeginsOnceTheGroundIsThere) {
  ASSERT_NO_FATAL_FAILURE(MakeWide(1));
  Region().tiles.chunks_left = 0;
  GrantOptions options;
  options.predict = true;
  ASSERT_NO_FATAL_FAILURE(JoinBy(options));
  for (int i = 0; i < 60; ++i) {
    Stand(0, 0);
    ASSERT_FALSE(client->Stats().predicting);
  }
  Region().tiles.chunks_left = ~std::size_t{0};
  for (int i = 0; i < 120 && !client->Stats().predicting; ++i) Stand(0, 0);
  EXPECT_TRUE(client->Stats().predicting);
}

}  // namespace
}  // namespace tessera::client
