#include "agent/supervisor.h"

#include <csignal>
#include <string>
#include <vector>

#include "gmock/gmock.h"
#include "gtest/gtest.h"

namespace tessera::agent {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

constexpr auto kStart = TimePoint(std::chrono::hours(1));
const std::string kHash(64, 'a'), kGameHash(64, 'b');
const Content kScene{ContentKind::kScene, kHash}, kGame{ContentKind::kGame, kGameHash};

// Carries actions out against a world of its own: processes are numbers, time is what the test says.
class SupervisorTest : public ::testing::Test {
 protected:
  static v1::WorkerOrder Order(std::uint32_t region, std::uint64_t revision = 1) {
    v1::WorkerOrder order;
    order.set_revision(revision);
    order.set_instance_id("inst-1");
    order.set_region(region);
    order.set_incarnation(region + 10);
    order.set_scene_hash(kHash);
    return order;
  }
  static v1::WorkerOrder OrderWithGame(std::uint32_t region) {
    v1::WorkerOrder order = Order(region);
    order.set_game_hash(kGameHash);
    return order;
  }
  static WorkerKey Key(std::uint32_t region) { return {"inst-1", region, region + 10}; }

  std::vector<OrderOutcome> Want(const std::vector<v1::WorkerOrder>& orders) {
    v1::DesiredSet set;
    set.set_revision(++revision_);
    for (const auto& order : orders) *set.add_workers() = order;
    auto outcomes = supervisor_.Desired(set, now_);
    Carry();
    return outcomes;
  }

  v1::WorkerReport Report(std::uint32_t region, v1::WorkerPhase phase = v1::WORKER_PHASE_LOADING) const {
    v1::WorkerReport report;
    report.mutable_identity()->set_instance_id("inst-1");
    report.mutable_identity()->set_region(region);
    report.mutable_identity()->set_incarnation(region + 10);
    const auto pid = pids_.find(Key(region));
    report.mutable_identity()->set_pid(pid == pids_.end() ? 0 : pid->second);
    report.set_phase(phase);
    return report;
  }
  pid_t PidOf(std::uint32_t region) const { return static_cast<pid_t>(Report(region).identity().pid()); }
  void Attach(std::uint32_t region) {
    ASSERT_TRUE(supervisor_.Attached(Report(region), PidOf(region)).ok());
    Carry();
  }
  void End(std::uint32_t region, const host::ExitStatus& status, std::vector<std::string> lines = {}) {
    pids_.erase(Key(region));
    supervisor_.Ended(Key(region), status, std::move(lines));
    Carry();
  }
  void Pass(Duration time) {
    now_ += time;
    supervisor_.Tick(now_);
    Carry();
  }

  void Carry() {
    for (auto actions = supervisor_.TakeActions(); !actions.empty(); actions = supervisor_.TakeActions()) {
      for (const Action& action : actions) std::visit([this](const auto& a) { Do(a); }, action);
    }
  }
  void Do(const SpawnWorker& a) {
    spawned_.push_back(a.first_port);
    if (!spawn_error_.empty()) return supervisor_.SpawnFailed(a.key, spawn_error_);
    pids_[a.key] = ++last_pid_;
    supervisor_.Spawned(a.key, last_pid_, 7, "log", now_);
  }
  void Do(const SignalWorker& a) { signals_.push_back(a.signal); }
  void Do(const SendOrder& a) { orders_.push_back(a.order); }
  void Do(const FetchContent& a) { fetches_.push_back(a.content.hash); }
  void Do(const FetchState& a) { states_.push_back(a); }
  void Do(const UploadState& a) { uploads_.push_back(a); }
  void Do(const ForwardReport& a) { reports_.push_back(a.report); }
  void Do(const ReportExit& a) {
    exits_.push_back(a.exited);
    results_.push_back(a.result);
  }

  TimePoint now_ = kStart;
  std::uint64_t revision_ = 0;
  pid_t last_pid_ = 1000;
  std::string spawn_error_;
  std::map<WorkerKey, pid_t> pids_;
  std::vector<std::uint16_t> spawned_;
  std::vector<int> signals_;
  std::vector<v1::WorkerOrder> orders_;
  std::vector<std::string> fetches_;
  std::vector<v1::WorkerReport> reports_;
  std::vector<FetchState> states_;
  std::vector<UploadState> uploads_;
  std::vector<v1::WorkerExited> exits_;
  std::vector<ExitResult> results_;
  Supervisor supervisor_{PortRange(7800, 8799), [](std::uint16_t) { return true; }};
};

TEST_F(SupervisorTest, StartsAllMissingWorkersAtOnceEachWithPortsOfItsOwn) {
  Want({Order(1), Order(2), Order(3), Order(4)});
  EXPECT_THAT(spawned_, ElementsAre(7800, 7803, 7806, 7809));
  EXPECT_THAT(fetches_, ElementsAre(kHash));  // one scene, one fetch
  Want({Order(1), Order(2), Order(3), Order(4)});
  EXPECT_THAT(spawned_, SizeIs(4));  // repeating the set does nothing
  EXPECT_EQ(supervisor_.desired_revision(), 2U);
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

TEST_F(SupervisorTest, CrashIsReportedWithItsCauseAndTheWorkerIsNotStartedAgain) {
  Want({Order(1)});
  Attach(1);
  End(1, {.known = true, .signal = SIGSEGV}, {"last words"});
  ASSERT_THAT(exits_, SizeIs(1));
  EXPECT_TRUE(exits_[0].started());
  EXPECT_EQ(exits_[0].signal(), SIGSEGV);
  EXPECT_EQ(exits_[0].identity().pid(), 1001);
  EXPECT_EQ(exits_[0].reason(), "killed by SIGSEGV (Segmentation fault)");
  EXPECT_THAT(exits_[0].last_log_lines(), ElementsAre("last words"));
  EXPECT_THAT(results_, ElementsAre(ExitResult::kSignal));
  Want({Order(1, 2)});
  EXPECT_THAT(spawned_, SizeIs(1));
  EXPECT_THAT(supervisor_.Exits(), SizeIs(1));  // kept for a control plane that comes back
  Want({});
  EXPECT_THAT(supervisor_.Exits(), IsEmpty());  // heard
}

TEST_F(SupervisorTest, FailureThatAWorkerReportedIsPartOfTheReason) {
  Want({Order(1)});
  Attach(1);
  v1::WorkerReport report = Report(1);
  report.set_failure("mass must be > 0");
  supervisor_.Reported(Key(1), report);
  End(1, {.known = true, .code = 1});
  EXPECT_EQ(exits_[0].reason(), "exited with code 1: mass must be > 0");
  EXPECT_THAT(results_, ElementsAre(ExitResult::kError));
}

TEST_F(SupervisorTest, PortInUseIsTriedAgainWithOtherPortsAndNotReported) {
  Want({Order(1)});
  End(1, {.known = true, .code = kExitPortInUse});
  Attach(1);  // a worker may attach before it finds its port taken
  End(1, {.known = true, .code = kExitPortInUse});
  EXPECT_THAT(spawned_, ElementsAre(7800, 7803, 7806));
  EXPECT_THAT(exits_, IsEmpty());
}

TEST_F(SupervisorTest, PortInUseSixteenTimesIsReportedWithTheRange) {
  Want({Order(1)});
  for (int i = 0; i < kPortAttempts; ++i) End(1, {.known = true, .code = kExitPortInUse});
  EXPECT_THAT(spawned_, SizeIs(16));
  ASSERT_THAT(exits_, SizeIs(1));
  EXPECT_FALSE(exits_[0].started());
  EXPECT_EQ(exits_[0].exit_code(), kExitPortInUse);
  EXPECT_EQ(exits_[0].reason(), "port in use: no three free ports in 7800-8799 after 16 attempts");
}

TEST_F(SupervisorTest, Code98AfterThePortsWereBoundIsACrash) {
  Want({Order(1)});
  Attach(1);
  supervisor_.Reported(Key(1), Report(1, v1::WORKER_PHASE_RUNNING));
  End(1, {.known = true, .code = kExitPortInUse});
  EXPECT_THAT(spawned_, SizeIs(1));
  ASSERT_THAT(exits_, SizeIs(1));
  EXPECT_EQ(exits_[0].reason(), "exited with code 98");
}

TEST_F(SupervisorTest, FullPortRangeIsReportedAndStartsNothing) {
  Supervisor small(PortRange(7800, 7802), [](std::uint16_t) { return true; });
  v1::DesiredSet set;
  *set.add_workers() = Order(1);
  *set.add_workers() = Order(2);
  small.Desired(set, now_);
  const auto exits = small.Exits();
  ASSERT_THAT(exits, SizeIs(1));
  EXPECT_EQ(exits[0].identity().region(), 2U);
  EXPECT_FALSE(exits[0].started());
  EXPECT_EQ(exits[0].reason(), "no three free ports in 7800-7802");
}

TEST_F(SupervisorTest, WorkerThatNeverAttachesIsKilledAndReported) {
  Want({Order(1)});
  Pass(kAttachTimeout - std::chrono::milliseconds(1));
  EXPECT_THAT(signals_, IsEmpty());
  EXPECT_EQ(supervisor_.NextDeadline(), kStart + kAttachTimeout);
  Pass(std::chrono::milliseconds(1));
  EXPECT_THAT(signals_, ElementsAre(SIGKILL));
  End(1, {.known = true, .signal = SIGKILL});
  EXPECT_FALSE(exits_[0].started());
  EXPECT_EQ(exits_[0].reason(), "killed: did not attach within 10 s");
}

TEST_F(SupervisorTest, WorkerNoLongerWantedIsToldToStopThenTerminatedThenKilled) {
  Want({Order(1, 5)});
  supervisor_.ContentReady(kScene, "/s");
  Attach(1);
  Want({});
  ASSERT_THAT(orders_, SizeIs(2));
  EXPECT_TRUE(orders_[1].stop());
  EXPECT_TRUE(orders_[1].goes_on());     // nobody has said that the instance ends
  EXPECT_GT(orders_[1].revision(), 5U);  // else the worker would ignore it
  EXPECT_THAT(signals_, IsEmpty());
  Pass(kStopPatience);
  EXPECT_THAT(signals_, ElementsAre(SIGTERM));
  Pass(kTermPatience);
  EXPECT_THAT(signals_, ElementsAre(SIGTERM, SIGKILL));
  EXPECT_FALSE(supervisor_.NextDeadline());
}

TEST_F(SupervisorTest, StopOrderOfTheControlPlaneEndsAWorkerInOrder) {
  Want({Order(1)});
  supervisor_.ContentReady(kScene, "/s");
  Attach(1);
  v1::WorkerOrder stop = Order(1, 2);
  stop.set_stop(true);
  Want({stop});
  ASSERT_THAT(orders_, SizeIs(2));
  EXPECT_EQ(orders_[1].revision(), 2U);
  End(1, {.known = true});
  ASSERT_THAT(exits_, SizeIs(1));
  EXPECT_EQ(exits_[0].reason(), "exited with code 0");
  EXPECT_THAT(results_, ElementsAre(ExitResult::kClean));
}

TEST_F(SupervisorTest, StopOrderForAWorkerThatNeverWasIsAnsweredWithItsEnd) {
  v1::WorkerOrder stop = Order(1);
  stop.set_stop(true);
  Want({stop});
  EXPECT_THAT(spawned_, IsEmpty());
  ASSERT_THAT(exits_, SizeIs(1));
  EXPECT_FALSE(exits_[0].started());
}

TEST_F(SupervisorTest, SceneThatCannotBeHadEndsItsWorkersWithTheReason) {
  Want({Order(1)});
  supervisor_.ContentFailed(kScene, "scene aaa: no instance uses it");
  Carry();
  EXPECT_THAT(signals_, ElementsAre(SIGKILL));
  End(1, {.known = true, .signal = SIGKILL});
  EXPECT_EQ(exits_[0].reason(), "scene aaa: no instance uses it");
  Want({});
  Want({Order(2)});
  EXPECT_THAT(fetches_, SizeIs(2));  // a later instance may ask for it again
}

TEST_F(SupervisorTest, SpawnErrorIsReported) {
  spawn_error_ = "cannot run /x: Permission denied";
  Want({Order(1)});
  ASSERT_THAT(exits_, SizeIs(1));
  EXPECT_FALSE(exits_[0].started());
  EXPECT_EQ(exits_[0].reason(), spawn_error_);
  EXPECT_TRUE(supervisor_.Empty());
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

TEST_F(SupervisorTest, NextLifeAdoptsWhatLivesAndTellsWhatEnded) {
  Want({Order(1), Order(2), Order(3)});
  Attach(1);
  v1::WorkerReport running = Report(1, v1::WORKER_PHASE_RUNNING);
  running.mutable_address()->set_game_port(7800);
  supervisor_.TakeDirty();
  supervisor_.Reported(Key(1), running);
  EXPECT_TRUE(supervisor_.TakeDirty());
  End(3, {.known = true, .code = 4});
  const WorkersFile file = supervisor_.State("boot");
  ASSERT_EQ(file.workers_size(), 2);
  ASSERT_EQ(file.exits_size(), 1);

  Supervisor next(PortRange(7800, 8799), [](std::uint16_t) { return true; });
  next.AdoptExit(file.exits(0));
  next.Adopt(file.workers(0));
  next.AdoptGone(file.workers(1), "ended while no agent ran", {"bye"});
  ASSERT_THAT(next.Reports(), SizeIs(1));
  // Reported as it was, before it attaches: else the control plane would take it for one that lost its ports.
  EXPECT_EQ(next.Reports()[0].phase(), v1::WORKER_PHASE_RUNNING);
  EXPECT_EQ(next.Reports()[0].address().game_port(), 7800U);
  EXPECT_THAT(next.Exits(), SizeIs(2));
  EXPECT_FALSE(next.NextDeadline());  // an adopted worker has all the time it needs
  ASSERT_TRUE(next.Attached(Report(1), PidOf(1)).ok());
  next.TakeActions();

  v1::DesiredSet set;
  for (const std::uint32_t region : {1U, 2U, 3U, 4U}) *set.add_workers() = Order(region);
  next.Desired(set, now_);
  std::vector<std::uint16_t> ports;
  for (const Action& action : next.TakeActions()) {
    if (const auto* spawn = std::get_if<SpawnWorker>(&action)) ports.push_back(spawn->first_port);
  }
  EXPECT_THAT(ports, ElementsAre(7803));  // only region 4, and not on the ports of region 1
}

TEST_F(SupervisorTest, EndOfAnAdoptedWorkerSaysThatItsStatusIsUnknown) {
  WorkerRecord record;
  *record.mutable_identity() = Report(1).identity();
  record.mutable_identity()->set_pid(5);
  record.set_first_port(7800);
  supervisor_.Adopt(record);
  End(1, {.known = false});
  ASSERT_THAT(exits_, SizeIs(1));
  EXPECT_THAT(exits_[0].reason(), HasSubstr("exit status is unknown"));
  EXPECT_TRUE(exits_[0].started());
}

TEST_F(SupervisorTest, StopAllEndsAttachedOnesByOrderAndOthersBySignalAndStartsNoMore) {
  Want({Order(1), Order(2)});
  supervisor_.ContentReady(kScene, "/s");
  Attach(1);
  supervisor_.StopAll(now_);
  Carry();
  EXPECT_TRUE(orders_.back().stop());
  EXPECT_FALSE(orders_.back().goes_on());
  EXPECT_THAT(signals_, ElementsAre(SIGTERM));  // region 2 has no connection
  Want({Order(1), Order(2), Order(3)});
  EXPECT_THAT(spawned_, SizeIs(2));
  supervisor_.StopAll(now_);  // asked again: at once
  Carry();
  EXPECT_THAT(signals_, ElementsAre(SIGTERM, SIGKILL, SIGKILL));
  End(1, {.known = true});
  End(2, {.known = true, .signal = SIGKILL});
  EXPECT_TRUE(supervisor_.Empty());
}

}  // namespace
}  // namespace tessera::agent
