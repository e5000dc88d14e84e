// How workers end: crashes, ports in use, orders to stop, and those of an earlier life.
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
  EXPECT_EQ(exits[0].exit_code(), kExitPortInUse) << "the control plane then looks for another host";
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

// All that is known of a world after its machines and those of the control plane lost power.
TEST_F(SupervisorTest, TicksAreKeptNowAndThenAndToldOfWorkersThatAreGone) {
  Want({Order(1)});
  Attach(1);
  v1::WorkerReport report = Report(1, v1::WORKER_PHASE_RUNNING);
  report.set_tick(10);
  supervisor_.Reported(Key(1), report);
  Carry();
  EXPECT_TRUE(supervisor_.TakeDirty(now_));
  int saves = 0;
  for (int i = 0; i < 600; ++i) {
    now_ += std::chrono::milliseconds(100);
    report.set_tick(report.tick() + 6);
    supervisor_.Reported(Key(1), report);
    saves += supervisor_.TakeDirty(now_) ? 1 : 0;
  }
  EXPECT_EQ(saves, 12) << "a minute";
  now_ += kKeepTicksInterval;
  EXPECT_FALSE(supervisor_.TakeDirty(now_)) << "the world stands";

  const WorkersFile file = supervisor_.State("boot");
  Supervisor next(PortRange(7800, 8799), [](std::uint16_t) { return true; });
  next.AdoptGone(file.workers(0), "ended with the host", {});
  ASSERT_EQ(next.Exits().size(), 1U);
  EXPECT_EQ(next.Exits()[0].newest_tick(), 3610U);
  Supervisor later(PortRange(7800, 8799), [](std::uint16_t) { return true; });
  later.AdoptExit(next.State("boot").exits(0));
  EXPECT_EQ(later.Exits()[0].newest_tick(), 3610U);
  End(1, {.known = true, .signal = SIGKILL});
  EXPECT_EQ(exits_.back().newest_tick(), 3610U);
}

TEST_F(SupervisorTest, NextLifeAdoptsWhatLivesAndTellsWhatEnded) {
  Want({Order(1), Order(2), Order(3)});
  Attach(1);
  v1::WorkerReport running = Report(1, v1::WORKER_PHASE_RUNNING);
  running.mutable_address()->set_game_port(7800);
  supervisor_.TakeDirty(now_);
  supervisor_.Reported(Key(1), running);
  EXPECT_TRUE(supervisor_.TakeDirty(now_));
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

// A control plane that begins from a backup knows of a world what its hosts hold.
TEST_F(SupervisorTest, OrdersAreKeptAndTheNextLifeHoldsThemUntilThereAreNewerOnes) {
  v1::WorkerOrder ends = Order(2);
  ends.set_stop(true);
  Want({Order(1), Order(2), Order(3)});
  Want({Order(1, 5), ends, Order(3)});
  ASSERT_THAT(kept_, SizeIs(3));
  EXPECT_EQ(kept_[Key(1)].revision(), 5u);
  const WorkersFile file = supervisor_.State("boot");
  ASSERT_EQ(file.workers_size(), 3);

  Supervisor next(PortRange(7800, 8799), [](std::uint16_t) { return true; });
  next.Adopt(file.workers(0), kept_[Key(1)]);
  next.Adopt(file.workers(1), kept_[Key(2)]);
  next.Adopt(file.workers(2));
  ASSERT_EQ(next.HeldOrders().orders_size(), 1) << "one ends, of one nothing was kept";
  EXPECT_EQ(next.HeldOrders().orders(0).SerializeAsString(), kept_[Key(1)].SerializeAsString());
  v1::DesiredSet set;
  *set.add_workers() = Order(1, 7);
  next.Desired(set, now_);
  ASSERT_EQ(next.HeldOrders().orders_size(), 1);
  EXPECT_EQ(next.HeldOrders().orders(0).revision(), 7u);
}

TEST_F(SupervisorTest, NoOrderIsKeptOfAWorkerThatIsRefusedOrDoesNotStart) {
  spawn_error_ = "no such program";
  v1::WorkerOrder bad = Order(2);
  bad.set_instance_id("../../host");
  Want({Order(1), bad});
  EXPECT_THAT(kept_, IsEmpty());
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
