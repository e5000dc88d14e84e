#include "region_worker/core/worker_core.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/game/testing/scripted_game.h"
#include "core/world/partition_io.h"
#include "region_worker/testing/certify.h"
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
    Certify(order, instance_key, key);
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
  const net::SigningKey instance_key = net::SigningKey::Make();
  const net::VerificationKey key = net::SigningKey::Make().verification_key();
  WorkerCore core{{.identity = {"instance", kSelf, Incarnation(1)},
                   .pid = 77,
                   .address = {},
                   .borders = {},
                   .standalone = {},
                   .key = key}};
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

TEST_F(WorkerCoreTest, AnOrderIsLoggedWithItsOperation) {
  const auto logged = [](const Actions& actions) {
    std::string all;
    for (const Log& log : AllOf<Log>(actions)) all += log.line + "\n";
    return all;
  };
  order.set_operation("12-7");
  EXPECT_THAT(logged(TakeOrder()), HasSubstr(" op=12-7\n"));
  order.set_operation("12-8\nforged line");
  const std::string second = logged(TakeOrder());
  EXPECT_THAT(second, HasSubstr(" op=\n")) << "what is no id is not logged";
  EXPECT_THAT(second, ::testing::Not(HasSubstr("forged")));
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

TEST_F(WorkerCoreTest, ARevokedLifeOfANeighbourIsCutAndNotLetInThoughTheOrderHasNoNewRevision) {
  *order.mutable_map() = ToProto(*MakeGridMap(scene->ground(), 2));
  const RegionId other = order.map().regions(0).id() == kSelf.value() ? RegionId(order.map().regions(1).id())
                                                                      : RegionId(order.map().regions(0).id());
  v1::RegionAddress& peer = *order.add_peers();
  peer.set_region(other.value());
  peer.set_incarnation(7);
  peer.set_host("127.0.0.1");
  peer.set_link_port(7001);
  TakeOrder();
  Load();
  core.LinkUp(other, Incarnation(7), now);
  ASSERT_TRUE(core.links().Admit(other, Incarnation(7)).ok());
  v1::DeadRegion& life = *order.add_revoked();
  life.set_region(other.value());
  life.set_incarnation(7);
  core.TakeOrder(order, now);  // the same revision
  EXPECT_THAT(AllOf<CutLink>(core.TakeActions()), SizeIs(1));
  EXPECT_THAT(std::string(core.links().Admit(other, Incarnation(7)).message()), HasSubstr("has been declared dead"));
  EXPECT_FALSE(core.links().Dials(other));
  EXPECT_TRUE(core.links().Admit(other, Incarnation(8)).ok()) << "the next life of the region is another's";
}

TEST_F(WorkerCoreTest, ARevokedRegionThatCannotBeIsRefused) {
  order.add_revoked()->set_region(0);
  EXPECT_THAT(AllOf<RequestScene>(TakeOrder()), IsEmpty());
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

TEST_F(WorkerCoreTest, ANeighbourThatSaysNothingForASecondIsReportedAsNotLinkedUntilItIsHeard) {
  *order.mutable_map() = ToProto(*MakeGridMap(scene->ground(), 2));
  v1::RegionAddress& peer = *order.add_peers();
  peer.set_region(kSecond.value());
  peer.set_incarnation(7);
  peer.set_host("127.0.0.1");
  peer.set_link_port(7001);
  order.set_run(true);
  TakeOrder();
  Load();
  core.LinkUp(kSecond, Incarnation(7), now);
  EXPECT_EQ(ReportIn(Advance()).linked_regions_size(), 1);
  const LinkTable::LinkNumber link = core.links().LinkTo(kSecond);
  const auto until_linked = [&](int neighbours) {
    const TimePoint since = now;
    while (now - since < std::chrono::seconds(5)) {
      const auto reports = AllOf<SendReport>(Advance());
      if (!reports.empty() && reports.back().report.linked_regions_size() == neighbours) break;
    }
    return now - since;
  };
  const Duration silent = until_linked(0);
  EXPECT_GE(silent, std::chrono::milliseconds(950));
  EXPECT_LE(silent, std::chrono::milliseconds(1300));
  EXPECT_EQ(core.phase(), v1::WORKER_PHASE_RUNNING);
  EXPECT_EQ(core.links().LinkTo(kSecond), link) << "which stands as long as its transport says so";
  LinkMessage alive;
  alive.kind = LinkMessageKind::kAlive;
  core.Receive(kSecond, alive, now);
  EXPECT_EQ(until_linked(1), std::chrono::milliseconds(20)) << "at once";
}

TEST_F(WorkerCoreTest, ASceneThatCannotBeReadEndsItWithAReason) {
  TakeOrder();
  core.SceneLoaded(absl::NotFoundError("scene.json: no such file"), now);
  EXPECT_TRUE(core.stopping());
  EXPECT_TRUE(core.goes_on()) << "another worker may take its place";
  EXPECT_THAT(core.failure(), HasSubstr("no such file"));
  const v1::WorkerReport last = ReportIn(Advance());
  EXPECT_EQ(last.phase(), v1::WORKER_PHASE_STOPPING);
  EXPECT_EQ(last.failure(), core.failure());
}

TEST_F(WorkerCoreTest, ANativeGameIsAskedForByNameAndBuildAndRuns) {
  OrderGame("");
  order.set_game_path("/games/arena.so");
  order.set_game_name("arena");
  order.set_game_native(true);
  order.set_run(true);
  TakeOrder();
  const Actions after_scene = Load();
  EXPECT_THAT(AllOf<RequestGame>(after_scene), IsEmpty());
  const auto asked = AllOf<RequestModule>(after_scene);
  ASSERT_THAT(asked, SizeIs(1));
  EXPECT_EQ(asked[0].path, "/games/arena.so");
  EXPECT_EQ(asked[0].name, "arena");
  EXPECT_EQ(asked[0].hash, order.game_hash());
  static game::ScriptedGame native;  // both outlive the core
  static const tessera_game_module functions = native.module();
  core.ModuleLoaded(&functions, now);
  EXPECT_THAT(AllOf<OpenPorts>(core.TakeActions()), SizeIs(1));
  Advance();
  Advance();
  ASSERT_NE(core.run()->game(), nullptr);
  EXPECT_EQ(core.phase(), v1::WORKER_PHASE_RUNNING);
}

TEST_F(WorkerCoreTest, ANativeGameThatCannotRunHereEndsItWithTheReason) {
  OrderGame("");
  order.set_game_path("/games/arena.so");
  order.set_game_native(true);
  TakeOrder();
  Load();
  core.ModuleLoaded(absl::FailedPreconditionError("game module arena: is made for version 8"), now);
  EXPECT_EQ(core.failure(), "game module arena: is made for version 8");
  EXPECT_EQ(ReportIn(Advance()).failure(), core.failure());
}

TEST_F(WorkerCoreTest, AMovementIsAskedForBeforeTheGameThatItStandsBeside) {
  OrderGame("function on_tick() end");
  order.set_movement_path("/games/car.so");
  order.set_movement_name("car");
  order.set_movement_hash(std::string(64, 'd'));
  TakeOrder();
  const Actions after_scene = Load();
  EXPECT_THAT(AllOf<RequestGame>(after_scene), IsEmpty());
  const auto asked = AllOf<RequestMovement>(after_scene);
  ASSERT_THAT(asked, SizeIs(1));
  EXPECT_EQ(asked[0].path, "/games/car.so");
  EXPECT_EQ(asked[0].name, "car");
  EXPECT_EQ(asked[0].hash, order.movement_hash());
  static const tessera_movement bad = {};  // it has no version
  core.MovementLoaded(&bad, now);
  EXPECT_THAT(AllOf<RequestGame>(core.TakeActions()), SizeIs(1));
  core.GameLoaded("function on_tick() end", now);
  EXPECT_THAT(core.failure(), HasSubstr("movement: is made for version 0 of the interface")) << "it goes with the game";
}

TEST_F(WorkerCoreTest, AMovementThatCannotBeLoadedEndsItWithTheReason) {
  OrderGame("function on_tick() end");
  order.set_movement_path("/games/car.so");
  order.set_movement_name("car");
  order.set_movement_hash(std::string(64, 'd'));
  TakeOrder();
  Load();
  core.MovementLoaded(absl::FailedPreconditionError("game module car: has no movement"), now);
  EXPECT_EQ(core.failure(), "game module car: has no movement");
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
  EXPECT_FALSE(core.goes_on());
  EXPECT_EQ(core.stop_reason(), "the instance ends");
  EXPECT_EQ(core.failure(), "");
  EXPECT_THAT(AllOf<PublishStep>(Advance()), IsEmpty());
}

TEST_F(WorkerCoreTest, AWorkerThatIsNoLongerWantedSaysThatTheWorldGoesOn) {
  order.set_run(true);
  TakeOrder();
  Load();
  Advance();
  order.set_stop(true);
  order.set_goes_on(true);
  TakeOrder();
  EXPECT_TRUE(core.stopping());
  EXPECT_TRUE(core.goes_on());
  EXPECT_EQ(core.failure(), "");
}

TEST_F(WorkerCoreTest, LetsInThePlayersThatItsOrderNames) {
  const net::Generation first(1);
  EXPECT_EQ(core.Admit(PlayerNumber(1), first), Admission::kNotYet);
  order.add_players()->set_number(1);
  order.add_players()->set_number(2);
  order.mutable_players(1)->set_left(true);
  TakeOrder();
  EXPECT_EQ(core.Admit(PlayerNumber(1), first), Admission::kWelcome);
  EXPECT_EQ(core.Admit(PlayerNumber(2), first), Admission::kLeft);
}

TEST_F(WorkerCoreTest, AnOrderMayNameThePlayersThatChanged) {
  const net::Generation first(1);
  for (const std::uint32_t number : {1U, 2U, 3U}) order.add_players()->set_number(number);
  TakeOrder();
  const std::uint64_t whole = order.revision();
  order.clear_players();
  order.add_players()->set_number(2);
  order.mutable_players(0)->set_left(true);
  order.add_players()->set_number(4);
  order.set_players_since(whole);
  order.add_players_forgotten(3);
  EXPECT_THAT(AllOf<AskWholeOrder>(TakeOrder()), IsEmpty());
  EXPECT_EQ(core.Admit(PlayerNumber(1), first), Admission::kWelcome);
  EXPECT_EQ(core.Admit(PlayerNumber(2), first), Admission::kLeft);
  EXPECT_EQ(core.Admit(PlayerNumber(3), first), Admission::kNotYet);
  EXPECT_EQ(core.Admit(PlayerNumber(4), first), Admission::kWelcome);
  // The same once more is a change of another order than the one before.
  EXPECT_THAT(AllOf<AskWholeOrder>(TakeOrder()), SizeIs(1));
  EXPECT_EQ(core.Admit(PlayerNumber(4), first), Admission::kWelcome) << "and it changes nothing";
}

TEST_F(WorkerCoreTest, OfTwoProcessesOfAPlayerTheNewerOneComesIn) {
  order.add_players()->set_number(1);
  order.mutable_players(0)->set_generation(3);
  TakeOrder();
  EXPECT_EQ(core.Admit(PlayerNumber(1), net::Generation(2)), Admission::kReplaced);
  EXPECT_EQ(core.Admit(PlayerNumber(1), net::Generation(3)), Admission::kWelcome);
  EXPECT_EQ(core.Admit(PlayerNumber(1), net::Generation(4)), Admission::kWelcome) << "the order is on its way";
}

TEST_F(WorkerCoreTest, ItsPortsStayClosedUntilItsOwnKeyIsCertified) {
  order.clear_certificate();
  order.clear_instance_key();
  EXPECT_THAT(AllOf<RequestScene>(TakeOrder()), SizeIs(1)) << "meanwhile it loads";
  EXPECT_THAT(AllOf<OpenPorts>(Load()), IsEmpty());
  const v1::WorkerReport report = ReportIn(Advance());
  EXPECT_EQ(report.public_key(), std::string(key.begin(), key.end()));
  EXPECT_EQ(report.phase(), v1::WORKER_PHASE_LOADING);
  Certify(order, instance_key, net::SigningKey::Make().verification_key());
  EXPECT_THAT(AllOf<OpenPorts>(TakeOrder()), IsEmpty()) << "that is of the process before this one";
  Certify(order, instance_key, key);
  const Actions opened = TakeOrder();
  ASSERT_THAT(AllOf<OpenPorts>(opened), SizeIs(1));
  EXPECT_EQ(AllOf<OpenPorts>(opened)[0].certified.instance_key, instance_key.verification_key());
  EXPECT_EQ(core.phase(), v1::WORKER_PHASE_LINKED);
}

TEST_F(WorkerCoreTest, ACertificateThatIsNotItsOwnIsRefusedWithItsOrder) {
  const auto refused = [&](auto change) {
    v1::WorkerOrder bad = order;
    change(bad);
    bad.set_revision(order.revision() + 1);
    core.TakeOrder(bad, now);
    const auto lines = AllOf<Log>(core.TakeActions());
    return lines.empty() ? std::string() : lines.back().line;
  };
  EXPECT_THAT(refused([](auto& bad) { bad.set_certificate("?"); }), HasSubstr("certificate: this is no worker"));
  EXPECT_THAT(refused([](auto& bad) { bad.mutable_certificate()->back() ^= 1; }), HasSubstr("certificate: the worker"));
  EXPECT_THAT(refused([](auto& bad) { bad.set_instance_key("short"); }), HasSubstr("instance_key has 5 bytes"));
  EXPECT_THAT(refused([&](auto& bad) {
                v1::WorkerOrder other = order;
                other.set_incarnation(2);
                Certify(other, instance_key, key);
                bad.set_certificate(other.certificate());
              }),
              HasSubstr("certificate: is another worker's"));
  EXPECT_EQ(core.order().revision, 0U);
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
