// Joining by a grant alone: no control plane is asked, and the scene comes from the regions.
#include <gmock/gmock.h>

#include <filesystem>
#include <fstream>

#include "client_sdk/client_fixture.h"
#include "core/world/testing/same_scene.h"

namespace tessera::client {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;
using Want = replication::SceneRequest::Want;

struct ClientGrantTest : ClientFixture {
  // With so many walls beside the ball, so that the scene has several chunks of 100 bytes.
  void MakeWalled(std::uint32_t regions) {
    std::string walls;
    for (int i = 0; i < 20; ++i) {
      walls += "bodies { id: " + std::to_string(100 + i) +
               " motion: MOTION_STATIC shape { sphere { radius: " + std::to_string(1 + i) + " } } }";
    }
    Make(regions, walls);
    for (const auto& region : instance->regions) region->scene_chunk_bytes = 100;
  }
  GrantOptions ByGrant() const {
    GrantOptions options;
    options.bind_address = "127.0.0.1";
    return options;
  }
  void JoinBy(const std::vector<std::uint8_t>& grant, const GrantOptions& options) {
    auto joined = Client::JoinByGrant(grant, options);
    ASSERT_TRUE(joined.ok()) << joined.status();
    client = *std::move(joined);
  }
  bool Welcomed(std::size_t index) const { return instance->regions[index]->clients() > 0; }
  int Asked(std::size_t index, Want want) const {
    return static_cast<int>(
        std::ranges::count(instance->regions[index]->scene_requests, want, &replication::SceneRequest::want));
  }
  std::string KeptFile() const {
    for (const auto& entry : std::filesystem::directory_iterator(folder.path())) return entry.path().string();
    return "";
  }

  host::TemporaryFolder folder;
};

TEST_F(ClientGrantTest, ABlobAloneLeadsIntoTheWorld) {
  MakeWalled(2);
  ASSERT_NO_FATAL_FAILURE(JoinBy(instance->Grant(), ByGrant()));
  EXPECT_EQ(client->state(), ClientState::kJoining);
  EXPECT_TRUE(client->scene().bodies.empty());
  ASSERT_NO_FATAL_FAILURE(Play());
  EXPECT_EQ(SceneDifference::Between(client->scene(), *instance->scene), "");
  EXPECT_EQ(client->player(), PlayerNumber(1));
  EXPECT_EQ(instance->scenes_fetched, 0);
  Advance([&](Tick at) {
    const std::vector<replication::BodyRecord> ball = {{kBall, Epoch(1), Moving(3, 0)}};
    instance->regions[0]->Snapshot(at, ball);
  });
  ASSERT_TRUE(client->World().contains(kBall));
  EXPECT_NEAR(client->World().at(kBall).state.position.x, 3, 0.01);
  EXPECT_EQ(client->Stats().decode_errors, 0u);
}

TEST_F(ClientGrantTest, ItIsJoiningUntilTheSceneIsThereAndPollsGoOn) {
  MakeWalled(1);
  FakeRegion& region = *instance->regions[0];
  region.started = true;
  region.scene_chunks_left = 2;
  ASSERT_NO_FATAL_FAILURE(JoinBy(instance->Grant(), ByGrant()));
  ASSERT_TRUE(Until([&] { return region.scene_chunks_left == 0; }));
  for (int i = 0; i < 100; ++i) {
    now += std::chrono::milliseconds(16);
    region.Snapshot(Tick(static_cast<std::uint64_t>(i) + 1), {});
    PollOnce();
    ASSERT_EQ(client->state(), ClientState::kJoining);
  }
  EXPECT_EQ(client->tick(), Tick());
  EXPECT_EQ(client->Stats().decode_errors, 0u);
  EXPECT_EQ(client->Record(folder.path() + "/x.tsr").code(), absl::StatusCode::kFailedPrecondition);
  region.scene_chunks_left = 1000;
  ASSERT_TRUE(Until([&] { return client->state() == ClientState::kPlaying; }, true));
  EXPECT_GT(Asked(0, Want::kSend), 1);
}

TEST_F(ClientGrantTest, OneRegionSendsTheSceneAndTheOthersHold) {
  MakeWalled(3);
  ASSERT_NO_FATAL_FAILURE(JoinBy(instance->Grant(), ByGrant()));
  ASSERT_NO_FATAL_FAILURE(Play());
  std::uint64_t sent = 0;
  for (const auto& region : instance->regions) sent += region->scene_sent;
  EXPECT_EQ(sent, instance->packed_scene().size());
  for (std::size_t i = 0; i < 3; ++i) ASSERT_TRUE(Until([&] { return Asked(i, Want::kHave) > 0; }, true)) << i;
}

TEST_F(ClientGrantTest, AnotherRegionGoesOnWhereOneDied) {
  MakeWalled(2);
  instance->regions[0]->scene_chunks_left = 3;
  instance->regions[1]->scene_chunks_left = 0;
  ASSERT_NO_FATAL_FAILURE(JoinBy(instance->Grant(), ByGrant()));
  ASSERT_TRUE(Until([&] { return Welcomed(0) && Welcomed(1); }));
  // Whichever is asked first falls silent, and the first one has died by then.
  ASSERT_TRUE(Until([&] { return instance->regions[0]->scene_sent == 300; }, true));
  instance->BecomeAnother(0);
  instance->regions[1]->scene_chunks_left = 1000;
  ASSERT_TRUE(Until([&] { return !client->scene().bodies.empty(); }, true));
  EXPECT_EQ(SceneDifference::Between(client->scene(), *instance->scene), "");
  EXPECT_EQ(instance->regions[1]->scene_sent, instance->packed_scene().size() - 300);
}

TEST_F(ClientGrantTest, ASceneThatWasKeptIsNotFetchedAgain) {
  MakeWalled(1);
  GrantOptions options = ByGrant();
  options.scene_cache_dir = folder.path() + "/made/when/needed";
  ASSERT_NO_FATAL_FAILURE(JoinBy(instance->Grant(), options));
  ASSERT_NO_FATAL_FAILURE(Play());
  const std::uint64_t sent = instance->regions[0]->scene_sent;
  EXPECT_GT(sent, 0u);
  ASSERT_NO_FATAL_FAILURE(JoinBy(instance->Grant(), options));
  EXPECT_EQ(SceneDifference::Between(client->scene(), *instance->scene), "") << "a small one is read at once";
  ASSERT_TRUE(Until([&] { return client->state() == ClientState::kPlaying; }));
  EXPECT_EQ(instance->regions[0]->scene_sent, sent);
}

TEST_F(ClientGrantTest, ADamagedFileIsFetchedAnewAndAFolderThatCannotBeIsNone) {
  MakeWalled(1);
  GrantOptions options = ByGrant();
  options.scene_cache_dir = folder.path();
  ASSERT_NO_FATAL_FAILURE(JoinBy(instance->Grant(), options));
  ASSERT_NO_FATAL_FAILURE(Play());
  const std::uint64_t sent = instance->regions[0]->scene_sent;
  {
    std::fstream kept(KeptFile(), std::ios::in | std::ios::out | std::ios::binary);
    kept.seekp(100);
    kept.put('\x7f');
    ASSERT_TRUE(kept.good());
  }
  ASSERT_NO_FATAL_FAILURE(JoinBy(instance->Grant(), options));
  ASSERT_TRUE(Until([&] { return client->state() == ClientState::kPlaying; }));
  EXPECT_EQ(instance->regions[0]->scene_sent, 2 * sent);
  options.scene_cache_dir = "/dev/null/no/folder";
  ASSERT_NO_FATAL_FAILURE(JoinBy(instance->Grant(), options));
  ASSERT_TRUE(Until([&] { return client->state() == ClientState::kPlaying; }));
  EXPECT_EQ(instance->regions[0]->scene_sent, 3 * sent);
}

TEST_F(ClientGrantTest, ASceneThatTheCallerHasIsNotFetched) {
  MakeWalled(1);
  GrantOptions options = ByGrant();
  options.scene = instance->scene;
  ASSERT_NO_FATAL_FAILURE(JoinBy(instance->Grant(), options));
  ASSERT_NO_FATAL_FAILURE(Play());
  EXPECT_TRUE(instance->regions[0]->scene_requests.empty());
}

TEST_F(ClientGrantTest, AViewersGrantWatches) {
  MakeWalled(2);
  ASSERT_NO_FATAL_FAILURE(JoinBy(instance->Grant(true), ByGrant()));
  ASSERT_NO_FATAL_FAILURE(Play());
  EXPECT_EQ(client->player(), PlayerNumber());
  EXPECT_TRUE(client->return_token().empty());
}

TEST_F(ClientGrantTest, ASceneThatIsNotWhatTheRegionNamedEndsTheClient) {
  MakeWalled(1);
  instance->regions[0]->spoiled_scene = true;
  ASSERT_NO_FATAL_FAILURE(JoinBy(instance->Grant(), ByGrant()));
  ASSERT_TRUE(Until([&] { return client->state() == ClientState::kEnded; }));
  EXPECT_EQ(client->reason().code(), absl::StatusCode::kInternal);
  EXPECT_THAT(std::string(client->reason().message()), HasSubstr("not the one that they named"));
}

TEST_F(ClientGrantTest, ARegionOfAnotherSceneEndsTheClient) {
  MakeWalled(1);
  instance->regions[0]->other_scene = true;
  ASSERT_NO_FATAL_FAILURE(JoinBy(instance->Grant(), ByGrant()));
  ASSERT_TRUE(Until([&] { return client->state() == ClientState::kEnded; }));
  EXPECT_THAT(std::string(client->reason().message()), HasSubstr("does not send the scene: the region runs another"));
  EXPECT_FALSE(client->needs_new_grant());
}

TEST_F(ClientGrantTest, ASceneThatNeverComesIsSaidToBeMissing) {
  MakeWalled(1);
  instance->regions[0]->scene_chunks_left = 1;
  ASSERT_NO_FATAL_FAILURE(JoinBy(instance->Grant(), ByGrant()));
  ASSERT_TRUE(Until([&] { return instance->regions[0]->scene_chunks_left == 0; }));
  for (int i = 0; i < 100; ++i) PollOnce();
  now += ByGrant().deadline + std::chrono::milliseconds(1);
  ASSERT_TRUE(Until([&] { return client->state() == ClientState::kEnded; }));
  EXPECT_EQ(client->reason().code(), absl::StatusCode::kDeadlineExceeded);
  EXPECT_THAT(std::string(client->reason().message()), HasSubstr("do not send the scene"));
}

TEST_F(ClientGrantTest, WhereNobodyAnswersANewGrantIsNeeded) {
  MakeWalled(2);
  const std::vector<std::uint8_t> grant = instance->Grant();
  instance->EndAll();
  ASSERT_NO_FATAL_FAILURE(JoinBy(grant, ByGrant()));
  ASSERT_TRUE(Until([&] {
    now += std::chrono::milliseconds(100);
    return client->state() == ClientState::kEnded;
  }));
  EXPECT_TRUE(client->needs_new_grant());
}

TEST_F(ClientGrantTest, WhereNobodyAnswersAnyMoreANewGrantIsNeeded) {
  MakeWalled(1);
  ASSERT_NO_FATAL_FAILURE(JoinBy(instance->Grant(), ByGrant()));
  ASSERT_NO_FATAL_FAILURE(Play());
  EXPECT_FALSE(client->needs_new_grant());
  instance->BecomeAnother(0);
  ASSERT_TRUE(Until([&] {
    now += std::chrono::milliseconds(50);
    return client->state() == ClientState::kEnded;
  }));
  EXPECT_TRUE(client->needs_new_grant());
  EXPECT_EQ(client->reason().code(), absl::StatusCode::kUnavailable);
}

TEST_F(ClientGrantTest, WhatIsNoGrantIsNamed) {
  MakeWalled(1);
  std::vector<std::uint8_t> grant = instance->Grant();
  grant.back() ^= 1;
  EXPECT_EQ(Client::JoinByGrant(grant, ByGrant()).status().message(), "checksum: the grant is damaged");
  EXPECT_THAT(std::string(Client::JoinByGrant({}, ByGrant()).status().message()), StartsWith("grant: "));
}

TEST_F(ClientGrantTest, LeavingTellsWhoGaveTheGrant) {
  MakeWalled(1);
  GrantOptions options = ByGrant();
  std::vector<std::uint8_t> left;
  options.leave = [&](const net::Credentials& credentials, std::chrono::milliseconds) {
    left = credentials.statement;
    return absl::UnavailableError("nobody home");
  };
  ASSERT_NO_FATAL_FAILURE(JoinBy(instance->Grant(), options));
  ASSERT_NO_FATAL_FAILURE(Play());
  EXPECT_EQ(client->Leave().message(), "nobody home");
  EXPECT_EQ(client->state(), ClientState::kEnded);
  EXPECT_FALSE(left.empty());
  ASSERT_NO_FATAL_FAILURE(JoinBy(instance->Grant(), ByGrant()));
  EXPECT_TRUE(client->Leave().ok());
  EXPECT_EQ(client->state(), ClientState::kEnded);
}

// A floor of so many squares of a metre each way, as a scene's text.
std::string Floor(int squares) {
  std::string mesh = "bodies { id: 900 motion: MOTION_STATIC shape { mesh {";
  for (int z = 0; z <= squares; ++z) {
    for (int x = 0; x <= squares; ++x) {
      mesh += " vertices { x: " + std::to_string(x - squares / 2) + " z: " + std::to_string(z - squares / 2) + " }";
    }
  }
  for (int z = 0; z < squares; ++z) {
    for (int x = 0; x < squares; ++x) {
      const int a = z * (squares + 1) + x, b = a + 1, c = a + squares + 1, d = c + 1;
      for (const int corner : {a, c, b, b, c, d}) mesh += " indices: " + std::to_string(corner);
    }
  }
  return mesh + " } } }";
}

// The scene is read and the ground is built in parts: no poll from joining on does more than about one part.
TEST_F(ClientGrantTest, TheFirstPollsAreLikeAllOthers) {
  Make(1, Floor(96));
  GrantOptions options = ByGrant();
  options.predict = true;
  options.scene_cache_dir = folder.path();
  ASSERT_NO_FATAL_FAILURE(JoinBy(instance->Grant(), options));
  ASSERT_NO_FATAL_FAILURE(Play());
  BodyState own = Moving(3, 1);
  int predicts_after = 0;
  for (int i = 1; i <= 600; ++i) {
    own.position.x += 1.0 / 60;
    const std::vector<replication::BodyRecord> bodies = {{PlayerBodyId(PlayerNumber(1)), Epoch(1), own}};
    now += kTick;
    if (i % 2 == 0) Advance([&](Tick at) { instance->regions[0]->Snapshot(at, bodies); });
    PollOnce();
    if (predicts_after == 0 && client->Stats().predicting) predicts_after = i;
  }
  EXPECT_GT(predicts_after, 0);
  EXPECT_LE(predicts_after, 60) << "within a second";
  EXPECT_TRUE(client->Stats().predicting);
  // A part, and the piece of ground or of the scene with which it ended.
  EXPECT_LE(client->Stats().most_work_units, 5 * std::int64_t{100'000} / 2);
  EXPECT_GT(client->Stats().most_work_units, 50'000) << "there was something to do";
}

}  // namespace
}  // namespace tessera::client
