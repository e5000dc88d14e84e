// Large scenes: stored in pieces before their instance, read whole, and gone with the last that needs them.
#include <gmock/gmock.h>

#include <chrono>
#include <functional>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "control_plane/backup.h"
#include "control_plane/memory_store.h"
#include "control_plane/stored_records.h"
#include "control_plane/testing/grpc_server_fixture.h"
#include "control_plane/testing/state_rig.h"

namespace tessera::control {
namespace {

constexpr char kPieceFolder[] = "scene_piece/";

std::vector<std::string> KeysIn(const Store& store, const char* prefix) {
  std::vector<std::string> keys;
  const auto listed = store.List(prefix);
  for (const StoreEntry& entry : *listed) keys.push_back(entry.key);
  return keys;
}

TEST(ScenePiecesTest, ARecordNamesItsPiecesAndASceneIsNoRecord) {
  const ScenePieces pieces{.version = "0a0b", .bytes = 2 * kScenePieceBytes + 1};
  const auto read = ReadSceneRecord(SceneRecord(pieces));
  ASSERT_TRUE(read.has_value());
  EXPECT_EQ(read->version, "0a0b");
  EXPECT_EQ(read->bytes, pieces.bytes);
  EXPECT_THAT(ScenePieceKeys("feed", pieces),
              testing::ElementsAre("scene_piece/feed/0a0b/0", "scene_piece/feed/0a0b/1", "scene_piece/feed/0a0b/2"));
  EXPECT_FALSE(ReadSceneRecord("").has_value());
  EXPECT_FALSE(ReadSceneRecord(TestScene().SerializeAsString()).has_value());
}

TEST(ScenePiecesTest, ASceneThatNoInstanceWasMadeWithGoesAgain) {
  StateRig rig;
  const ScenePieces pieces{.version = "01", .bytes = 10};
  EXPECT_FALSE(rig.state->HoldScene("feed"));
  ASSERT_TRUE(rig.state->AdoptScene("feed", pieces).ok());
  EXPECT_TRUE(rig.state->ContentInUse(SceneKey("feed")));
  EXPECT_TRUE(rig.store.Get(SceneKey("feed")).ok());
  rig.state->ReleaseScene("feed");
  EXPECT_FALSE(rig.state->ContentInUse(SceneKey("feed")));
  EXPECT_TRUE(absl::IsNotFound(rig.store.Get(SceneKey("feed")).status()));
  EXPECT_EQ(rig.state->effects().scene_pieces, ScenePieceKeys("feed", pieces));
}

TEST(ScenePiecesTest, WhoWasFasterHasItsPiecesAndTheOthersGo) {
  StateRig rig;
  const ScenePieces first{.version = "01", .bytes = 10}, second{.version = "02", .bytes = 10};
  ASSERT_TRUE(rig.state->AdoptScene("feed", first).ok());
  ASSERT_TRUE(rig.state->AdoptScene("feed", second).ok());
  EXPECT_EQ(rig.state->effects().scene_pieces, ScenePieceKeys("feed", second));
  EXPECT_EQ(ReadSceneRecord(rig.store.Get(SceneKey("feed"))->value)->version, "01");
}

// As after a control plane that ended between the pieces and the instance.
TEST(ScenePiecesTest, TheNextLifeFindsWhatIsOfNoInstance) {
  StateRig rig;
  const ScenePieces pieces{.version = "01", .bytes = 3};
  ASSERT_TRUE(rig.store.Put(ScenePieceKeys("feed", pieces).front(), "abc", kAbsent).ok());
  ASSERT_TRUE(rig.state->AdoptScene("feed", pieces).ok());
  ASSERT_TRUE(rig.store.Put("scene_piece/dead/02/0", "def", kAbsent).ok());
  EXPECT_EQ(*ReadContent(rig.store, SceneKey("feed")), "abc");
  const auto next = ClusterState::Load(rig.store);
  ASSERT_TRUE(next.ok()) << next.status();
  EXPECT_FALSE((*next)->ContentInUse(SceneKey("feed")));
  EXPECT_TRUE(absl::IsNotFound(rig.store.Get(SceneKey("feed")).status()));
  EXPECT_THAT((*next)->effects().scene_pieces,
              testing::UnorderedElementsAre("scene_piece/dead/02/0", "scene_piece/feed/01/0"));
}

TEST(ScenePiecesTest, ASceneWhosePiecesAreNotWholeIsNamedAndStopsNobody) {
  MemoryStore store;
  const ScenePieces pieces{.version = "01", .bytes = kScenePieceBytes + 1};
  ASSERT_TRUE(store.Put(SceneKey("feed"), SceneRecord(pieces), kAbsent).ok());
  ASSERT_TRUE(store.Put(ScenePieceKeys("feed", pieces).front(), std::string(kScenePieceBytes, 'x'), kAbsent).ok());
  EXPECT_TRUE(absl::IsNotFound(ReadContent(store, SceneKey("feed")).status()));
  const auto read = ReadRecords(store);
  ASSERT_TRUE(read.ok()) << read.status();
  ASSERT_EQ(read->unreadable.size(), 1U);
  EXPECT_EQ(read->unreadable.front().key, "scene/feed");
  EXPECT_EQ(read->unreadable.front().value, SceneRecord(pieces)) << "it is kept as it was";
  EXPECT_TRUE(read->contents.empty());
}

class LargeSceneTest : public GrpcServerTest {
 protected:
  static v1::CreateInstanceRequest LargeRequest() {
    v1::CreateInstanceRequest request;
    *request.mutable_spec()->mutable_scene() = LargeScene();
    request.mutable_spec()->set_regions(2);
    return request;
  }
  bool Eventually(const std::function<bool()>& holds) const {
    const auto patience = std::chrono::steady_clock::now() + std::chrono::seconds(60);
    while (!holds() && std::chrono::steady_clock::now() < patience) std::this_thread::yield();
    return holds();
  }
};

TEST_F(LargeSceneTest, IsStoredInPiecesServedWholeAndGoesWithItsInstance) {
  AddAgent();
  const v1::CreateInstanceRequest request = LargeRequest();
  const auto made = plane_->CreateInstance(request);
  ASSERT_TRUE(made.ok()) << made.status();
  const std::vector<std::string> keys = KeysIn(*store_, kPieceFolder);
  EXPECT_GE(keys.size(), 2u);
  for (const std::string& key : keys) EXPECT_LE(store_->Get(key)->value.size(), kScenePieceBytes) << key;
  const auto bytes = plane_->SceneBytes(made->scene_hash());
  ASSERT_TRUE(bytes.ok()) << bytes.status();
  v1::Scene scene;
  ASSERT_TRUE(scene.ParseFromString(*bytes));
  EXPECT_EQ(SceneHash(scene), made->scene_hash());

  const auto again = plane_->CreateInstance(request);
  ASSERT_TRUE(again.ok()) << again.status();
  EXPECT_EQ(KeysIn(*store_, kPieceFolder), keys) << "two worlds have one scene";

  agent_->Play();
  for (const std::string& id : {made->id(), again->id()}) {
    v1::DeleteInstanceRequest remove;
    remove.set_id(id);
    v1::DeleteInstanceResponse removed;
    ASSERT_TRUE(instances_->DeleteInstance(&Context(), remove, &removed).ok());
    v1::Instance ended;
    WatchUntil(id, v1::INSTANCE_STATE_ENDED, &ended);
  }
  EXPECT_TRUE(Eventually([this] { return KeysIn(*store_, kPieceFolder).empty(); }));
  EXPECT_TRUE(KeysIn(*store_, "scene/").empty());
}

TEST_F(LargeSceneTest, OneThatIsRefusedLeavesNothing) {
  AddAgent();
  v1::CreateInstanceRequest request = LargeRequest();
  request.mutable_spec()->mutable_native_game()->set_name("a-game-that-no-host-has");
  EXPECT_FALSE(plane_->CreateInstance(request).ok());
  EXPECT_TRUE(Eventually([this] { return KeysIn(*store_, kPieceFolder).empty(); }));
  EXPECT_TRUE(KeysIn(*store_, "scene/").empty());
}

TEST_F(LargeSceneTest, ADryRunWritesNothing) {
  AddAgent();
  v1::CreateInstanceRequest request = LargeRequest();
  request.set_validate_only(true);
  EXPECT_TRUE(plane_->CreateInstance(request).ok());
  EXPECT_TRUE(KeysIn(*store_, kPieceFolder).empty());
}

TEST_F(LargeSceneTest, ABackupHasItWhole) {
  AddAgent();
  const auto made = plane_->CreateInstance(LargeRequest());
  ASSERT_TRUE(made.ok()) << made.status();
  std::string backup;
  ASSERT_TRUE(plane_
                  ->Backup([&](std::string_view part) {
                    backup.append(part);
                    return absl::OkStatus();
                  })
                  .ok());
  MemoryStore restored;
  ASSERT_TRUE(RestoreBackup(backup, restored).ok());
  EXPECT_EQ(*ReadContent(restored, SceneKey(made->scene_hash())), *plane_->SceneBytes(made->scene_hash()));
}

}  // namespace
}  // namespace tessera::control
