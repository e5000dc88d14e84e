// Checkpoints of a running world: when they are made, and worlds that come back from them.
#include <gmock/gmock.h>

#include <algorithm>
#include <vector>

#include "absl/strings/str_cat.h"
#include "control_plane/branches.h"
#include "control_plane/cluster/queries.h"
#include "control_plane/testing/cluster_harness.h"

namespace tessera::control {
namespace {

using std::chrono::seconds;
using ::testing::AllOf;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;
using ::testing::StartsWith;

// Those of the log since the last round of messages.
std::vector<std::string> ErrorsOf(ClusterHarness& harness) {
  std::vector<std::string> errors;
  for (const LogLine& line : harness.cluster().TakeEffects().log) {
    if (line.severity == Severity::kError) errors.push_back(line.text);
  }
  return errors;
}

struct CheckpointedWorld {
  explicit CheckpointedWorld(std::int64_t interval_ms, std::uint32_t players = 0) {
    harness.AddHost("alpha", 4);
    harness.AddHost("beta", 4);
    InstancePlan plan = TestPlan(4, players);
    plan.checkpoint_interval = std::chrono::milliseconds(interval_ms);
    plan.keep_checkpoints = 2;
    id = harness.cluster().CreateInstance(harness.now, plan, false)->id();
    for (std::uint32_t i = 0; i < players; ++i) {
      EXPECT_TRUE(harness.cluster().Join(harness.now, JoinRequest(id, absl::StrCat("player ", i))).ok());
    }
    harness.Run(seconds(1));
    EXPECT_EQ(harness.Get(id).state(), v1::INSTANCE_STATE_RUNNING);
  }
  // All regions' files come; false if none was asked for.
  bool Upload() {
    const std::uint64_t tick = harness.cluster().CheckpointUnderWay(id);
    if (tick == 0) return false;
    std::optional<records::Manifest> done;
    for (auto& [name, agent] : harness.agents) {
      for (auto& [key, worker] : agent.fake.workers) {
        EXPECT_EQ(worker.order.checkpoint().tick(), tick);
        const v1::UploadCheckpointRequest request = UploadOf(agent, worker, tick);
        EXPECT_FALSE(done);
        EXPECT_TRUE(harness.cluster().CheckUpload(harness.now, request).ok());
        done = harness.cluster().NoteUploaded(request);
      }
    }
    EXPECT_TRUE(done.has_value());
    last = *done;
    made.push_back(last);
    harness.cluster().NoteCheckpoint(harness.now, id, last, 1000);
    return true;
  }
  void MakeOne() {
    EXPECT_TRUE(harness.cluster().BeginCheckpoint(harness.now, id).ok());
    harness.Pump();
    EXPECT_TRUE(Upload());
  }
  // As the control plane does when it is told to: from the newest one that may be taken. Its tick; 0: there is none.
  std::uint64_t RestoreIt() {
    const auto before = harness.cluster().RestoreWantedBefore(id);
    EXPECT_TRUE(before.has_value());
    const v1::Instance instance = harness.Get(id);
    const v1::Checkpoint* newest = NewestKeptBefore(instance.checkpoints(), before.value_or(0));
    if (!before || newest == nullptr) return 0;
    const auto manifest = std::find_if(made.begin(), made.end(), [&](const records::Manifest& candidate) {
      return candidate.tick() == newest->tick();
    });
    const auto restored = harness.cluster().Restore(harness.now, id, *manifest, {"scene", ""}, false);
    EXPECT_TRUE(restored.ok()) << restored.status();
    return newest->tick();
  }
  static v1::UploadCheckpointRequest UploadOf(const FakeHost& agent, const FakeWorker& worker, std::uint64_t tick) {
    v1::UploadCheckpointRequest request;
    request.set_host_id(agent.host_id);
    request.set_host_secret(agent.secret);
    *request.mutable_identity() = worker.report.identity();
    request.set_tick(tick);
    request.set_hash("hash of " + std::to_string(request.identity().region()));
    return request;
  }
  void KillAll() {
    for (auto& [name, agent] : harness.agents) {
      while (!agent.fake.workers.empty()) harness.Send(agent, agent.fake.Kill(agent.fake.workers.begin()->first, 9));
    }
  }
  // Only a checkpoint that is whole is left.
  void LoseAllWithACheckpoint() {
    EXPECT_TRUE(harness.cluster().BeginCheckpoint(harness.now, id).ok());
    harness.Pump();
    EXPECT_TRUE(Upload());
    KillAll();
  }
  ClusterHarness harness;
  std::string id;
  records::Manifest last;
  std::vector<records::Manifest> made;
};

TEST(CheckpointTest, AreMadeAtTheirIntervalAndTheOldestGo) {
  CheckpointedWorld world(10'000);
  int made = 0;
  for (int i = 0; i < 45; ++i) {
    world.harness.Run(seconds(1));
    made += world.Upload();
  }
  EXPECT_EQ(made, 4);
  EXPECT_EQ(world.harness.Get(world.id).checkpoints_size(), 2);
}

TEST(CheckpointTest, OneThatDoesNotComeIsAbandonedAndTriedAgain) {
  CheckpointedWorld world(10'000);
  world.harness.Run(seconds(12));
  const std::uint64_t first = world.harness.cluster().CheckpointUnderWay(world.id);
  EXPECT_NE(first, 0u);
  world.harness.Run(seconds(40));
  const std::uint64_t second = world.harness.cluster().CheckpointUnderWay(world.id);
  EXPECT_GT(second, first);
  EXPECT_TRUE(world.Upload());
}

// The failover's map has a region less: with the files of the others it would count as whole.
TEST(CheckpointTest, OneIsNotMadeWholeByADeath) {
  CheckpointedWorld world(0);
  ClusterHarness& harness = world.harness;
  ASSERT_TRUE(harness.cluster().BeginCheckpoint(harness.now, world.id).ok());
  harness.Pump();
  const std::uint64_t tick = harness.cluster().CheckpointUnderWay(world.id);
  std::vector<v1::UploadCheckpointRequest> uploads;
  uploads.reserve(4);
  for (auto& [name, agent] : harness.agents) {
    for (auto& [key, worker] : agent.fake.workers) uploads.push_back(CheckpointedWorld::UploadOf(agent, worker, tick));
  }
  ASSERT_EQ(uploads.size(), 4u);
  for (std::size_t i = 0; i < 3; ++i) {
    ASSERT_TRUE(harness.cluster().CheckUpload(harness.now, uploads[i]).ok());
    ASSERT_FALSE(harness.cluster().NoteUploaded(uploads[i]).has_value());
  }
  auto& agent = harness.AgentOf(world.id, uploads[0].identity().region());
  harness.Send(agent, agent.fake.Kill({world.id, uploads[0].identity().region()}, 9));
  EXPECT_EQ(harness.cluster().CheckUpload(harness.now, uploads[3]).code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_FALSE(harness.cluster().NoteUploaded(uploads[3]).has_value());
  harness.Run(seconds(5));
  EXPECT_EQ(harness.Get(world.id).checkpoints_size(), 0);
}

TEST(CheckpointTest, AFileThatNobodyWaitsForIsRefused) {
  CheckpointedWorld world(0);
  auto& agent = world.harness.agents["alpha"];
  v1::UploadCheckpointRequest request;
  EXPECT_EQ(world.harness.cluster().CheckUpload(world.harness.now, request).code(), absl::StatusCode::kUnauthenticated);
  request.set_host_id(agent.host_id);
  request.set_host_secret(agent.secret);
  request.set_tick(5);
  EXPECT_EQ(world.harness.cluster().CheckUpload(world.harness.now, request).code(),
            absl::StatusCode::kFailedPrecondition);
}

TEST(CheckpointTest, ARegionAndItsStandbyLostTogetherComeBackWithALossOfTime) {
  CheckpointedWorld world(0);
  ClusterHarness& harness = world.harness;
  ASSERT_TRUE(harness.cluster().BeginCheckpoint(harness.now, world.id).ok());
  harness.Pump();
  ASSERT_TRUE(world.Upload());
  harness.Run(seconds(10));
  world.KillAll();
  EXPECT_EQ(harness.cluster().TakeEffects().restore.count(world.id), 1u);
  const auto restored = harness.cluster().Restore(harness.now, world.id, world.last, {"scene", ""}, false);
  ASSERT_TRUE(restored.ok()) << restored.status();
  const std::vector<std::string> errors = ErrorsOf(harness);
  ASSERT_THAT(errors, SizeIs(1)) << "whoever looks for errors finds it";
  EXPECT_THAT(errors[0], StartsWith("time lost id=" + world.id + ": restored from the checkpoint of tick "));
  EXPECT_THAT(errors[0], HasSubstr(" ticks lost: "));
  harness.Run(seconds(2));
  const v1::Instance instance = harness.Get(world.id);
  EXPECT_EQ(instance.state(), v1::INSTANCE_STATE_RUNNING) << instance.reason();
  EXPECT_GT(instance.lost_ticks(), 0u);
  EXPECT_TRUE(instance.has_lost_time());
  EXPECT_THAT(instance.events(instance.events_size() - 1).text(),
              HasSubstr("restored from the checkpoint of tick " + std::to_string(world.last.tick())));
  EXPECT_EQ(harness.Workers(), 4u);
  for (auto& [name, agent] : harness.agents) {
    for (auto& [key, worker] : agent.fake.workers) {
      EXPECT_EQ(worker.order.initial_state().tick(), world.last.tick());
      EXPECT_EQ(worker.order.initial_state().hash(), "hash of " + std::to_string(key.second));
    }
  }
}

// After all machines were off there may be nobody who knows how far the world was.
TEST(CheckpointTest, ALossOfWhichNobodyKnowsTheExtentIsAnErrorAndHasItsTime) {
  CheckpointedWorld world(0);
  ClusterHarness& harness = world.harness;
  world.MakeOne();
  harness.Run(seconds(10));
  harness.Restart();
  for (auto& [name, agent] : harness.agents) {
    for (auto& [key, worker] : agent.fake.workers) worker.report.clear_tick();
    harness.Attach(agent);
  }
  world.KillAll();
  ASSERT_EQ(world.RestoreIt(), world.last.tick()) << harness.Get(world.id).reason();
  EXPECT_THAT(ErrorsOf(harness), Contains(AllOf(StartsWith("time lost id=" + world.id),
                                                HasSubstr("nobody knows how many ticks are lost"))));
  const v1::Instance instance = harness.Get(world.id);
  EXPECT_EQ(instance.lost_ticks(), 0U);
  EXPECT_TRUE(instance.lost_ticks_at_least());
  harness.Run(seconds(2));
  const ClusterSummary summary = Summarise(harness.cluster().state());
  ASSERT_THAT(summary.health, SizeIs(1));
  EXPECT_GT(summary.health[0].last_loss.count(), 0);
}

TEST(CheckpointTest, ALossThatSomebodyAskedForIsNoError) {
  CheckpointedWorld world(0);
  ClusterHarness& harness = world.harness;
  EXPECT_EQ(Summarise(harness.cluster().state()).health.at(0).last_loss.count(), 0);
  world.MakeOne();
  harness.Run(seconds(10));
  ASSERT_TRUE(harness.cluster().Restore(harness.now, world.id, world.last, {"scene", ""}, false).ok());
  EXPECT_THAT(ErrorsOf(harness), IsEmpty());
  EXPECT_GT(harness.Get(world.id).lost_ticks(), 0U);
}

TEST(CheckpointTest, AWorldWhoseSilentHostsAreRemovedBeginsAgainElsewhereAndNotBefore) {
  CheckpointedWorld world(0);
  ClusterHarness& harness = world.harness;
  world.MakeOne();
  for (auto& [name, agent] : harness.agents) agent.silent = true;
  harness.Run(seconds(120));
  EXPECT_FALSE(harness.cluster().RestoreWantedBefore(world.id)) << "both may run on, where nobody hears them";
  EXPECT_THAT(harness.Get(world.id).reason(), HasSubstr("tessera host remove HOST --force"));
  harness.AddHost("gamma", 8);
  for (const char* name : {"alpha", "beta"}) {
    v1::RemoveHostRequest remove;
    remove.set_name(name);
    remove.set_force(true);
    ASSERT_TRUE(harness.cluster().RemoveHost(harness.now, remove).ok());
  }
  ASSERT_EQ(world.RestoreIt(), world.last.tick());
  harness.Run(seconds(2));
  EXPECT_EQ(harness.Get(world.id).state(), v1::INSTANCE_STATE_RUNNING) << harness.Get(world.id).reason();
  EXPECT_EQ(harness.agents.at("gamma").fake.workers.size(), 4u);
}

TEST(CheckpointTest, ARestoreThatCouldNotBeMadeIsTriedAgain) {
  CheckpointedWorld world(0);
  ClusterHarness& harness = world.harness;
  world.LoseAllWithACheckpoint();
  EXPECT_TRUE(harness.cluster().TakeEffects().restore.contains(world.id));
  harness.cluster().HandleTimer(harness.now);
  EXPECT_FALSE(harness.cluster().TakeEffects().restore.contains(world.id)) << "not at once";
  harness.now.steady += seconds(6);
  harness.cluster().HandleTimer(harness.now);
  EXPECT_TRUE(harness.cluster().TakeEffects().restore.contains(world.id));
}

TEST(CheckpointTest, AWorldThatIsLostSoonAfterEachRestoreGoesBackFurtherAndThenStops) {
  CheckpointedWorld world(0);
  ClusterHarness& harness = world.harness;
  world.MakeOne();
  harness.Run(seconds(20));
  world.MakeOne();
  const std::uint64_t first = world.made[0].tick(), second = world.made[1].tick();
  harness.Run(seconds(20));
  for (const std::uint64_t from : {second, second, first, first}) {
    world.KillAll();
    ASSERT_EQ(world.RestoreIt(), from);
    harness.Run(seconds(2));
    ASSERT_EQ(harness.Get(world.id).state(), v1::INSTANCE_STATE_RUNNING) << harness.Get(world.id).reason();
  }
  world.KillAll();
  EXPECT_FALSE(harness.cluster().RestoreWantedBefore(world.id).has_value());
  const v1::Instance stopped = harness.Get(world.id);
  EXPECT_EQ(stopped.state(), v1::INSTANCE_STATE_FAILED);
  EXPECT_THAT(stopped.reason(), HasSubstr("it was lost 2 times soon after it had begun from the checkpoint of tick " +
                                          std::to_string(first) + ", and there is no older one"));
  EXPECT_THAT(stopped.reason(), HasSubstr("signal 9"));
}

TEST(CheckpointTest, AWorldThatRanForAWhileSinceARestoreBeginsFromTheNewestAgain) {
  CheckpointedWorld world(0);
  ClusterHarness& harness = world.harness;
  world.MakeOne();
  harness.Run(seconds(20));
  world.MakeOne();
  for (int lost = 0; lost < 5; ++lost) {
    world.KillAll();
    ASSERT_EQ(world.RestoreIt(), world.made[1].tick()) << lost;
    harness.Run(seconds(13));
    ASSERT_EQ(harness.Get(world.id).state(), v1::INSTANCE_STATE_RUNNING) << harness.Get(world.id).reason();
  }
}

TEST(CheckpointTest, AWorldThatCannotBeginAgainForWantOfAHostWaitsForOne) {
  CheckpointedWorld world(0);
  ClusterHarness& harness = world.harness;
  world.MakeOne();
  world.KillAll();
  harness.agents.at("beta").silent = true;
  ASSERT_EQ(world.RestoreIt(), world.last.tick());
  harness.Run(seconds(30));
  const v1::Instance waiting = harness.Get(world.id);
  EXPECT_EQ(waiting.state(), v1::INSTANCE_STATE_STARTING) << waiting.reason();
  ASSERT_EQ(waiting.changes_size(), 1);
  EXPECT_THAT(waiting.changes(0).text(), HasSubstr("is to begin again from a checkpoint: region "));
  EXPECT_THAT(waiting.changes(0).text(), HasSubstr("host beta was lost before the start"));
  harness.cluster().NoteRestoreWaits(world.id, "no room for 4 regions");
  EXPECT_THAT(harness.Get(world.id).changes(0).text(), HasSubstr("; waits: no room for 4 regions"));
  harness.agents.at("beta").silent = false;
  harness.Run(seconds(5));
  ASSERT_EQ(world.RestoreIt(), world.last.tick());
  harness.Run(seconds(3));
  EXPECT_EQ(harness.Get(world.id).state(), v1::INSTANCE_STATE_RUNNING) << harness.Get(world.id).reason();
  EXPECT_TRUE(harness.Get(world.id).changes().empty()) << harness.Get(world.id).changes(0).text();
}

TEST(CheckpointTest, AWorldThatBeginsAgainDoesNotWaitForItsPlayers) {
  CheckpointedWorld world(0, 2);
  ClusterHarness& harness = world.harness;
  world.MakeOne();
  world.KillAll();
  for (auto& [name, agent] : harness.agents) agent.fake.connect_players = false;
  ASSERT_EQ(world.RestoreIt(), world.last.tick());
  harness.Run(seconds(2));
  EXPECT_EQ(harness.Get(world.id).state(), v1::INSTANCE_STATE_RUNNING);
}

TEST(CheckpointTest, AWorldWhoseWorkersDieAsItBeginsAgainIsNoEndlessLoop) {
  CheckpointedWorld world(0);
  ClusterHarness& harness = world.harness;
  world.MakeOne();
  world.KillAll();
  for (auto& [name, agent] : harness.agents) agent.fake.exit_at_start = {1, 2, 3, 4};
  int restores = 0;
  while (harness.cluster().RestoreWantedBefore(world.id) && restores < 10) {
    ASSERT_NE(world.RestoreIt(), 0u);
    ++restores;
    harness.Run(seconds(2));
  }
  EXPECT_EQ(restores, 2);
  EXPECT_EQ(harness.Get(world.id).state(), v1::INSTANCE_STATE_FAILED);
  EXPECT_THAT(harness.Get(world.id).reason(), HasSubstr("there is no older one"));
}

TEST(CheckpointTest, OfAFailedInstanceTheyGoWhenItIsDeleted) {
  CheckpointedWorld world(0);
  ClusterHarness& harness = world.harness;
  world.LoseAllWithACheckpoint();
  harness.cluster().CannotRestore(harness.now, world.id, "no room");
  (void)harness.cluster().TakeEffects();
  v1::DeleteInstanceRequest request;
  request.set_id(world.id);
  ASSERT_TRUE(harness.cluster().DeleteInstance(harness.now, request).ok());
  EXPECT_EQ(harness.cluster().TakeEffects().pruned.size(), 1u);
  harness.now.steady += std::chrono::hours(2);
  harness.cluster().HandleTimer(harness.now);
  EXPECT_FALSE(StateOf(harness.cluster().state(), world.id).has_value());
}

TEST(CheckpointTest, WithoutAWholeOneTheInstanceFailsAndSaysWhy) {
  CheckpointedWorld world(0);
  ClusterHarness& harness = world.harness;
  world.LoseAllWithACheckpoint();
  harness.cluster().CannotRestore(harness.now, world.id, "region-1 is damaged");
  EXPECT_EQ(harness.Get(world.id).state(), v1::INSTANCE_STATE_FAILED);
  EXPECT_THAT(harness.Get(world.id).reason(), HasSubstr("region-1 is damaged"));
  harness.now.steady += std::chrono::hours(2);
  harness.cluster().HandleTimer(harness.now);
  ASSERT_TRUE(StateOf(harness.cluster().state(), world.id).has_value()) << "forgotten with its checkpoints";
  // An operator who finds a good one brings it back, scene and all.
  ASSERT_TRUE(harness.cluster().Restore(harness.now, world.id, world.last, {"scene", ""}, false).ok());
  harness.Run(seconds(2));
  EXPECT_EQ(harness.Get(world.id).state(), v1::INSTANCE_STATE_RUNNING);
  EXPECT_TRUE(harness.cluster().state().ContentInUse(SceneKey("0123")));
}

}  // namespace
}  // namespace tessera::control
