#include "region_worker/core/worker_core.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/world/partition_io.h"
#include "region_worker/testing/core_rig.h"
#include "region_worker/testing/regions.h"

namespace tessera::worker {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

// The worker of a region that is alone in its world, with this test as its agent.
class WorkerCoreTest : public ::testing::Test {
 protected:
  WorkerCoreTest() {
    order.set_revision(1);
    order.set_instance_id("instance");
    order.set_region(kSelf.value());
    order.set_incarnation(1);
    order.set_scene_path("scene.json");
    order.set_instance_key(std::string(net::kKeyBytes, 'k'));
    *order.mutable_map() = ToProto(*MakeGridMap(scene->ground(), 1));
  }
  // The newest order, as a new revision.
  Actions TakeOrder() {
    order.set_revision(order.revision() + 1);
    core.TakeOrder(order, now);
    return core.TakeActions();
  }
  Actions Load() {
    core.SceneLoaded(scene, now);
    return core.TakeActions();
  }
  void OrderGame(const std::string& content) {
    game = content;
    order.set_game_path("b.game");
    order.set_game_hash(game::GameHash(content));
    order.set_game_name("arena.lua");
  }
  Actions LoadGame() {
    core.GameLoaded(game, now);
    return core.TakeActions();
  }
  Actions Advance() {
    now += std::chrono::milliseconds(20);
    if (core.Advance(now)) {
      core.Step(now);
      core.StepEnded(now, {});
    }
    return core.TakeActions();
  }
  static v1::WorkerReport ReportIn(const Actions& actions) {
    const auto reports = AllOf<SendReport>(actions);
    return reports.empty() ? v1::WorkerReport() : reports.back().report;
  }

  const std::shared_ptr<const Scene> scene = WorldWithPlayers();
  v1::WorkerOrder order;
  std::string game;
  WorkerCore core{{{"instance", kSelf, Incarnation(1)}, 77, {}, {}, {}}};
  TimePoint now{std::chrono::hours(1)};
};

TEST_F(WorkerCoreTest, GoesFromLoadingToRunningByItsOrders) {
  EXPECT_THAT(AllOf<RequestScene>(TakeOrder()), SizeIs(1));
  EXPECT_THAT(AllOf<RequestScene>(TakeOrder()), IsEmpty()) << "it is asked for already";
  EXPECT_EQ(core.phase(), v1::WORKER_PHASE_LOADING);
  EXPECT_THAT(AllOf<OpenPorts>(Load()), SizeIs(1));
  EXPECT_EQ(core.phase(), v1::WORKER_PHASE_LINKED) << "there is nobody to link with";
  EXPECT_THAT(AllOf<PublishStep>(Advance()), IsEmpty());
  order.set_run(true);
  TakeOrder();
  EXPECT_EQ(core.phase(), v1::WORKER_PHASE_LINKED);
  EXPECT_THAT(AllOf<PublishStep>(Advance()), SizeIs(1));
  EXPECT_EQ(core.phase(), v1::WORKER_PHASE_RUNNING);
}

TEST_F(WorkerCoreTest, AnOrderForAnotherAndAnOlderOneAreNotFollowed) {
  order.set_incarnation(2);
  EXPECT_THAT(AllOf<RequestScene>(TakeOrder()), IsEmpty());
  order.set_incarnation(1);
  TakeOrder();
  order.set_stop(true);
  core.TakeOrder(order, now);  // the same revision
  EXPECT_FALSE(core.stopping());
}

TEST_F(WorkerCoreTest, AChangeOfStateIsReportedAtOnceAndOtherwiseFromTimeToTime) {
  TakeOrder();
  EXPECT_EQ(ReportIn(Advance()).phase(), v1::WORKER_PHASE_LOADING);
  EXPECT_THAT(AllOf<SendReport>(Advance()), IsEmpty());
  Load();
  EXPECT_EQ(ReportIn(Advance()).phase(), v1::WORKER_PHASE_LINKED);
  now += ReportGate::kInterval;
  EXPECT_THAT(AllOf<SendReport>(Advance()), SizeIs(1));
}

TEST_F(WorkerCoreTest, ASceneThatCannotBeReadEndsItWithAReason) {
  TakeOrder();
  core.SceneLoaded(absl::NotFoundError("scene.json: no such file"), now);
  EXPECT_TRUE(core.stopping());
  EXPECT_THAT(core.failure(), HasSubstr("no such file"));
  const v1::WorkerReport last = ReportIn(Advance());
  EXPECT_EQ(last.phase(), v1::WORKER_PHASE_STOPPING);
  EXPECT_EQ(last.failure(), core.failure());
}

TEST_F(WorkerCoreTest, AGameIsLoadedBeforeTheRegionBegins) {
  OrderGame("function on_tick() print('tick', world.tick()) end");
  EXPECT_THAT(AllOf<RequestGame>(TakeOrder()), IsEmpty()) << "the scene comes first";
  const Actions after_scene = Load();
  ASSERT_THAT(AllOf<RequestGame>(after_scene), SizeIs(1));
  EXPECT_EQ(AllOf<RequestGame>(after_scene)[0].path, "b.game");
  EXPECT_THAT(AllOf<OpenPorts>(after_scene), IsEmpty());
  order.set_run(true);
  TakeOrder();
  EXPECT_THAT(AllOf<OpenPorts>(LoadGame()), SizeIs(1));
  Advance();
  Advance();
  ASSERT_NE(core.run()->game(), nullptr);
  EXPECT_GT(core.run()->game()->statistics().calls, 0u);
  now += ReportGate::kInterval;
  const v1::WorkerReport report = ReportIn(Advance());
  ASSERT_FALSE(report.game_lines().empty());
  EXPECT_EQ(report.game_lines(0).text(), "tick 1");
}

// Else one line of a game would cut the worker off from its agent.
TEST_F(WorkerCoreTest, NoLineOfAGameMakesAReportThatCannotBeRead) {
  OrderGame("function on_tick() print('\\xFF\\xC3') error('\\xFF') end");
  order.set_run(true);
  TakeOrder();
  Load();
  LoadGame();
  Advance();
  Advance();
  now += ReportGate::kInterval;
  const v1::WorkerReport report = ReportIn(Advance());
  ASSERT_FALSE(report.game_lines().empty());
  EXPECT_TRUE(v1::WorkerReport().ParseFromString(report.SerializeAsString()));
}

TEST_F(WorkerCoreTest, AGameWaitsForItsFile) {
  OrderGame("x = 1");
  order.clear_game_path();
  EXPECT_THAT(AllOf<RequestScene>(TakeOrder()), IsEmpty());
  order.set_game_path("b.game");
  EXPECT_THAT(AllOf<RequestScene>(TakeOrder()), SizeIs(1));
}

TEST_F(WorkerCoreTest, AGameThatDoesNotLoadEndsItWithFileAndLine) {
  OrderGame("local n = 1\nfunction on_tick(\n");
  TakeOrder();
  Load();
  EXPECT_THAT(AllOf<OpenPorts>(LoadGame()), IsEmpty());
  EXPECT_TRUE(core.stopping());
  EXPECT_THAT(core.failure(), ::testing::StartsWith("arena.lua:3: "));
  EXPECT_EQ(ReportIn(Advance()).failure(), core.failure());
}

TEST_F(WorkerCoreTest, AGameThatIsNotTheOrderedOneIsAFailure) {
  OrderGame("x = 1");
  game = "x = 2";
  TakeOrder();
  Load();
  LoadGame();
  EXPECT_THAT(core.failure(), HasSubstr("game b.game: has hash " + game::GameHash("x = 2")));
}

TEST_F(WorkerCoreTest, AGameThatCannotBeReadOrIsTooLargeIsAFailure) {
  OrderGame(std::string(game::kMaxGameFileBytes + 1, ' '));
  TakeOrder();
  Load();
  LoadGame();
  EXPECT_THAT(core.failure(), HasSubstr("game b.game: content: has 1048577 bytes"));
}

TEST_F(WorkerCoreTest, AMapWithoutItsRegionIsAFailure) {
  *order.mutable_map() = ToProto(MapOfOne(*MakeGridMap(scene->ground(), 1), 1, RegionId(9)));
  TakeOrder();
  Load();
  EXPECT_THAT(core.failure(), HasSubstr("region 1 is not in the map"));
}

TEST_F(WorkerCoreTest, AnInstanceThatEndsStopsItInOrder) {
  order.set_run(true);
  TakeOrder();
  Load();
  Advance();
  order.set_stop(true);
  TakeOrder();
  EXPECT_TRUE(core.stopping());
  EXPECT_EQ(core.failure(), "");
  EXPECT_THAT(AllOf<PublishStep>(Advance()), IsEmpty());
}

TEST_F(WorkerCoreTest, LetsInThePlayersThatItsOrderNames) {
  EXPECT_EQ(core.Admit(PlayerNumber(1)), Admission::kNotYet);
  order.add_players()->set_number(1);
  order.add_players()->set_number(2);
  order.mutable_players(1)->set_left(true);
  TakeOrder();
  EXPECT_EQ(core.Admit(PlayerNumber(1)), Admission::kWelcome);
  EXPECT_EQ(core.Admit(PlayerNumber(2)), Admission::kLeft);
}

TEST_F(WorkerCoreTest, ACheckpointIsWrittenAndReported) {
  order.set_run(true);
  order.mutable_checkpoint()->set_tick(2);
  order.mutable_checkpoint()->set_path("file");
  TakeOrder();
  Load();
  Advance();
  EXPECT_THAT(AllOf<WriteCheckpoint>(Advance()), SizeIs(1));
  core.CheckpointWritten(Tick(2), absl::OkStatus());
  EXPECT_EQ(ReportIn(Advance()).checkpoint_tick(), 2U);
}

TEST_F(WorkerCoreTest, ARegionThatJoinsIsBuiltAnewForALaterMapWhileItHasNotStepped) {
  order.set_joins_running(true);
  order.mutable_planned()->set_effective_tick(50);
  *order.mutable_planned()->mutable_map() = ToProto(*MakeGridMap(scene->ground(), 1));
  TakeOrder();
  Load();
  EXPECT_EQ(core.run()->region().tick(), Tick(49));
  order.mutable_planned()->set_effective_tick(90);
  TakeOrder();
  EXPECT_EQ(core.run()->region().tick(), Tick(89));
  EXPECT_THAT(core.run()->region().owned(), IsEmpty());
}

}  // namespace
}  // namespace tessera::worker
