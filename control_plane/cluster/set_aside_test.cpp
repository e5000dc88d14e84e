// Records that cannot be read: the cluster goes on without them, and nothing that they may name is lost.
#include <gmock/gmock.h>

#include <algorithm>
#include <string>

#include "control_plane/cluster/queries.h"
#include "control_plane/cluster/visuals.h"
#include "control_plane/testing/state_rig.h"

namespace tessera::control {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr char kNoRecord[] = "\xff\xff";

class SetAsideTest : public ::testing::Test {
 protected:
  void Spoil(const std::string& key) {
    ASSERT_TRUE(rig_.store.Put(key, kNoRecord, rig_.store.Get(key)->revision).ok());
  }
  void Reload(bool drop = false) {
    auto state = ClusterState::Load(rig_.store, drop);
    ASSERT_TRUE(state.ok()) << state.status();
    rig_.state = *std::move(state);
  }
  std::vector<StoreEntry> Kept() const { return *rig_.store.List(kSetAside); }
  void End(const std::string& id) {
    InstanceEntry& instance = *rig_.state->FindInstance(id);
    records::Instance next = instance.record;
    next.set_state(v1::INSTANCE_STATE_ENDED);
    ASSERT_TRUE(rig_.state->StoreInstance(instance, next).ok());
  }

  StateRig rig_;
  HostEntry& alpha_ = rig_.AddHost("alpha");
  const std::string first_ = rig_.AddRunning({&alpha_}).record.id(), second_ = rig_.AddRunning({&alpha_}).record.id();
};

TEST_F(SetAsideTest, TheOthersAreThereAndTheRawRecordStaysUnderANameOfItsOwn) {
  Spoil(InstanceKey(1));
  Reload();
  EXPECT_EQ(rig_.state->FindInstance(first_), nullptr);
  EXPECT_NE(rig_.state->FindInstance(second_), nullptr);
  EXPECT_THAT(rig_.state->set_aside(), ElementsAre("instance/1"));
  ASSERT_EQ(Kept().size(), 1u);
  EXPECT_EQ(Kept().front().key, "unreadable/2/instance/1");
  EXPECT_EQ(Kept().front().value, kNoRecord);
  EXPECT_TRUE(absl::IsNotFound(rig_.store.Get(InstanceKey(1)).status()));
  EXPECT_EQ(Summarise(*rig_.state).records_set_aside, 1u);
  const auto& log = rig_.state->effects().log;
  EXPECT_TRUE(std::any_of(log.begin(), log.end(), [](const LogLine& line) {
    return line.severity == Severity::kError && line.text.find("record set aside key=instance/1") != std::string::npos;
  }));
  EXPECT_TRUE(rig_.state->recovering()) << "its workers must not be ended before it is known that they run";
  EXPECT_TRUE(rig_.state->recovers_unreadable());
  EXPECT_EQ(rig_.AddHost("beta").record.id(), "host-2") << "and numbers go on";
}

TEST_F(SetAsideTest, ItIsKnownInTheNextLifeTooUntilItIsDropped) {
  Spoil(InstanceKey(1));
  Reload();
  ASSERT_TRUE(rig_.state->EndRecovery().ok());
  Reload();
  EXPECT_THAT(rig_.state->set_aside(), ElementsAre("instance/1"));
  EXPECT_FALSE(rig_.state->recovering()) << "what runs was taken up before";
  Reload(true);
  EXPECT_THAT(rig_.state->set_aside(), IsEmpty());
  EXPECT_THAT(Kept(), IsEmpty());
}

TEST_F(SetAsideTest, AMapThatIsNoneMakesARecordUnreadable) {
  records::Instance record = rig_.state->FindInstance(first_)->record;
  record.clear_map();
  ASSERT_TRUE(
      rig_.store.Put(InstanceKey(1), record.SerializeAsString(), rig_.store.Get(InstanceKey(1))->revision).ok());
  Reload();
  EXPECT_TRUE(rig_.state->IsSetAside("instance/1"));
}

TEST_F(SetAsideTest, ASceneThatItMayUseStaysAndCanBeUsedAgain) {
  const std::string scene = SceneKey(rig_.state->FindInstance(second_)->record.scene_hash());
  Spoil(InstanceKey(1));
  Reload();
  End(second_);
  EXPECT_TRUE(rig_.store.Get(scene).ok()) << "the one that is set aside may use it";
  EXPECT_FALSE(rig_.state->ContentInUse(scene));
  Reload();
  const std::string third = rig_.AddRunning({&*rig_.state->EachHost().begin()}).record.id();
  EXPECT_TRUE(rig_.state->ContentInUse(scene)) << "it was there already";
  Reload(true);
  End(third);
  EXPECT_FALSE(rig_.store.Get(scene).ok()) << "nothing may need it any more";
}

// Its worlds run on, and what is left of it stays.
TEST_F(SetAsideTest, ASceneThatLacksAPieceGoesAloneAndTheNextWorldStoresItAnew) {
  const std::string hash = rig_.state->FindInstance(first_)->record.scene_hash();
  const ScenePieces pieces{.version = "01", .bytes = 10};
  const std::string piece = ScenePieceKeys(hash, pieces).front();
  ASSERT_TRUE(rig_.store.Put(piece, "not all", kAbsent).ok());
  ASSERT_TRUE(rig_.store.Put(SceneKey(hash), SceneRecord(pieces), rig_.store.Get(SceneKey(hash))->revision).ok());
  Reload();
  EXPECT_THAT(rig_.state->set_aside(), ElementsAre(SceneKey(hash)));
  EXPECT_NE(rig_.state->FindInstance(first_), nullptr);
  EXPECT_FALSE(rig_.state->recovering());
  EXPECT_FALSE(rig_.state->ContentInUse(SceneKey(hash)));
  EXPECT_FALSE(rig_.state->HoldScene(hash));
  Reload();
  EXPECT_THAT(rig_.state->effects().scene_pieces, IsEmpty());
  const std::string third = rig_.AddRunning({&*rig_.state->EachHost().begin()}).record.id();
  EXPECT_TRUE(rig_.state->ContentInUse(SceneKey(hash)));
  EXPECT_EQ(rig_.store.Get(SceneKey(hash))->value, "scene");
  Reload(true);
  EXPECT_THAT(rig_.state->effects().scene_pieces, ElementsAre(piece));
  for (const std::string& id : {first_, second_, third}) End(id);
  EXPECT_TRUE(absl::IsNotFound(rig_.store.Get(SceneKey(hash)).status()));
}

TEST_F(SetAsideTest, ARestoreBringsBackTheSceneThatWasLost) {
  const std::string key = SceneKey(rig_.state->FindInstance(first_)->record.scene_hash());
  ASSERT_TRUE(rig_.store.Put(key, SceneRecord({.version = "01", .bytes = 10}), rig_.store.Get(key)->revision).ok());
  Reload();
  ASSERT_FALSE(rig_.state->ContentInUse(key));
  InstanceEntry& instance = *rig_.state->FindInstance(first_);
  ASSERT_TRUE(rig_.state->StoreInstance(instance, instance.record, {.scene = "scene", .game = {}}).ok());
  EXPECT_TRUE(rig_.state->ContentInUse(key));
  EXPECT_EQ(rig_.store.Get(key)->value, "scene");
}

TEST_F(SetAsideTest, WorldsWhoseSceneIsLostCanEnd) {
  const std::string hash = rig_.state->FindInstance(first_)->record.scene_hash();
  ASSERT_TRUE(
      rig_.store
          .Put(SceneKey(hash), SceneRecord({.version = "01", .bytes = 10}), rig_.store.Get(SceneKey(hash))->revision)
          .ok());
  Reload();
  Reload(true);
  for (const std::string& id : {first_, second_}) End(id);
  EXPECT_FALSE(rig_.state->ContentInUse(SceneKey(hash)));
}

TEST_F(SetAsideTest, FilesOfMeshesStayWhileARecordThatMayNeedThemCannotBeRead) {
  Visuals visuals(*rig_.state, 1000, std::chrono::milliseconds(0));
  const std::string sha256(64, 'a');
  ASSERT_TRUE(visuals.Begin(sha256, 10).ok());
  ASSERT_TRUE(visuals.Finish(sha256).ok());
  ASSERT_TRUE(rig_.store.Put("token/ann", kNoRecord, kAbsent).ok());
  ASSERT_TRUE(rig_.state->SetAside(*rig_.store.Get("token/ann")).ok());
  rig_.Pass(std::chrono::seconds(10));
  visuals.Sweep(rig_.now);
  EXPECT_EQ(visuals.SizeOf(sha256), 10u);
}

TEST_F(SetAsideTest, ABucketOfPlayersGoesAloneAndItsPlaceCanBeWrittenAgain) {
  ASSERT_TRUE(rig_.store.Put(PlayersKey(1, 7), kNoRecord, kAbsent).ok());
  ASSERT_TRUE(rig_.store.Put("players/1/no_number", "", kAbsent).ok());
  Reload();
  EXPECT_THAT(rig_.state->set_aside(), ElementsAre(PlayersKey(1, 7), "players/1/no_number"));
  EXPECT_TRUE(rig_.state->LacksPlayers(1));
  EXPECT_FALSE(rig_.state->LacksPlayers(2));
  InstanceEntry& instance = *rig_.state->FindInstance(first_);
  Players players;
  records::StoredPlayer ann;
  ann.mutable_player()->set_number(7);
  players.Put(std::move(ann));
  EXPECT_TRUE(rig_.state->StoreWithPlayers(instance, instance.record, players).ok());
}

TEST_F(SetAsideTest, AHostIsNotTakenForOneThatWasRemoved) {
  Spoil(HostKey(1));
  Reload();
  EXPECT_EQ(rig_.state->FindHost("host-1"), nullptr);
  EXPECT_FALSE(rig_.state->WasHost(1)) << "its agent would end what it runs";
  EXPECT_TRUE(rig_.state->FindInstance(first_)->workers[0].evicted) << "others carry its regions on";
}

TEST_F(SetAsideTest, CountersThatCannotBeReadStopTheStart) {
  Spoil(kCountersKey);
  const auto state = ClusterState::Load(rig_.store);
  EXPECT_EQ(state.status().code(), absl::StatusCode::kDataLoss) << "ids would be given twice";
  EXPECT_THAT(std::string(state.status().message()), HasSubstr("counters"));
}

TEST_F(SetAsideTest, NothingIsMovedThatCannotBeWritten) {
  Spoil(InstanceKey(1));
  rig_.store.FailNext(1);
  EXPECT_FALSE(ClusterState::Load(rig_.store).ok());
  EXPECT_TRUE(rig_.store.Get(InstanceKey(1)).ok());
}

}  // namespace
}  // namespace tessera::control
