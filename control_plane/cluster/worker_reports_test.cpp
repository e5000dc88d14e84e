// Agents' messages about workers, on entries alone.
#include "control_plane/cluster/worker_reports.h"

#include <gmock/gmock.h>

#include "control_plane/control_settings.h"
#include "control_plane/testing/state_rig.h"
#include "net/credential.h"

namespace tessera::control {
namespace {

using ::testing::IsEmpty;
using ::testing::UnorderedElementsAre;

class WorkerReportsTest : public ::testing::Test {
 protected:
  v1::WorkerReport ReportOf(std::uint32_t region) {
    WorkerEntry& worker = StateRig::WorkerOf(instance_, region);
    v1::WorkerReport report = worker.report;
    *report.mutable_identity() = StateRig::IdentityOf(instance_, worker);
    report.mutable_address()->set_link_port(1);
    return report;
  }
  InstanceNumbers Take(const v1::WorkerReport& report) {
    InstanceNumbers touched;
    (void)reports_.Take(alpha_, report, touched, rig_.now);
    return touched;
  }
  InstanceNumbers Heartbeat(const ReportList& named, std::optional<std::uint64_t> acted_revision) {
    InstanceNumbers touched;
    reports_.NoticeAbsent(alpha_, named, acted_revision, touched);
    return touched;
  }

  StateRig rig_;
  HostEntry& alpha_ = rig_.AddHost("alpha");
  InstanceEntry& instance_ = rig_.AddRunning({&alpha_, &alpha_});
  WorkerReports reports_{*rig_.state};
};

TEST_F(WorkerReportsTest, AnAddressThatIsNewGoesIntoAllOrders) {
  v1::WorkerReport report = ReportOf(1);
  report.mutable_address()->set_game_port(30000);
  EXPECT_THAT(Take(report), UnorderedElementsAre(instance_.number));
  EXPECT_TRUE(alpha_.desired_changed);
  EXPECT_EQ(instance_.workers[0].report.address().game_port(), 30000U);
  alpha_.desired_changed = false;
  EXPECT_THAT(Take(report), IsEmpty()) << "nothing new";
  report.mutable_address()->set_game_port(1 << 20);
  Take(report);
  EXPECT_FALSE(instance_.workers[0].bound()) << "that is no port";
}

TEST_F(WorkerReportsTest, TheNewestTickIsKeptWhenTheWorkerThatToldItIsGone) {
  v1::WorkerReport report = ReportOf(1);
  report.set_tick(184);
  Take(report);
  report = ReportOf(2);
  report.set_tick(183);
  Take(report);
  EXPECT_EQ(instance_.newest_tick, 184U);
}

// The control plane may have begun anew with all workers gone; then it is all that is known.
TEST_F(WorkerReportsTest, ATickThatAnAgentHadKeptCountsWhereNoWorkerToldANewerOne) {
  const auto end = [&](std::uint32_t region, std::uint64_t tick) {
    v1::WorkerExited exited;
    *exited.mutable_identity() = ReportOf(region).identity();
    exited.set_started(true);
    exited.set_newest_tick(tick);
    InstanceNumbers touched;
    EXPECT_TRUE(reports_.TakeExit(alpha_, exited, touched));
  };
  v1::WorkerReport report = ReportOf(2);
  report.set_tick(184);
  Take(report);
  end(1, 150);
  EXPECT_EQ(instance_.newest_tick, 184U);
  EXPECT_FALSE(instance_.newest_tick_is_kept);
  end(2, 190);
  EXPECT_EQ(instance_.newest_tick, 190U);
  EXPECT_TRUE(instance_.newest_tick_is_kept);
  end(1, 200);
  EXPECT_EQ(instance_.newest_tick, 200U) << "also of one that was known to be gone";
}

TEST_F(WorkerReportsTest, MessagesAboutOthersWorkersAreIgnored) {
  v1::WorkerReport report = ReportOf(1);
  report.mutable_identity()->set_incarnation(99);
  EXPECT_THAT(Take(report), IsEmpty());
  HostEntry& beta = rig_.AddHost("beta");
  InstanceNumbers touched;
  EXPECT_FALSE(reports_.Take(beta, ReportOf(1), touched, rig_.now));
  v1::WorkerExited exited;
  *exited.mutable_identity() = ReportOf(1).identity();
  EXPECT_FALSE(reports_.TakeExit(beta, exited, touched));
  EXPECT_TRUE(reports_.TakeExit(alpha_, exited, touched));
  EXPECT_TRUE(instance_.workers[0].gone);
}

TEST_F(WorkerReportsTest, AKeyIsCertifiedUntilItsWorkerListens) {
  WorkerEntry& worker = instance_.workers[0];
  worker.report.Clear();  // as before its first report
  EXPECT_TRUE(worker.certificate.empty());
  const auto certified = [&] {
    const auto read = net::ReadWorkerCertificate(
        {reinterpret_cast<const std::uint8_t*>(worker.certificate.data()), worker.certificate.size()},
        instance_.record.id(), instance_.key.verification_key());
    EXPECT_TRUE(read.ok()) << read.status();
    EXPECT_EQ(read->region, RegionId(worker.region));
    EXPECT_EQ(read->incarnation, Incarnation(worker.incarnation));
    return std::string(read->key.begin(), read->key.end());
  };
  const auto take = [&](char key, v1::WorkerPhase phase) {
    v1::WorkerReport report = ReportOf(1);
    report.set_phase(phase);
    report.set_public_key(std::string(32, key));
    if (phase >= v1::WORKER_PHASE_BOUND) report.mutable_address()->set_game_port(30000);
    Take(report);
  };
  alpha_.desired_changed = false;
  take('a', v1::WORKER_PHASE_LOADING);
  EXPECT_EQ(certified(), std::string(32, 'a'));
  EXPECT_TRUE(alpha_.desired_changed) << "its order has it now";
  alpha_.desired_changed = false;
  take('a', v1::WORKER_PHASE_LOADING);
  EXPECT_FALSE(alpha_.desired_changed);
  take('b', v1::WORKER_PHASE_LOADING);
  EXPECT_EQ(certified(), std::string(32, 'b')) << "its port was in use, and it was started again";
  take('b', v1::WORKER_PHASE_BOUND);
  take('c', v1::WORKER_PHASE_BOUND);
  EXPECT_EQ(certified(), std::string(32, 'b')) << "two processes are not one life of a region";
}

TEST_F(WorkerReportsTest, AKeyOfAnotherHostsWorkerIsNotCertified) {
  HostEntry& beta = rig_.AddHost("beta");
  v1::WorkerReport report = ReportOf(1);
  report.set_public_key(std::string(32, 'x'));
  InstanceNumbers touched;
  EXPECT_FALSE(reports_.Take(beta, report, touched, rig_.now));
  EXPECT_TRUE(instance_.workers[0].certificate.empty());
  report = ReportOf(1);
  report.mutable_identity()->set_incarnation(99);
  report.set_public_key(std::string(32, 'x'));
  Take(report);
  EXPECT_TRUE(instance_.workers[0].certificate.empty());
}

TEST_F(WorkerReportsTest, WhyAWorkerFailedIsSaidOnce) {
  const auto end = [&](std::uint32_t region, const std::string& reason) {
    v1::WorkerReport report = ReportOf(region);
    report.set_failure("game.lua:2: no");
    Take(report);
    v1::WorkerExited exited;
    *exited.mutable_identity() = report.identity();
    exited.set_started(true);
    exited.set_reason(reason);
    InstanceNumbers touched;
    EXPECT_TRUE(reports_.TakeExit(alpha_, exited, touched));
    return StateRig::WorkerOf(instance_, region).ending;
  };
  EXPECT_EQ(end(1, "exited with code 1: game.lua:2: no"), "worker exited with code 1: game.lua:2: no");
  EXPECT_EQ(end(2, "exited with code 1"), "worker exited with code 1: game.lua:2: no");
}

TEST_F(WorkerReportsTest, AWorkerThatIsNamedNoLongerHasDiedUnseen) {
  ReportList named;
  *named.Add() = ReportOf(2);
  for (int i = 1; i < kMissedBeforeVanished; ++i) {
    EXPECT_THAT(Heartbeat(named, 1), IsEmpty());
    EXPECT_FALSE(instance_.workers[0].gone);
  }
  EXPECT_THAT(Heartbeat(named, 1), UnorderedElementsAre(instance_.number));
  EXPECT_TRUE(instance_.workers[0].gone);
  EXPECT_FALSE(instance_.workers[1].gone);
}

TEST_F(WorkerReportsTest, OneThatItsAgentDoesNotKnowOfYetIsNotMissed) {
  WorkerEntry& newcomer = instance_.workers[0];
  ReportList named;
  *named.Add() = ReportOf(2);
  for (const std::uint64_t asked_in : {kUnasked, std::uint64_t{7}}) {
    newcomer.asked_in = asked_in;
    for (int i = 0; i < 2 * kMissedBeforeVanished; ++i) EXPECT_THAT(Heartbeat(named, 6), IsEmpty());
    EXPECT_EQ(newcomer.missed, 0) << "its order would be held back";
  }
  Heartbeat(named, 7);
  EXPECT_EQ(newcomer.missed, 1);
}

// Its agent may have begun it and lost it, and been begun again since.
TEST_F(WorkerReportsTest, OneThatAnAgentWasToldOfBeforeItSaidHelloIsMissed) {
  instance_.workers[0].asked_in = 7;
  instance_.workers[1].asked_in = kUnasked;
  Heartbeat({}, std::nullopt);
  EXPECT_EQ(instance_.workers[0].missed, 1);
  EXPECT_EQ(instance_.workers[1].missed, 0);
  Heartbeat({}, 0);
  EXPECT_EQ(instance_.workers[0].missed, 2);
}

TEST_F(WorkerReportsTest, OneThatWasToEndHasEndedWhenItsAgentHasActedOnThat) {
  records::Instance next = instance_.record;
  next.set_state(v1::INSTANCE_STATE_STOPPING);
  ASSERT_TRUE(rig_.state->StoreInstance(instance_, next).ok());
  for (WorkerEntry& worker : instance_.workers) worker.ended_in = 7;
  EXPECT_THAT(Heartbeat({}, 6), IsEmpty());
  EXPECT_THAT(Heartbeat({}, 7), UnorderedElementsAre(instance_.number));
  EXPECT_TRUE(instance_.workers[0].gone && instance_.workers[1].gone);
}

}  // namespace
}  // namespace tessera::control
