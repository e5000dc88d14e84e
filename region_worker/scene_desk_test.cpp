#include "region_worker/scene_desk.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <thread>

#include "core/world/byte_view.h"
#include "core/world/packed_scene.h"
#include "core/world/sha256.h"
#include "core/world/testing/same_scene.h"

namespace tessera::worker {
namespace {

using replication::SceneRequest;

const std::string kDeskHash(64, 'a');
constexpr net::PeerHandle kFirstPeer{1}, kSecondPeer{2};

std::shared_ptr<const Scene> CrowdOf(int balls) {
  auto scene = std::make_shared<Scene>();
  scene->name = "many";
  scene->bounds = {{-10, -10, -10}, {10, 10, 10}};
  const auto shape = std::make_shared<const Shape>(Shape{SphereShape{0.3}});
  for (int i = 1; i <= balls; ++i) {
    BodyDef& ball = scene->bodies.emplace_back();
    ball.id = BodyId(static_cast<std::uint64_t>(i));
    ball.shape = shape;
    ball.initial.position = {0.001 * i, 0, 0};
  }
  return scene;
}

struct SceneDeskTest : testing::Test {
  struct Client {
    std::vector<std::uint8_t> bytes;
    std::uint64_t came = 0;
    std::string refused;
    replication::Digest sha256{};
    std::uint64_t total = 0;
  };

  SceneRequest Ask(std::uint64_t offset, SceneRequest::Want want = SceneRequest::Want::kSend) {
    return {.want = want, .scene_hash = *replication::DigestFrom(kDeskHash), .offset = offset};
  }
  bool Serve() {
    return desk.Serve(now, [this](net::PeerHandle peer, std::span<const std::uint8_t> message) {
      const auto read = replication::DecodeSceneMessage(message);
      ASSERT_TRUE(read.ok()) << read.status();
      Client& client = clients[peer];
      if (const auto* refusal = std::get_if<replication::SceneRefusal>(&*read)) {
        EXPECT_TRUE(client.refused.empty());
        client.refused = refusal->why;
        return;
      }
      const auto& chunk = std::get<replication::SceneChunk>(*read);
      client.sha256 = chunk.sha256;
      client.total = chunk.total_bytes;
      client.came += chunk.bytes.size();
      ASSERT_EQ(chunk.offset, client.bytes.size());
      client.bytes.insert(client.bytes.end(), chunk.bytes.begin(), chunk.bytes.end());
    });
  }
  // The thread that packs has ended: from here on only `now` counts.
  void WaitUntilPacked() {
    for (const auto limit = Clock::now() + std::chrono::seconds(60); Clock::now() < limit && desk.sent_bytes() == 0;) {
      Serve();
      std::this_thread::yield();
    }
    ASSERT_GT(desk.sent_bytes(), 0u);
  }
  void Pass(std::chrono::milliseconds time) { now += time; }

  const std::shared_ptr<const Scene> scene = CrowdOf(20'000);
  const std::vector<std::uint8_t> packed = PackScene(*scene);
  SceneDesk desk{scene, kDeskHash};
  TimePoint now{std::chrono::hours(1)};
  std::map<net::PeerHandle, Client> clients;
};

TEST_F(SceneDeskTest, AClientGetsTheSceneThatTheDigestNames) {
  ASSERT_GT(packed.size(), 2 * replication::kSceneWindowBytes);
  desk.Take(kFirstPeer, Ask(0));
  WaitUntilPacked();
  while (clients[kFirstPeer].bytes.size() < packed.size()) {
    Pass(std::chrono::milliseconds(16));
    desk.Take(kFirstPeer, Ask(clients[kFirstPeer].bytes.size()));
    Serve();
  }
  EXPECT_EQ(clients[kFirstPeer].bytes, packed);
  EXPECT_EQ(clients[kFirstPeer].total, packed.size());
  EXPECT_EQ(clients[kFirstPeer].sha256, *replication::DigestFrom(Sha256Hex(AsText(packed))));
  const auto read = UnpackScene(clients[kFirstPeer].bytes);
  ASSERT_TRUE(read.ok()) << read.status();
  EXPECT_EQ(SceneDifference::Between(*scene, **read), "");
}

TEST_F(SceneDeskTest, AClientThatDoesNotSayWhereItIsGetsOneWindow) {
  desk.Take(kFirstPeer, Ask(0));
  WaitUntilPacked();
  for (int i = 0; i < 1000; ++i) {
    Pass(std::chrono::milliseconds(16));
    desk.Take(kFirstPeer, Ask(0));  // again and again: nothing comes twice
    const bool more = Serve();
    EXPECT_EQ(more, clients[kFirstPeer].came < replication::kSceneWindowBytes);
  }
  EXPECT_EQ(clients[kFirstPeer].came, replication::kSceneWindowBytes);
}

TEST_F(SceneDeskTest, ATickCostsNoMoreThanItsShare) {
  desk.Take(kFirstPeer, Ask(0));
  WaitUntilPacked();
  const auto most = [](double rate, std::chrono::duration<double> time) {
    return SceneDesk::kBurstBytes + rate * time.count();
  };
  const TimePoint begin = now;
  while (clients[kFirstPeer].bytes.size() < packed.size()) {
    Pass(std::chrono::milliseconds(1));
    desk.Take(kFirstPeer, Ask(clients[kFirstPeer].bytes.size()));
    const std::uint64_t before = desk.sent_bytes();
    Serve();
    EXPECT_LE(static_cast<double>(desk.sent_bytes() - before), SceneDesk::kBurstBytes);
    EXPECT_LE(static_cast<double>(clients[kFirstPeer].came), most(SceneDesk::kSession_bytes_per_s, now - begin));
  }
  EXPECT_GE(now - begin, std::chrono::duration<double>((static_cast<double>(packed.size()) - SceneDesk::kBurstBytes) /
                                                       SceneDesk::kSession_bytes_per_s));
}

TEST_F(SceneDeskTest, TwoClientsAreServedInTurns) {
  desk.Take(kFirstPeer, Ask(0));
  WaitUntilPacked();
  desk.Take(kSecondPeer, Ask(0));
  for (int i = 0; i < 10; ++i) {
    Pass(std::chrono::milliseconds(4));
    Serve();
  }
  const auto ada = static_cast<std::int64_t>(clients[kFirstPeer].came),
             bob = static_cast<std::int64_t>(clients[kSecondPeer].came);
  EXPECT_GT(bob, 0);
  EXPECT_LE(std::abs(ada - bob), 2 * static_cast<std::int64_t>(replication::kMaxSceneChunkBytes) +
                                     static_cast<std::int64_t>(SceneDesk::kBurstBytes));
}

TEST_F(SceneDeskTest, AClientGoesOnFromWhereItWas) {
  desk.Take(kFirstPeer, Ask(packed.size() - 100'000));
  clients[kFirstPeer].bytes.assign(packed.begin(), packed.end() - 100'000);  // from another region
  WaitUntilPacked();
  while (clients[kFirstPeer].bytes.size() < packed.size()) {
    Pass(std::chrono::milliseconds(16));
    Serve();
  }
  EXPECT_EQ(clients[kFirstPeer].bytes, packed);
  EXPECT_EQ(clients[kFirstPeer].came, 100'000u);
  EXPECT_FALSE(Serve());
}

TEST_F(SceneDeskTest, AnotherSceneIsRefusedOnce) {
  SceneRequest other = Ask(0);
  other.scene_hash[0] ^= 1;
  for (int i = 0; i < 3; ++i) {
    desk.Take(kFirstPeer, other);
    EXPECT_FALSE(Serve());  // and checks that it is refused once
  }
  EXPECT_EQ(clients[kFirstPeer].refused, "the region runs another scene");
  EXPECT_EQ(desk.sent_bytes(), 0u);
}

TEST_F(SceneDeskTest, NothingGoesToAClientThatHasGoneOrHasIt) {
  desk.Take(kFirstPeer, Ask(0));
  WaitUntilPacked();
  desk.Take(kSecondPeer, Ask(0));
  desk.Take(kFirstPeer, Ask(0, SceneRequest::Want::kHave));
  desk.Retain([](net::PeerHandle peer) { return peer == kFirstPeer; });
  const std::uint64_t before = desk.sent_bytes();
  Pass(std::chrono::seconds(1));
  EXPECT_FALSE(Serve());
  EXPECT_EQ(desk.sent_bytes(), before);
}

// A level of several tiles.
std::shared_ptr<const Scene> TiledScene() {
  auto scene = std::make_shared<Scene>();
  scene->name = "wide";
  scene->bounds = {{-600, -10, -600}, {600, 10, 600}};
  HeightFieldShape field{.columns = 1000, .rows = 1000, .spacing_m = 1, .heights_m = {}};
  for (std::uint32_t i = 0; i < 1'000'000; ++i) field.heights_m.push_back(static_cast<float>(i % 7) * 0.1F);
  BodyDef& ground = scene->bodies.emplace_back();
  ground.id = BodyId(1);
  ground.motion = Motion::kStatic;
  ground.mass_kg = 0;
  ground.shape = std::make_shared<const Shape>(Shape{std::move(field)});
  return scene;
}

struct TileDeskTest : testing::Test {
  struct Client {
    std::map<std::uint32_t, std::vector<std::uint8_t>> tiles;
    std::vector<std::uint32_t> order;  // the tile of each part, as they came
    std::uint64_t came = 0;
    std::uint32_t asked = 0;
  };
  using Wish = replication::TileRequest::Wish;

  void Ask(net::PeerHandle peer, std::vector<Wish> wishes) {
    desk.Take(peer, {.number = ++clients[peer].asked,
                     .scene_hash = *replication::DigestFrom(kDeskHash),
                     .wishes = std::move(wishes)});
  }
  bool Serve() {
    return desk.Serve(now, [this](net::PeerHandle peer, std::span<const std::uint8_t> message) {
      const auto read = replication::DecodeSceneMessage(message);
      ASSERT_TRUE(read.ok()) << read.status();
      const auto& chunk = std::get<replication::TileChunk>(*read);
      std::vector<std::uint8_t>& bytes = clients[peer].tiles[chunk.tile];
      ASSERT_EQ(chunk.offset, bytes.size());
      bytes.insert(bytes.end(), chunk.bytes.begin(), chunk.bytes.end());
      clients[peer].order.push_back(chunk.tile);
      clients[peer].came += chunk.bytes.size();
    });
  }
  void WaitUntilPacked() {
    for (const auto limit = Clock::now() + std::chrono::seconds(60); Clock::now() < limit && desk.sent_bytes() == 0;) {
      Serve();
      std::this_thread::yield();
    }
    ASSERT_GT(desk.sent_bytes(), 0u);
  }

  const std::shared_ptr<const Scene> scene = TiledScene();
  const PackedLevel level = PackLevel(*scene);
  SceneDesk desk{scene, kDeskHash};
  TimePoint now{std::chrono::hours(1)};
  std::map<net::PeerHandle, Client> clients;
};

TEST_F(TileDeskTest, AClientGetsTheTilesThatItAsksForInItsOrderAndNoOthers) {
  ASSERT_GT(level.tiles.size(), 6u);
  Client& client = clients[kFirstPeer];
  const auto ask = [&] { Ask(kFirstPeer, {{5, client.tiles[5].size()}, {2, client.tiles[2].size()}}); };
  ask();
  WaitUntilPacked();
  for (int i = 0; i < 1000 && client.came < level.tiles[5].size() + level.tiles[2].size(); ++i) {
    now += std::chrono::milliseconds(16);
    ask();
    Serve();
  }
  EXPECT_EQ(client.tiles[5], level.tiles[5]);
  EXPECT_EQ(client.tiles[2], level.tiles[2]);
  EXPECT_EQ(client.tiles.size(), 2u);
  EXPECT_TRUE(std::ranges::is_sorted(client.order, std::greater<>())) << "the first of its wishes first";
  now += std::chrono::seconds(1);
  EXPECT_FALSE(Serve());
}

TEST_F(TileDeskTest, NoMoreThanAWindowWaitsForAClientThatSaysNothingMore) {
  std::vector<Wish> all;
  for (std::uint32_t tile = 0; tile < 6; ++tile) all.push_back({tile, 0});
  Ask(kFirstPeer, all);
  WaitUntilPacked();
  for (int i = 0; i < 1000; ++i) {
    now += std::chrono::milliseconds(16);
    Ask(kFirstPeer, all);
    Serve();
  }
  EXPECT_EQ(clients[kFirstPeer].came, replication::kSceneWindowBytes);
}

TEST_F(TileDeskTest, ATileThatWasGivenUpComesAgainWhenItIsAskedForAgain) {
  Client& client = clients[kFirstPeer];
  const auto fetch = [&] {
    for (int i = 0; i < 1000 && client.tiles[3].size() < level.tiles[3].size(); ++i) {
      Ask(kFirstPeer, {{3, client.tiles[3].size()}});
      Serve();
      now += std::chrono::milliseconds(16);
      std::this_thread::yield();
    }
  };
  Ask(kFirstPeer, {{3, 0}});
  WaitUntilPacked();
  fetch();
  ASSERT_EQ(client.tiles[3], level.tiles[3]);
  client.tiles.clear();
  Ask(kFirstPeer, {});
  fetch();
  EXPECT_EQ(client.tiles[3], level.tiles[3]);
  EXPECT_EQ(client.came, 2 * level.tiles[3].size());
}

TEST_F(TileDeskTest, ARequestThatWasOvertakenAndATileThatIsNoneCountForNothing) {
  Ask(kFirstPeer, {{1, 0}});
  WaitUntilPacked();
  clients[kFirstPeer].asked = 0;
  Ask(kFirstPeer, {{2, 0}});  // number 1 again
  clients[kFirstPeer].asked = 7;
  now += std::chrono::seconds(1);
  Serve();
  EXPECT_FALSE(clients[kFirstPeer].tiles.contains(2));
  Ask(kFirstPeer, {{static_cast<std::uint32_t>(level.tiles.size()), 0}});
  now += std::chrono::seconds(1);
  EXPECT_FALSE(Serve());
}

TEST_F(TileDeskTest, TilesKeepToTheRateOfTheScene) {
  Client& client = clients[kFirstPeer];
  const auto ask = [&] {
    std::vector<Wish> wishes;
    for (std::uint32_t tile = 0; tile < level.tiles.size() && wishes.size() < 16; ++tile) {
      if (client.tiles[tile].size() < level.tiles[tile].size()) wishes.push_back({tile, client.tiles[tile].size()});
    }
    Ask(kFirstPeer, wishes);
    return !wishes.empty();
  };
  ask();
  WaitUntilPacked();
  const TimePoint begin = now;
  while (ask()) {
    now += std::chrono::milliseconds(4);
    Serve();
    const std::chrono::duration<double> passed = now - begin;
    EXPECT_LE(static_cast<double>(client.came),
              SceneDesk::kBurstBytes + SceneDesk::kSession_bytes_per_s * passed.count());
    ASSERT_LT(passed.count(), 60);
  }
}

}  // namespace
}  // namespace tessera::worker
