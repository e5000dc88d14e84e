// The real program serves its clients the packed scene of their world.
#include <gtest/gtest.h>

#include <algorithm>
#include <csignal>
#include <string>

#include "core/world/packed_scene.h"
#include "core/world/testing/same_scene.h"
#include "region_worker/input_files.h"
#include "region_worker/scene_desk.h"
#include "region_worker/testing/test_client.h"
#include "region_worker/testing/worker_process.h"

namespace tessera::worker {
namespace {

using Want = replication::SceneRequest::Want;

// More than a window of packed scene.
constexpr char kCrowd[] = R"(
  name: "crowd"
  bounds { min { x: -200 y: -2 z: -200 } max { x: 200 y: 100 z: 200 } }
  bodies { id: 1 motion: MOTION_STATIC shape { plane { normal { y: 1 } } } }
  scatters {
    first_id: 100 count: 15000
    area { min { x: -190 y: 0.5 z: -190 } max { x: 190 y: 90 z: 190 } }
    spacing: 2 jitter: 0.3 seed: 3
    templates { mass: 1 shape { sphere { radius: 0.4 } } }
  }
  player {
    body { name: "player" mass: 80 shape { sphere { radius: 0.5 } } }
    spawn_points { x: -5 y: 3 z: 0 }
    max_force: 2000 max_speed: 6
  }
)";

class WorkerSceneTest : public testing::Test {
 protected:
  void Start(std::uint32_t regions, const std::string& text = kCrowd) {
    base_ = FreeBasePort(regions);
    const std::string file = WriteTestFile("world.textproto", text);
    scene_ = *LoadSceneFile(file);
    for (std::uint32_t region = 1; region <= regions; ++region) {
      workers_.push_back(std::make_unique<WorkerProcess>(
          std::vector<std::string>{"--scene", file, "--regions", std::to_string(regions), "--region",
                                   std::to_string(region), "--base-port", std::to_string(base_)}));
    }
    // A region that still loads its scene answers no hello.
    for (auto& worker : workers_) ASSERT_TRUE(worker->WaitForLine(": running")) << worker->said();
  }
  std::unique_ptr<TestClient> Join(std::uint32_t region) {
    auto client = std::make_unique<TestClient>(scene_->bounds);
    EXPECT_TRUE(
        client->Connect(static_cast<std::uint16_t>(base_ + 3 * (region - 1)), RegionId(region), CredentialsFor(1)));
    EXPECT_TRUE(client->Until([&] { return client->welcome.has_value(); }));
    return client;
  }
  // Asks, again and again as a client does, until `done`.
  static bool Fetch(TestClient& client, const std::function<bool()>& done) {
    std::optional<std::size_t> asked_at;
    return client.Until([&] {
      if (!asked_at || client.scene_bytes.size() - *asked_at > replication::kSceneWindowBytes / 4) {
        asked_at = client.scene_bytes.size();
        client.AskForScene(Want::kSend);
      }
      return done();
    });
  }

  // Asks for what has not come of these tiles, again and again as a client does.
  static bool FetchTiles(TestClient& client, const std::vector<std::uint32_t>& tiles, const PackedLevel& level) {
    std::optional<std::size_t> asked_at;
    return client.Until([&] {
      std::vector<std::uint32_t> missing;
      std::size_t came = 0;
      for (const std::uint32_t tile : tiles) {
        came += client.tiles[tile].size();
        if (client.tiles[tile].size() < level.tiles[tile].size()) missing.push_back(tile);
      }
      if (missing.empty()) return true;
      if (!asked_at || came - *asked_at > replication::kSceneWindowBytes / 4) {
        asked_at = came;
        client.AskForTiles(missing);
      }
      return false;
    });
  }

  std::uint16_t base_ = 0;
  std::shared_ptr<const Scene> scene_;
  std::vector<std::unique_ptr<WorkerProcess>> workers_;
};

TEST_F(WorkerSceneTest, AClientGetsTheSceneAndSnapshotsOnlyAfterIt) {
  Start(1);
  const auto client = Join(1);
  ASSERT_TRUE(client->Until([&] { return client->started; }));
  client->AskForScene(Want::kHold);
  // Those that were on their way have come once the first chunk is here: the channel is slower than they are.
  ASSERT_TRUE(Fetch(*client, [&] { return client->scene_total > 0; }));
  const std::uint32_t records = client->records;
  ASSERT_TRUE(Fetch(*client, [&] { return client->scene_bytes.size() == client->scene_total; }));
  EXPECT_GT(client->scene_total, replication::kSceneWindowBytes);
  EXPECT_EQ(client->records, records);
  const auto scene = UnpackScene(client->scene_bytes);
  ASSERT_TRUE(scene.ok()) << scene.status();
  EXPECT_EQ(SceneDifference::Between(*scene_, **scene), "");
  client->AskForScene(Want::kHave);
  EXPECT_TRUE(client->Until([&] { return client->records > records; }));
}

TEST_F(WorkerSceneTest, AClientGoesOnAtAnotherRegionWhenItsRegionDies) {
  Start(2);
  const auto first = Join(1);
  const auto second = Join(2);
  ASSERT_TRUE(Fetch(*first, [&] { return !first->scene_bytes.empty(); }));
  ASSERT_LT(first->scene_bytes.size(), first->scene_total);
  workers_[0]->Signal(SIGKILL);
  second->scene_bytes = first->scene_bytes;
  const std::size_t from = second->scene_bytes.size();
  ASSERT_TRUE(
      Fetch(*second, [&] { return second->scene_total > 0 && second->scene_bytes.size() == second->scene_total; }));
  EXPECT_GT(from, 0u);
  EXPECT_EQ(second->scene_bytes, PackScene(*scene_));
}

// A square kilometre, of which the packed scene holds nothing.
std::string WideField() {
  std::string text = R"(
    name: "wide" bounds { min { x: -600 y: -20 z: -600 } max { x: 600 y: 100 z: 600 } }
    player { body { mass: 80 shape { sphere { radius: 0.5 } } } spawn_points { y: 3 } max_force: 2000 max_speed: 6 }
    bodies { id: 6 mass: 1 shape { sphere { radius: 0.4 } } pose { position { x: -50 y: 95 z: -50 } } }
    bodies { id: 7 mass: 1 shape { sphere { radius: 0.4 } } pose { position { x: 50 y: 95 z: 50 } } }
    bodies { id: 1 motion: MOTION_STATIC
             shape { height_field { columns: 1025 rows: 1025 spacing: 1 heights: [0)";
  for (int i = 1; i < 1025 * 1025; ++i) text += i % 7 == 0 ? ",1" : ",0";
  return text + "] } } }";
}

// Two million triangles: the world is shown at once, and its level comes beside the snapshots.
TEST_F(WorkerSceneTest, AClientOfALargeLevelGetsTheTilesThatItAsksForBesideSnapshots) {
  Start(2, WideField());
  const PackedLevel level = PackLevel(*scene_);
  ASSERT_GT(level.tiles.size(), 8u);
  const auto client = Join(1);
  ASSERT_TRUE(
      Fetch(*client, [&] { return client->scene_total > 0 && client->scene_bytes.size() == client->scene_total; }));
  EXPECT_EQ(client->scene_bytes, level.scene);
  EXPECT_LT(level.scene.size(), 10'000u);
  client->AskForScene(Want::kHave);
  ASSERT_TRUE(FetchTiles(*client, {5, 2}, level));
  EXPECT_EQ(client->tiles[5], level.tiles[5]);
  EXPECT_EQ(client->tiles[2], level.tiles[2]);
  const std::uint32_t records = client->records;
  EXPECT_TRUE(client->Until([&] { return client->records > records; }));
  // A region that dies is followed by the other one, from where it was.
  const auto other = Join(2);
  client->AskForTiles({3});
  ASSERT_TRUE(client->Until([&] { return !client->tiles[3].empty(); }));
  workers_[0]->Signal(SIGKILL);
  other->tiles[3] = client->tiles[3];
  other->tiles[3].resize(std::min<std::size_t>(other->tiles[3].size(), 20'000));
  ASSERT_TRUE(FetchTiles(*other, {3}, level));
  EXPECT_EQ(other->tiles[3], level.tiles[3]);
}

}  // namespace
}  // namespace tessera::worker
