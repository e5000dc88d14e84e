// How workers begin: orders, scenes, games and states, and what is passed on to and from them.
#include <gmock/gmock.h>

#include <csignal>
#include <string>
#include <vector>

#include "agent/testing/supervisor_rig.h"

namespace tessera::agent {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

TEST_F(SupervisorTest, AnOrderKeepsTheOperationThatItBelongsTo) {
  v1::WorkerOrder order = Order(1);
  order.set_operation("12-7");
  const std::vector<OrderOutcome> outcomes = Want({order});
  ASSERT_EQ(outcomes.size(), 1u);
  EXPECT_EQ(outcomes[0].operation, "12-7");
  ASSERT_EQ(supervisor_.HeldOrders().orders_size(), 1);
  EXPECT_EQ(supervisor_.HeldOrders().orders(0).operation(), "12-7");
}

TEST_F(SupervisorTest, StartsAllMissingWorkersAtOnceEachWithPortsOfItsOwn) {
  Want({Order(1), Order(2), Order(3), Order(4)});
  EXPECT_THAT(spawned_, ElementsAre(7800, 7803, 7806, 7809));
  EXPECT_THAT(fetches_, ElementsAre(kHash));  // one scene, one fetch
  Want({Order(1), Order(2), Order(3), Order(4)});
  EXPECT_THAT(spawned_, SizeIs(4));  // repeating the set does nothing
  EXPECT_EQ(supervisor_.desired_revision(), 2U);
}

TEST_F(SupervisorTest, RevokedLivesGoWithTheOrdersOfTheirWorldAndToThoseThatHaveOneAlready) {
  v1::DeadRegion life;
  life.set_region(3);
  life.set_incarnation(12);
  Want({Order(1)});
  supervisor_.ContentReady(kScene, "/s");
  Attach(1);
  ASSERT_THAT(orders_, SizeIs(1));
  EXPECT_THAT(orders_[0].revoked(), IsEmpty());
  supervisor_.SetRevoked({{"inst-2", {life}}});
  Carry();
  EXPECT_THAT(orders_, SizeIs(1)) << "another world's";
  supervisor_.SetRevoked({{"inst-1", {life}}});
  Carry();
  ASSERT_THAT(orders_, SizeIs(2));
  ASSERT_THAT(orders_[1].revoked(), SizeIs(1));
  EXPECT_EQ(orders_[1].revoked(0).incarnation(), 12U);
  EXPECT_EQ(orders_[1].revision(), orders_[0].revision());
  Want({Order(1, 2)});
  ASSERT_THAT(orders_, SizeIs(3));
  EXPECT_THAT(orders_[2].revoked(), SizeIs(1));
  EXPECT_THAT(supervisor_.HeldOrders().orders(0).revoked(), IsEmpty()) << "it is no part of what was ordered";
}

TEST_F(SupervisorTest, AsksForASceneAnewWheneverAWorkerIsToBeginWithIt) {
  Want({Order(1)});
  supervisor_.ContentReady(kScene, "/s");
  Attach(1);
  supervisor_.Reported(Key(1), Report(1, v1::WORKER_PHASE_RUNNING));
  EXPECT_THAT(orders_, SizeIs(1));
  Want({Order(1, 2), Order(2)});
  EXPECT_THAT(orders_, SizeIs(2)) << "who runs does not wait";
  Attach(2);
  EXPECT_THAT(fetches_, ElementsAre(kHash, kHash)) << "by hand its file may have been removed";
  EXPECT_THAT(orders_, SizeIs(2));
  supervisor_.ContentReady(kScene, "/s");
  Carry();
  ASSERT_THAT(orders_, SizeIs(3));
  EXPECT_EQ(orders_[2].region(), 2U);
}

TEST_F(SupervisorTest, ASceneThatCannotBeHadAnyMoreEndsOnlyThoseThatAreToBegin) {
  Want({Order(1)});
  supervisor_.ContentReady(kScene, "/s");
  Attach(1);
  supervisor_.Reported(Key(1), Report(1, v1::WORKER_PHASE_RUNNING));
  Want({Order(1), Order(2)});
  supervisor_.ContentFailed(kScene, "scene aaa: no instance uses it");
  Carry();
  EXPECT_THAT(signals_, ElementsAre(SIGKILL));
  Want({Order(1, 2), Order(2)});
  EXPECT_THAT(orders_, SizeIs(2)) << "who runs goes on";
}

TEST_F(SupervisorTest, SendsTheOrderOnceWorkerAndSceneAreThereInEitherOrder) {
  Want({Order(1), Order(2)});
  Attach(1);
  EXPECT_THAT(orders_, IsEmpty());
  supervisor_.ContentReady(kScene, "/scenes/a.pb");
  Carry();
  ASSERT_THAT(orders_, SizeIs(1));
  EXPECT_EQ(orders_[0].scene_path(), "/scenes/a.pb");
  Attach(2);
  ASSERT_THAT(orders_, SizeIs(2));
  EXPECT_EQ(orders_[1].region(), 2U);
}

TEST_F(SupervisorTest, SendsTheOrderOfAWorldWithAGameOnceSceneAndGameAreThere) {
  Want({OrderWithGame(1), OrderWithGame(2)});
  EXPECT_THAT(fetches_, ElementsAre(kHash, kGameHash));
  supervisor_.ContentReady(kScene, "/scenes/a.pb");
  Attach(1);
  EXPECT_THAT(orders_, IsEmpty()) << "without its game a region would run another world";
  supervisor_.ContentReady(kGame, "/games/b.game");
  Carry();
  ASSERT_THAT(orders_, SizeIs(1));
  EXPECT_EQ(orders_[0].game_path(), "/games/b.game");
}

TEST_F(SupervisorTest, AGameThatCannotBeHadEndsTheWorkersThatRunItAlone) {
  Want({OrderWithGame(1), Order(2)});
  supervisor_.ContentFailed(kGame, "game bbb: no instance runs it");
  Carry();
  EXPECT_THAT(signals_, ElementsAre(SIGKILL));
}

TEST_F(SupervisorTest, AGameThatIsToBeNextHoldsUpNoOrderAndItsFailureEndsNobody) {
  v1::WorkerOrder order = Order(1);
  order.mutable_next_game()->set_hash(kGameHash);
  Want({order});
  EXPECT_THAT(fetches_, ElementsAre(kHash, kGameHash));
  supervisor_.ContentReady(kScene, "/scenes/a.pb");
  Attach(1);
  ASSERT_THAT(orders_, SizeIs(1));
  EXPECT_EQ(orders_[0].next_game().path(), "") << "it is on its way";
  supervisor_.ContentFailed(kGame, "game bbb: is not what it claims to be");
  Carry();
  ASSERT_THAT(orders_, SizeIs(2));
  EXPECT_EQ(orders_[1].next_game().failure(), "game bbb: is not what it claims to be");
  EXPECT_THAT(signals_, IsEmpty());
  order.set_revision(2);
  Want({order});
  supervisor_.ContentReady(kGame, "/games/b.game");
  Carry();
  EXPECT_EQ(orders_.back().next_game().path(), "/games/b.game");
  EXPECT_EQ(orders_.back().next_game().failure(), "");
}

TEST_F(SupervisorTest, PassesOnOnlyOrdersThatChanged) {
  Want({Order(1)});
  supervisor_.ContentReady(kScene, "/s");
  Attach(1);
  ASSERT_THAT(orders_, SizeIs(1));
  EXPECT_FALSE(Want({Order(1)})[0].changed);
  EXPECT_THAT(orders_, SizeIs(1));
  v1::WorkerOrder run = Order(1, 2);
  run.set_run(true);
  EXPECT_EQ(Want({run})[0].what, "passed on");
  ASSERT_THAT(orders_, SizeIs(2));
  EXPECT_TRUE(orders_[1].run());
}

TEST_F(SupervisorTest, WholeOrderIsSentAgainToAWorkerThatAttachesAnew) {
  Want({Order(1)});
  supervisor_.ContentReady(kScene, "/s");
  Attach(1);
  supervisor_.Detached(Key(1));
  Pass(std::chrono::hours(1));  // a worker that ran is not ended because its connection broke
  EXPECT_THAT(signals_, IsEmpty());
  Attach(1);
  EXPECT_THAT(orders_, SizeIs(2));
}

TEST_F(SupervisorTest, RefusesAStrangerAndAPidThatIsNotTheWorkers) {
  EXPECT_EQ(supervisor_.Attached(Report(1), PidOf(1)).status().code(), absl::StatusCode::kNotFound);
  Want({Order(1)});
  v1::WorkerReport other = Report(1);
  other.mutable_identity()->set_pid(4);
  EXPECT_EQ(supervisor_.Attached(other, 4).status().code(), absl::StatusCode::kNotFound);
  // It names the worker, and is another process.
  const absl::Status sibling = supervisor_.Attached(Report(1), PidOf(1) + 1).status();
  EXPECT_EQ(sibling.code(), absl::StatusCode::kNotFound);
  EXPECT_THAT(std::string(sibling.message()), HasSubstr("is not worker inst-1/1#"));
  EXPECT_TRUE(supervisor_.Attached(Report(1), PidOf(1)).ok());
}

TEST_F(SupervisorTest, BadOrdersAreReportedByFieldAndStartNothing) {
  const auto with = [](auto change) {
    v1::WorkerOrder order = Order(1);
    change(order);
    return order;
  };
  const std::vector<std::pair<v1::WorkerOrder, std::string>> bad = {
      {with([](auto& o) { o.set_instance_id(""); }), "instance_id"},
      {with([](auto& o) { o.set_instance_id("../../etc/passwd"); }), "instance_id"},
      {with([](auto& o) { o.set_instance_id("--region-binary"); }), "instance_id"},
      {with([](auto& o) { o.set_instance_id(std::string(65, 'x')); }), "instance_id"},
      {with([](auto& o) { o.set_region(0); }), "region"},
      {with([](auto& o) { o.set_region(10'000); }), "region"},
      {with([](auto& o) { o.set_incarnation(0); }), "incarnation"},
      {with([](auto& o) { o.set_scene_hash("../x"); }), "scene_hash"},
      {with([](auto& o) { o.set_scene_hash(std::string(64, 'G')); }), "scene_hash"},
      {with([](auto& o) { o.set_game_hash("../x"); }), "game_hash"},
  };
  for (const auto& [order, field] : bad) {
    Want({});
    exits_.clear();
    Want({order});
    ASSERT_THAT(exits_, SizeIs(1)) << field;
    EXPECT_THAT(exits_[0].reason(), HasSubstr("order: " + field));
  }
  EXPECT_THAT(spawned_, IsEmpty());
}

TEST_F(SupervisorTest, SecondOrderForTheSameWorkerInOneSetIsIgnored) {
  const auto outcomes = Want({Order(1), Order(1, 9)});
  EXPECT_THAT(spawned_, SizeIs(1));
  EXPECT_EQ(outcomes[1].what, "ignored: in the set twice");
}

TEST_F(SupervisorTest, AWorkerThatBeginsWithAStateGetsItsOrderWhenTheFileIsThere) {
  supervisor_.SetStateFolder("/states");
  v1::WorkerOrder order = Order(1);
  order.mutable_initial_state()->set_tick(600);
  order.mutable_initial_state()->set_hash("abc");
  Want({order});
  Attach(1);
  supervisor_.ContentReady(kScene, "/scene");
  Carry();
  EXPECT_THAT(orders_, SizeIs(0));
  ASSERT_THAT(states_, SizeIs(1));
  EXPECT_EQ(states_[0].tick, 600U);
  supervisor_.StateReady(Key(1), states_[0].path);
  Carry();
  ASSERT_THAT(orders_, SizeIs(1));
  EXPECT_EQ(orders_[0].initial_state().path(), states_[0].path);
}

TEST_F(SupervisorTest, PassesOnAWrittenCheckpointOnce) {
  supervisor_.SetStateFolder("/states");
  v1::WorkerOrder order = Order(1);
  order.mutable_checkpoint()->set_tick(600);
  Want({order});
  Attach(1);
  supervisor_.ContentReady(kScene, "/scene");
  Carry();
  ASSERT_THAT(orders_, SizeIs(1));
  v1::WorkerReport report = Report(1, v1::WORKER_PHASE_RUNNING);
  supervisor_.Reported(Key(1), report);
  Carry();
  EXPECT_THAT(uploads_, SizeIs(0));
  report.set_checkpoint_tick(600);
  for (int i = 0; i < 3; ++i) supervisor_.Reported(Key(1), report);
  Carry();
  ASSERT_THAT(uploads_, SizeIs(1));
  EXPECT_EQ(uploads_[0].path, orders_[0].checkpoint().path());
}

// Its file may have been removed.
TEST_F(SupervisorTest, ContentThatOrdersNameNoMoreIsAskedForAgainBeforeItIsUsed) {
  Want({OrderWithGame(1)});
  Attach(1);
  supervisor_.ContentReady(kScene, "/s");
  supervisor_.ContentReady(kGame, "/g");
  Carry();
  EXPECT_THAT(supervisor_.NamedContents(), ElementsAre(kScene, kGame));
  v1::WorkerOrder without = Order(1, 2);
  Want({without});
  EXPECT_THAT(supervisor_.NamedContents(), ElementsAre(kScene));
  fetches_.clear();
  v1::WorkerOrder again = OrderWithGame(1);
  again.set_revision(3);
  Want({again});
  EXPECT_THAT(fetches_, ElementsAre(kGameHash));
  EXPECT_THAT(supervisor_.NamedContents(), ElementsAre(kScene, kGame));

  Supervisor next(PortRange(7800, 8799), [](std::uint16_t) { return true; });
  next.Adopt(supervisor_.State("boot").workers(0), again);
  EXPECT_THAT(next.NamedContents(), ElementsAre(kScene, kGame)) << "its worker has them open, or will";
}

// Also where it is started once more.
TEST_F(SupervisorTest, AWorkerIsOfTheReleaseThatItsOrderNames) {
  v1::WorkerOrder order = Order(1);
  order.set_release("0.1.0");
  Want({order, Order(2)});
  EXPECT_THAT(releases_, ElementsAre("0.1.0", ""));
  End(1, {.known = true, .code = kExitPortInUse});
  EXPECT_THAT(releases_, ElementsAre("0.1.0", "", "0.1.0"));
}

TEST_F(SupervisorTest, PassesEachReportOnAtOnce) {
  Want({Order(1)});
  Attach(1);
  reports_.clear();
  v1::WorkerReport report = Report(1, v1::WORKER_PHASE_RUNNING);
  supervisor_.Reported(Key(1), report);
  Carry();
  EXPECT_THAT(reports_, SizeIs(1));
  report.set_tick(60);
  supervisor_.Reported(Key(1), report);
  Carry();
  EXPECT_THAT(reports_, SizeIs(2));
  EXPECT_EQ(supervisor_.Reports()[0].tick(), 60U);
}

// It would end the host's stream, and each later one that begins with it.
TEST_F(SupervisorTest, AWorkerThatReportsTooMuchIsKilledAndItsReportPassedOnToNobody) {
  Want({Order(1), Order(2)});
  Attach(1);
  Attach(2);
  reports_.clear();
  v1::WorkerReport report = Report(1, v1::WORKER_PHASE_RUNNING);
  report.set_failure(std::string(kMaxReportBytes + 1, 'x'));
  supervisor_.Reported(Key(1), report);
  Carry();
  EXPECT_THAT(reports_, IsEmpty());
  EXPECT_LT(supervisor_.Reports()[0].ByteSizeLong(), 1000U);
  EXPECT_THAT(signals_, ElementsAre(SIGKILL));
}

}  // namespace
}  // namespace tessera::agent
