#include "control_plane/cluster/cluster_state.h"

#include <gmock/gmock.h>

#include "control_plane/cluster/instance_checkpoints.h"
#include "control_plane/cluster/queries.h"
#include "control_plane/testing/state_rig.h"

namespace tessera::control {
namespace {

using ::testing::ElementsAre;
using ::testing::Pair;

TEST(ClusterStateTest, AnotherLifeFindsEverythingAgainAndGivesNothingTwice) {
  StateRig rig;
  HostEntry& alpha = rig.AddHost("alpha");
  rig.AddRunning({&alpha, &alpha});
  const std::uint64_t revision = rig.state->NextRevision();
  rig.state = *ClusterState::Load(rig.store);
  const InstanceEntry* again = rig.state->FindInstance("inst-1");
  ASSERT_NE(again, nullptr);
  EXPECT_EQ(again->workers.size(), 2U);
  EXPECT_EQ(HostAt(*rig.state, *again, 1)->record.name(), "alpha");
  EXPECT_THAT(rig.state->FindHost("host-1")->workers, ElementsAre(Pair(1, 0), Pair(1, 1)));
  EXPECT_TRUE(rig.state->ContentInUse(SceneKey(again->record.scene_hash())));
  EXPECT_GT(rig.state->NextRevision(), revision);
  EXPECT_EQ(rig.AddHost("beta").record.id(), "host-2");
}

TEST(ClusterStateTest, MemoryFollowsTheStoreAndNeverTheOtherWayRound) {
  StateRig rig;
  HostEntry& alpha = rig.AddHost("alpha");
  InstanceEntry& instance = rig.AddRunning({&alpha, &alpha});
  records::Instance next = instance.record;
  next.mutable_placements()->RemoveLast();
  next.mutable_map()->set_version(2);
  rig.store.FailNext(1);
  EXPECT_EQ(rig.state->StoreInstance(instance, next).code(), absl::StatusCode::kUnavailable);
  EXPECT_EQ(instance.record.placements_size(), 2);
  EXPECT_EQ(alpha.workers.size(), 2U);
  ASSERT_TRUE(rig.state->StoreInstance(instance, next).ok());
  EXPECT_EQ(instance.workers.size(), 1U) << "workers follow their placements";
  EXPECT_EQ(alpha.workers.size(), 1U);
  EXPECT_TRUE(alpha.desired_changed);
}

TEST(ClusterStateTest, AStoreThatFailsIsAskedOnceASecondWhetherItCanBeWrittenAgain) {
  StateRig rig;
  HostEntry& alpha = rig.AddHost("alpha");
  rig.state->effects().log.clear();
  rig.store.FailNext(2);
  EXPECT_FALSE(rig.state->StoreHost(alpha, alpha.record).ok());
  EXPECT_NE(rig.state->store_trouble(), "");
  ASSERT_EQ(rig.state->effects().log.size(), 1U);
  EXPECT_EQ(rig.state->effects().log[0].severity, Severity::kError);

  rig.state->ProbeStore(rig.now);
  EXPECT_EQ(rig.state->failed_writes(), 1U) << "a second has not passed";
  rig.Pass(std::chrono::seconds(1));
  rig.state->ProbeStore(rig.now);
  EXPECT_EQ(rig.state->failed_writes(), 2U);
  rig.Pass(std::chrono::seconds(1));
  rig.state->ProbeStore(rig.now);
  EXPECT_EQ(rig.state->store_trouble(), "");
  EXPECT_EQ(rig.state->effects().log.size(), 2U) << "once each: that it fails, and that it works again";
  EXPECT_EQ(rig.AddHost("beta").record.id(), "host-2") << "the probe has kept the counters";
}

TEST(ClusterStateTest, WhatIsKnownOfAWorkerStaysWhilePlacementsChangeAroundIt) {
  StateRig rig;
  HostEntry& alpha = rig.AddHost("alpha");
  InstanceEntry& instance = rig.AddRunning({&alpha, &alpha, &alpha});
  StateRig::WorkerOf(instance, 3).report.set_tick(77);
  records::Instance next = instance.record;
  next.mutable_placements()->DeleteSubrange(0, 1);
  next.mutable_map()->set_version(2);
  ASSERT_TRUE(rig.state->StoreInstance(instance, next).ok());
  ASSERT_EQ(instance.workers.size(), 2U);
  EXPECT_EQ(instance.workers[1].region, 3U);
  EXPECT_EQ(instance.workers[1].report.tick(), 77U);
}

records::StoredPlayer KnownPlayer(std::uint32_t number, const std::string& name) {
  records::StoredPlayer known;
  known.mutable_player()->set_number(number);
  known.mutable_player()->set_name(name);
  return known;
}

TEST(ClusterStateTest, OfThePlayersOnlyTheBucketsThatChangedAreWritten) {
  StateRig rig;
  HostEntry& alpha = rig.AddHost("alpha");
  InstanceEntry& instance = rig.AddRunning({&alpha});
  Players players;
  for (std::uint32_t number = 1; number <= 200; ++number) players.Put(KnownPlayer(number, "ann"));
  ASSERT_TRUE(rig.state->StoreWithPlayers(instance, instance.record, players).ok());
  EXPECT_EQ(rig.store.List("players/1/")->size(), Players::kBuckets);
  const Revision before = rig.store.Get(PlayersKey(1, 8))->revision;
  players.Put(KnownPlayer(7, "bob"));
  rig.store.FailNext(1);
  EXPECT_EQ(rig.state->StoreWithPlayers(instance, instance.record, players).code(), absl::StatusCode::kUnavailable);
  EXPECT_EQ(instance.players.Find(7)->player().name(), "ann") << "memory follows the store";
  ASSERT_TRUE(rig.state->StoreWithPlayers(instance, instance.record, players).ok());
  EXPECT_EQ(rig.store.Get(PlayersKey(1, 8))->revision, before);
  EXPECT_GT(rig.store.Get(PlayersKey(1, 7))->revision, before);

  auto again = ClusterState::Load(rig.store);
  ASSERT_TRUE(again.ok()) << again.status();
  InstanceEntry& loaded = (*again)->instance(1);
  EXPECT_TRUE(loaded.players.ChangesSince(players).empty());
  Players fewer = loaded.players;
  for (std::uint32_t number = 64; number <= 192; number += 64) fewer.Erase(number);
  ASSERT_TRUE((*again)->StoreWithPlayers(loaded, loaded.record, fewer).ok());
  EXPECT_EQ(rig.store.List("players/1/")->size(), Players::kBuckets - 1) << "an empty one is not stored";
  ASSERT_TRUE((*again)->RemoveInstance(loaded).ok());
  EXPECT_TRUE(rig.store.List("players/")->empty());
}

TEST(ClusterStateTest, PlayersOfAnEarlierReleaseAreTakenOutOfTheRecord) {
  StateRig rig;
  HostEntry& alpha = rig.AddHost("alpha");
  InstanceEntry& instance = rig.AddRunning({&alpha});
  records::Instance old = instance.record;
  for (const std::uint32_t number : {3, 5}) old.add_players()->set_number(number);
  old.add_unseen_players(5);
  ASSERT_TRUE(rig.store.Put(InstanceKey(1), old.SerializeAsString(), instance.revision).ok());
  for (int life = 0; life < 2; ++life) {
    auto again = ClusterState::Load(rig.store);
    ASSERT_TRUE(again.ok()) << again.status();
    const InstanceEntry& loaded = (*again)->instance(1);
    ASSERT_EQ(loaded.players.size(), 2U);
    EXPECT_FALSE(loaded.players.Find(3)->unseen());
    EXPECT_TRUE(loaded.players.Find(5)->unseen());
    EXPECT_TRUE(loaded.record.players().empty());
  }
}

TEST(ClusterStateTest, ASceneGoesWithTheLastInstanceThatUsesIt) {
  StateRig rig;
  HostEntry& alpha = rig.AddHost("alpha");
  InstanceEntry &first = rig.AddRunning({&alpha}), &second = rig.AddRunning({&alpha});
  const auto end = [&](InstanceEntry& instance) {
    records::Instance next = instance.record;
    next.set_state(v1::INSTANCE_STATE_ENDED);
    ASSERT_TRUE(rig.state->StoreInstance(instance, next).ok());
  };
  end(first);
  EXPECT_EQ(rig.store.List("scene/")->size(), 1U);
  end(second);
  EXPECT_TRUE(rig.store.List("scene/")->empty());
  EXPECT_FALSE(rig.state->ContentInUse(SceneKey(first.record.scene_hash())));
}

TEST(ClusterStateTest, ANativeGameHasNoFileInTheStore) {
  StateRig rig;
  records::Instance record = rig.AddRunning({&rig.AddHost("alpha")}).record;
  record.set_game_name("arena");
  record.set_game_hash("feed");
  record.set_game_native(true);
  ASSERT_TRUE(rig.state->AddInstance(record, {"scene", ""}).ok());
  EXPECT_TRUE(rig.store.List("game/")->empty());
  EXPECT_TRUE(ClusterState::Load(rig.store).ok());
}

TEST(ClusterStateTest, AGameIsStoredOnceSurvivesAnotherLifeAndGoesWithTheLastInstanceThatRunsIt) {
  StateRig rig;
  HostEntry& alpha = rig.AddHost("alpha");
  const records::Instance like = rig.AddRunning({&alpha}).record;
  const auto add = [&] {
    records::Instance record = like;
    record.set_game_name("game.lua");
    record.set_game_hash("feed");
    return (*rig.state->AddInstance(record, {"scene", "x = 1"}))->record.id();
  };
  const auto end = [&](const std::string& id) {
    InstanceEntry& instance = *rig.state->FindInstance(id);
    records::Instance next = instance.record;
    next.set_state(v1::INSTANCE_STATE_ENDED);
    ASSERT_TRUE(rig.state->StoreInstance(instance, next).ok());
  };
  const std::string first = add(), second = add();
  ASSERT_EQ(rig.store.List("game/")->size(), 1U);
  EXPECT_EQ(rig.store.Get(GameKey("feed"))->value, "x = 1");
  rig.state = *ClusterState::Load(rig.store);
  EXPECT_EQ(rig.state->FindInstance(first)->record.game_name(), "game.lua");
  end(first);
  EXPECT_TRUE(rig.state->ContentInUse(GameKey("feed")));
  end(second);
  EXPECT_FALSE(rig.state->ContentInUse(GameKey("feed")));
  EXPECT_TRUE(rig.store.List("game/")->empty());
  EXPECT_TRUE(rig.state->ContentInUse(SceneKey(like.scene_hash()))) << "another instance uses the scene";

  InstanceEntry& again = *rig.state->FindInstance(second);  // as a restoration does
  ASSERT_TRUE(rig.state->ReuseContents(again.record, {"scene", "x = 1"}).ok());
  EXPECT_EQ(rig.store.Get(GameKey("feed"))->value, "x = 1");
}

TEST(ClusterStateTest, TheLatestStreamOfAHostCounts) {
  StateRig rig;
  HostEntry& alpha = rig.AddHost("alpha");
  const StreamId first = rig.state->OpenStream(alpha, absl::AbortedError("another"));
  const StreamId second = rig.state->OpenStream(alpha, absl::AbortedError("another"));
  EXPECT_EQ(rig.state->HostOf(first), nullptr);
  EXPECT_EQ(rig.state->HostOf(second), &alpha);
  EXPECT_THAT(rig.state->effects().closed, ElementsAre(Pair(first, absl::AbortedError("another"))));
}

TEST(ClusterStateTest, AnIdHasOneSpelling) {
  StateRig rig;
  rig.AddHost("alpha");
  EXPECT_NE(rig.state->FindHost("host-1"), nullptr);
  for (const char* id : {"host-01", "host-+1", "host-1 ", "inst-1", "host-2", ""}) {
    EXPECT_EQ(rig.state->FindHost(id), nullptr) << id;
  }
}

TEST(ClusterStateTest, AGameThatIsToBeNextIsStoredWithTheRecordThatNamesItAndGoesWithTheLastOne) {
  StateRig rig;
  HostEntry& alpha = rig.AddHost("alpha");
  InstanceEntry& instance = rig.AddRunning({&alpha});
  const auto names = [&](const char* running, const char* next_game, const char* previous) {
    records::Instance next = instance.record;
    next.set_game_hash(running);
    next.clear_games();
    if (*next_game != 0) next.mutable_games()->mutable_next()->set_hash(next_game);
    if (*previous != 0) next.mutable_games()->mutable_previous()->set_hash(previous);
    return next;
  };
  const auto stored = [&] {
    std::vector<std::string> keys;
    const auto entries = rig.store.List("game/");
    for (const StoreEntry& entry : *entries) keys.push_back(entry.key + "=" + entry.value);
    return keys;
  };
  ASSERT_TRUE(rig.state->StoreInstance(instance, names("a", "", ""), {"", "one"}).ok());
  ASSERT_TRUE(rig.state->StoreInstance(instance, names("a", "b", ""), {"", "two"}).ok());
  EXPECT_EQ(stored(), (std::vector<std::string>{"game/a=one", "game/b=two"}));
  ASSERT_TRUE(rig.state->StoreInstance(instance, names("b", "", "a")).ok());
  EXPECT_EQ(stored().size(), 2U) << "a checkpoint of before may still be completed";
  rig.state = *ClusterState::Load(rig.store);
  InstanceEntry& again = *rig.state->FindInstance("inst-1");
  records::Instance next = again.record;
  next.mutable_games()->mutable_next()->set_hash("a");  // the one before again
  ASSERT_TRUE(rig.state->StoreInstance(again, next).ok());
  EXPECT_EQ(stored().size(), 2U);
  next.clear_games();
  ASSERT_TRUE(rig.state->StoreInstance(again, next).ok());
  EXPECT_EQ(stored(), (std::vector<std::string>{"game/b=two"}));
  next.set_state(v1::INSTANCE_STATE_ENDED);
  ASSERT_TRUE(rig.state->StoreInstance(again, next).ok());
  EXPECT_TRUE(stored().empty());
}

TEST(ClusterStateTest, WithoutRoomNoCheckpointIsBegunAndThatIsSaidOnce) {
  StateRig rig;
  HostEntry &alpha = rig.AddHost("alpha"), &beta = rig.AddHost("beta");
  InstanceEntry& world = rig.AddRunning({&alpha, &beta});
  InstanceCheckpoints checkpoints(*rig.state);
  rig.state->effects() = {};
  rig.state->SetCheckpointTrouble("the disk is full");
  rig.state->SetCheckpointTrouble("the disk is full");
  const auto refused = checkpoints.Begin(world, rig.now);
  EXPECT_EQ(refused.status().code(), absl::StatusCode::kResourceExhausted);
  EXPECT_EQ(checkpoints.UnderWay(world), 0u);
  EXPECT_TRUE(Summarise(*rig.state).checkpoints_stopped);
  const Effects said = std::exchange(rig.state->effects(), {});
  ASSERT_EQ(said.log.size(), 1u);
  EXPECT_EQ(said.log[0].severity, Severity::kError);
  rig.state->SetCheckpointTrouble("");
  EXPECT_TRUE(checkpoints.Begin(world, rig.now).ok());
  EXPECT_FALSE(Summarise(*rig.state).checkpoints_stopped);
}

}  // namespace
}  // namespace tessera::control
