// The agent and its workers: the real program and real processes.
#include <grpcpp/grpcpp.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <set>

#include "agent/limits.h"
#include "agent/testing/agent_fixture.h"
#include "core/game/game_file.h"
#include "gmock/gmock.h"
#include "host/files.h"
#include "telemetry/http_get.h"
#include "tessera/v1/scene.pb.h"
#include "tessera/v1/worker_link.grpc.pb.h"

namespace tessera::agent {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::SizeIs;

class AgentWorkersTest : public AgentFixture {
 protected:
  void RunFour() {
    control_.SetDesired({Order(1), Order(2), Order(3), Order(4)});
    for (const std::uint32_t region : {1U, 2U, 3U, 4U}) ASSERT_TRUE(WaitForPhase(region, v1::WORKER_PHASE_RUNNING));
    ASSERT_THAT(HoldWorkers(), SizeIs(4));
  }
};

TEST_F(AgentWorkersTest, DesiredSetBecomesProcessesWithOrdersAndBack) {
  const auto agent = StartAdmitted({"--stop-workers"});
  const auto begin = std::chrono::steady_clock::now();
  RunFour();
  const std::chrono::duration<double, std::milli> took = std::chrono::steady_clock::now() - begin;
  std::printf("four workers from desired to RUNNING: %.1f ms\n", took.count());
  RecordProperty("four_workers_ms", static_cast<int>(took.count()));

  const ControlRecord record = control_.record();
  std::set<std::uint32_t> ports;
  for (const auto& [region, report] : record.reports) {
    EXPECT_EQ(report.failure(), "");  // it found its scene and its certificate
    EXPECT_EQ(report.address().host(), "127.0.0.1");
    for (const auto port :
         {report.address().game_port(), report.address().link_port(), report.address().metrics_port()}) {
      EXPECT_GE(port, first_port_);
      EXPECT_TRUE(ports.insert(port).second);
    }
    const std::string arguments =
        host::ReadFile("/proc/" + std::to_string(report.identity().pid()) + "/cmdline", kMaxStateFileBytes).value();
    // At the agent's own metrics' address, whatever the address for players is.
    EXPECT_THAT(arguments, HasSubstr(std::string("--metrics-listen") + '\0' +
                                     "127.0.0.1:" + std::to_string(report.address().metrics_port())));
  }
  EXPECT_EQ(record.scene_fetches, 1);
  ASSERT_TRUE(control_.WaitUntil([](const ControlRecord& r) { return r.acted_on == 1; }));

  control_.SetDesired({Order(2), Order(3)});
  ASSERT_TRUE(WaitForExits(2));
  for (const v1::WorkerExited& exited : control_.record().exits) {
    EXPECT_THAT(exited.identity().region(), ::testing::AnyOf(1U, 4U));
    EXPECT_EQ(exited.exit_code(), 0);
    EXPECT_EQ(exited.signal(), 0);
  }
  EXPECT_THAT(agent->Output(), AllOf(HasSubstr("worker=inst-1/1#101 revision=1 outcome=\"starting on ports from"),
                                     HasSubstr("outcome=\"no longer wanted: stopping\"")));
}

// While a world starts, each worker that listens comes into the orders of all others.
TEST_F(AgentWorkersTest, LinesOfTheLogGrowWithWorkersAndNotWithOrders) {
  const auto agent = StartAdmitted({"--stop-workers"});
  RunFour();
  constexpr std::uint64_t kRevisions = 30;
  const auto orders = [&](std::uint64_t revision, const std::string& operation) {
    std::vector<v1::WorkerOrder> all;
    for (std::uint32_t region = 1; region <= 4; ++region) {
      v1::WorkerOrder& order = all.emplace_back(Order(region, revision));
      order.set_operation(operation);
      for (std::uint32_t port = 0; port < revision; ++port) order.add_peers()->set_game_port(1000 + port);
    }
    return all;
  };
  const auto await = [&](std::uint64_t revision) {
    return control_.WaitUntil([=](const ControlRecord& r) {
      return r.acted_on == revision &&
             std::ranges::all_of(r.reports, [=](const auto& one) { return one.second.order_revision() == revision; });
    });
  };
  for (std::uint64_t revision = 2; revision <= kRevisions; ++revision) {
    control_.SetDesired(orders(revision, ""));
    ASSERT_TRUE(await(revision));
  }
  const auto lines = [&](const std::string& text) {
    const std::string output = agent->Output();
    int count = 0;
    for (std::size_t at = output.find(text); at != std::string::npos; at = output.find(text, at + 1)) ++count;
    return count;
  };
  EXPECT_EQ(lines("order sent worker="), 4);
  EXPECT_EQ(lines("order from=control worker="), 4);
  EXPECT_EQ(lines("desired set from=control"), 1);
  control_.SetDesired(orders(kRevisions + 1, "1000012-7"));
  ASSERT_TRUE(await(kRevisions + 1));
  EXPECT_EQ(lines("order sent worker="), 8) << "somebody did something to the world";
  EXPECT_EQ(lines("desired set from=control"), 2);
}

// A sibling that was taken over knows all that a worker says of itself; the kernel says which process it is.
TEST_F(AgentWorkersTest, NobodySpeaksForAnotherWorker) {
  const auto agent = StartAdmitted({"--stop-workers"});
  control_.SetDesired({Order(1), Order(2)});
  for (const std::uint32_t region : {1U, 2U}) ASSERT_TRUE(WaitForPhase(region, v1::WORKER_PHASE_RUNNING));
  HoldWorkers();
  v1::WorkerMessage lie;
  *lie.mutable_report() = control_.record().reports.at(1);
  lie.mutable_report()->set_failure("so an impostor says");
  const auto stub = v1::WorkerLinkService::NewStub(
      grpc::CreateChannel("unix:" + state_dir_ + "/agent.sock", grpc::InsecureChannelCredentials()));
  grpc::ClientContext context;
  const auto stream = stub->Attach(&context);
  stream->Write(lie);
  v1::AgentOrder order;
  EXPECT_FALSE(stream->Read(&order)) << "it is given no order, and so no key";
  const grpc::Status refused = stream->Finish();
  EXPECT_EQ(refused.error_code(), grpc::StatusCode::NOT_FOUND);
  EXPECT_THAT(refused.error_message(), HasSubstr("is not worker inst-1/1#101"));
  // The worker itself is still attached, and heard.
  control_.SetDesired({Order(1, 2), Order(2)});
  ASSERT_TRUE(control_.WaitUntil([](const ControlRecord& r) { return r.reports.at(1).order_revision() == 2; }));
  EXPECT_EQ(control_.record().reports.at(1).failure(), "");
}

// As one that was taken over: it need not even say who it is.
TEST_F(AgentWorkersTest, AWorkerThatTalksWithoutEndIsCutOffAndOthersAreServed) {
  const auto agent = StartAdmitted({"--stop-workers"});
  control_.SetDesired({Order(1)});
  ASSERT_TRUE(WaitForPhase(1, v1::WORKER_PHASE_RUNNING));
  HoldWorkers();
  const auto stub = v1::WorkerLinkService::NewStub(
      grpc::CreateChannel("unix:" + state_dir_ + "/agent.sock", grpc::InsecureChannelCredentials()));
  grpc::ClientContext context;
  const auto stream = stub->Attach(&context);
  v1::WorkerMessage lease;
  lease.mutable_lease();
  int sent = 0;
  constexpr int kFlood = 200'000;
  while (sent < kFlood && stream->Write(lease)) ++sent;
  EXPECT_LT(sent, kFlood);
  EXPECT_EQ(stream->Finish().error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  control_.SetDesired({Order(1, 2)});
  ASSERT_TRUE(control_.WaitUntil([](const ControlRecord& r) { return r.reports.at(1).order_revision() == 2; }));
  const std::string address = "127.0.0.1:" + std::to_string(control_.record().hellos.at(0).metrics_port());
  EXPECT_THAT(telemetry::HttpGet(address, "/metrics").value().body,
              HasSubstr("tessera_agent_workers_cut_off_total 1\n"));
  EXPECT_THAT(agent->Output(), HasSubstr("worker cut off pid=" + std::to_string(getpid())));
}

// Its own folder is its only one: states of other worlds on the host are not for it.
TEST_F(AgentWorkersTest, EachWorkerIsToldItsSandbox) {
  const auto agent = StartAdmitted({"--stop-workers", "--worker-memory-mb", "5000"});
  control_.SetDesired({Order(1)});
  ASSERT_TRUE(WaitForPhase(1, v1::WORKER_PHASE_RUNNING));
  const std::string arguments =
      host::ReadFile("/proc/" + std::to_string(HoldWorkers().at(0)) + "/cmdline", kMaxStateFileBytes).value();
  const auto has = [](const std::string& option, const std::string& value) {
    return HasSubstr(std::string(1, '\0') + option + '\0' + value + '\0');
  };
  EXPECT_THAT(arguments, AllOf(has("--sandbox", "on"), has("--memory-mb", "5000"),
                               has("--writable", state_dir_ + "/states/inst-1-1-101"),
                               has("--readable", state_dir_ + "/scenes"), has("--readable", state_dir_ + "/games")));
  EXPECT_TRUE(std::filesystem::is_directory(state_dir_ + "/states/inst-1-1-101"));
  control_.SetDesired({});
  ASSERT_TRUE(WaitForExits(1));
  EXPECT_FALSE(std::filesystem::exists(state_dir_ + "/states/inst-1-1-101"));
}

TEST_F(AgentWorkersTest, AnOperatorMayDoWithoutTheSandbox) {
  const auto agent = StartAdmitted({"--stop-workers", "--worker-sandbox", "off"});
  control_.SetDesired({Order(1)});
  ASSERT_TRUE(WaitForPhase(1, v1::WORKER_PHASE_RUNNING));
  const std::string arguments =
      host::ReadFile("/proc/" + std::to_string(HoldWorkers().at(0)) + "/cmdline", kMaxStateFileBytes).value();
  EXPECT_THAT(arguments, AllOf(HasSubstr("--log-file"), Not(HasSubstr("--sandbox")), Not(HasSubstr("--memory-mb"))));
}

TEST_F(AgentWorkersTest, StopOrderEndsAWorkerInOrder) {
  const auto agent = StartAdmitted({"--stop-workers"});
  v1::WorkerOrder first = Order(1);
  first.set_operation("12-7");
  control_.SetDesired({first});
  ASSERT_TRUE(WaitForPhase(1, v1::WORKER_PHASE_RUNNING));
  v1::WorkerOrder stop = Order(1, 2);
  stop.set_stop(true);
  control_.SetDesired({stop});
  ASSERT_TRUE(WaitForExits(1));
  EXPECT_EQ(control_.record().exits[0].reason(), "exited with code 0");
  EXPECT_THAT(agent->Output(), HasSubstr("op=12-7"));
}

TEST_F(AgentWorkersTest, WorkerThatExitsAtItsStartIsReportedWithItsLastLines) {
  SetMode(1, "exit:7");
  const auto agent = StartAdmitted({"--stop-workers"});
  control_.SetDesired({Order(1)});
  ASSERT_TRUE(WaitForExits(1));
  const v1::WorkerExited exited = control_.record().exits[0];
  EXPECT_FALSE(exited.started());
  EXPECT_EQ(exited.exit_code(), 7);
  EXPECT_EQ(exited.reason(), "exited with code 7");
  EXPECT_THAT(exited.last_log_lines(), ElementsAre("start line 1", "start line 2", "start line 3"));
}

TEST_F(AgentWorkersTest, CrashIsReportedWithSignalAndTheLastTwentyLines) {
  SetMode(1, "abort");
  const auto agent = StartAdmitted({"--stop-workers"});
  control_.SetDesired({Order(1)});
  ASSERT_TRUE(WaitForExits(1));
  const v1::WorkerExited exited = control_.record().exits[0];
  EXPECT_TRUE(exited.started());
  EXPECT_EQ(exited.signal(), SIGABRT);
  EXPECT_EQ(exited.reason(), "killed by SIGABRT (Aborted)");
  ASSERT_EQ(exited.last_log_lines_size(), 20);
  EXPECT_EQ(exited.last_log_lines(0), "crash line 11");
  EXPECT_EQ(exited.last_log_lines(19), "crash line 30");
}

TEST_F(AgentWorkersTest, PortInUseIsTriedAgainOnOtherPorts) {
  SetMode(1, "busy-below:" + std::to_string(first_port_ + 9));
  const auto agent = StartAdmitted({"--stop-workers"});
  control_.SetDesired({Order(1)});
  ASSERT_TRUE(WaitForPhase(1, v1::WORKER_PHASE_RUNNING));
  EXPECT_GE(control_.record().reports.at(1).address().game_port(), first_port_ + 9U);
  EXPECT_THAT(control_.record().exits, SizeIs(0));
}

TEST_F(AgentWorkersTest, PortInUseEverywhereIsReportedWithTheRange) {
  SetMode(1, "exit:98");
  const auto agent = StartAdmitted({"--stop-workers"});
  control_.SetDesired({Order(1)});
  ASSERT_TRUE(WaitForExits(1));
  EXPECT_FALSE(control_.record().exits[0].started());
  EXPECT_EQ(control_.record().exits[0].reason(),
            "port in use: no three free ports in " + port_range_ + " after 16 attempts");
}

TEST_F(AgentWorkersTest, WorkerThatHangsAtItsStartIsKilledAndReported) {
  SetMode(1, "hang");
  const auto agent = StartAdmitted({"--stop-workers"});
  control_.SetDesired({Order(1)});
  ASSERT_TRUE(WaitForExits(1));
  EXPECT_FALSE(control_.record().exits[0].started());
  EXPECT_EQ(control_.record().exits[0].signal(), SIGKILL);
  EXPECT_EQ(control_.record().exits[0].reason(), "killed: did not attach within 10 s");
}

TEST_F(AgentWorkersTest, SceneThatDoesNotHashToItsNameIsRefused) {
  control_.Change([&](ControlRecord& record) { record.scenes[scene_hash_] = v1::Scene().SerializeAsString(); });
  const auto agent = StartAdmitted({"--stop-workers"});
  control_.SetDesired({Order(1)});
  ASSERT_TRUE(WaitForExits(1));
  EXPECT_THAT(control_.record().exits[0].reason(), HasSubstr("scene " + scene_hash_ + ": what the control plane sent"));
  EXPECT_FALSE(std::filesystem::exists(state_dir_ + "/scenes/" + scene_hash_ + ".pb"));
}

TEST_F(AgentWorkersTest, SceneThatWasDamagedOrDeletedIsFetchedAnew) {
  const auto agent = StartAdmitted({"--stop-workers"});
  const std::string path = state_dir_ + "/scenes/" + scene_hash_ + ".pb";
  control_.SetDesired({Order(1)});
  ASSERT_TRUE(WaitForPhase(1, v1::WORKER_PHASE_RUNNING));
  control_.SetDesired({});
  ASSERT_TRUE(WaitForExits(1));
  ASSERT_TRUE(host::WriteFile(path, "rust", host::Durability::kSurvivesProcess).ok());
  control_.SetDesired({Order(2)});
  ASSERT_TRUE(WaitForPhase(2, v1::WORKER_PHASE_RUNNING));
  EXPECT_EQ(control_.record().scene_fetches, 2);
  control_.SetDesired({});
  ASSERT_TRUE(WaitForExits(2));
  ASSERT_TRUE(std::filesystem::remove(path));
  control_.SetDesired({Order(3)});
  ASSERT_TRUE(WaitForPhase(3, v1::WORKER_PHASE_RUNNING));
  EXPECT_EQ(control_.record().scene_fetches, 3);
}

TEST_F(AgentWorkersTest, AControlPlaneOfAnEarlierReleaseGivesASceneInOneMessage) {
  control_.Change([](ControlRecord& record) { record.knows_no_streams = true; });
  const auto agent = StartAdmitted({"--stop-workers"});
  control_.SetDesired({Order(1)});
  ASSERT_TRUE(WaitForPhase(1, v1::WORKER_PHASE_RUNNING));
  EXPECT_EQ(control_.record().scene_fetches, 1);
}

TEST_F(AgentWorkersTest, UnknownSceneIsReportedAndTheCacheServesAKnownOneTwice) {
  const auto agent = StartAdmitted({"--stop-workers"});
  v1::WorkerOrder unknown = Order(1);
  unknown.set_scene_hash(std::string(64, '0'));
  control_.SetDesired({unknown});
  ASSERT_TRUE(WaitForExits(1));
  EXPECT_THAT(control_.record().exits[0].reason(), HasSubstr("no instance uses it"));
  control_.SetDesired({Order(2)});
  ASSERT_TRUE(WaitForPhase(2, v1::WORKER_PHASE_RUNNING));
  agent->Signal(SIGTERM);
  agent->Wait();
  const auto next = StartAgent({"--stop-workers"});
  control_.SetDesired({Order(3)});
  ASSERT_TRUE(WaitForPhase(3, v1::WORKER_PHASE_RUNNING));
  EXPECT_EQ(control_.record().scene_fetches, 2);  // one refused, one served
}

TEST_F(AgentWorkersTest, AGameIsFetchedOnceCheckedAndGivenToItsWorkers) {
  const std::string game = "function on_tick() end", hash = game::GameHash(game);
  control_.Change([&](ControlRecord& record) { record.games[hash] = game; });
  const auto with_game = [&](std::uint32_t region) {
    v1::WorkerOrder order = Order(region);
    order.set_game_hash(hash);
    order.set_game_name("game.lua");
    return order;
  };
  const auto agent = StartAdmitted({"--stop-workers"});
  control_.SetDesired({with_game(1), with_game(2)});
  ASSERT_TRUE(WaitForPhase(1, v1::WORKER_PHASE_RUNNING));
  ASSERT_TRUE(WaitForPhase(2, v1::WORKER_PHASE_RUNNING));
  EXPECT_EQ(control_.record().reports.at(1).failure(), "");
  EXPECT_EQ(control_.record().game_fetches, 1);
  const std::string path = state_dir_ + "/games/" + hash + ".game";
  EXPECT_EQ(host::ReadFile(path, game::kMaxGameFileBytes).value(), game);

  control_.SetDesired({});
  ASSERT_TRUE(WaitForExits(2));
  ASSERT_TRUE(host::WriteFile(path, "rust", host::Durability::kSurvivesProcess).ok());
  control_.Change([&](ControlRecord& record) { record.games[hash] = "another game"; });
  control_.SetDesired({with_game(3)});
  ASSERT_TRUE(WaitForExits(3));
  EXPECT_THAT(control_.record().exits[2].reason(),
              HasSubstr("game " + hash + ": what the control plane sent has hash " + game::GameHash("another game")));
}

TEST_F(AgentWorkersTest, SigtermLeavesWorkersAndTheNextAgentAdoptsThem) {
  const auto first = StartAdmitted();
  RunFour();
  const std::vector<pid_t> pids = HoldWorkers();
  first->Signal(SIGTERM);
  EXPECT_EQ(first->Wait(), Exited(0));
  EXPECT_TRUE(WorkersLive());

  control_.Change([](ControlRecord& r) { r.reports.clear(); });
  const auto second = StartAgent();
  for (const std::uint32_t region : {1U, 2U, 3U, 4U}) ASSERT_TRUE(WaitForPhase(region, v1::WORKER_PHASE_RUNNING));
  EXPECT_EQ(HoldWorkers(), pids);
  const v1::AgentHello hello = control_.record().hellos.back();
  ASSERT_EQ(hello.workers_size(), 4);
  for (const v1::WorkerReport& report : hello.workers()) {  // before the first of them has attached again
    EXPECT_EQ(report.phase(), v1::WORKER_PHASE_RUNNING);
    EXPECT_NE(report.address().game_port(), 0U);
  }
  EXPECT_THAT(control_.record().exits, SizeIs(0));

  // Adopted ones follow orders and are watched.
  control_.SetDesired({Order(1, 2), Order(2), Order(3)});
  ASSERT_TRUE(control_.WaitUntil([](const ControlRecord& r) { return r.exits.size() == 1; }));
  EXPECT_EQ(control_.record().exits[0].identity().region(), 4U);
  kill(pids[1], SIGKILL);  // not reaped: the test is its parent now
  ASSERT_TRUE(WaitForExits(2));
  EXPECT_THAT(control_.record().exits[1].reason(), HasSubstr("exit status is unknown"));
}

TEST_F(AgentWorkersTest, KilledAgentsWorkersAreAdoptedToo) {
  auto first = StartAdmitted({"--stop-workers"});  // which speaks of an end in order
  RunFour();
  const std::vector<pid_t> pids = HoldWorkers();
  first->Signal(SIGKILL);
  first->Wait();
  EXPECT_TRUE(WorkersLive());
  kill(pids[3], SIGKILL);  // while nobody looks
  control_.Change([](ControlRecord& r) { r.reports.clear(); });
  const auto second = StartAgent({"--stop-workers"});
  ASSERT_TRUE(WaitForExits(1));
  EXPECT_THAT(control_.record().exits[0].reason(), HasSubstr("ended while no agent ran"));
  for (const std::uint32_t region : {1U, 2U, 3U}) ASSERT_TRUE(WaitForPhase(region, v1::WORKER_PHASE_RUNNING));
  second->Signal(SIGTERM);  // --stop-workers ends adopted ones as well
  EXPECT_EQ(second->Wait(), Exited(0));
  EXPECT_TRUE(WaitForWorkersToEnd());
}

TEST_F(AgentWorkersTest, WorkersAreFoundByTheirProcessesWhereTheFileIsGoneOrCut) {
  auto agent = StartAdmitted({"--stop-workers"});
  RunFour();
  const std::vector<pid_t> pids = HoldWorkers();
  const std::string path = state_dir_ + "/workers.json", whole = host::ReadFile(path, kMaxStateFileBytes).value();
  for (const std::string& left : {std::string(), whole.substr(0, whole.size() / 2), std::string("no JSON")}) {
    agent->Signal(SIGKILL);
    agent->Wait();
    ASSERT_TRUE(std::filesystem::remove(path));
    if (!left.empty()) {
      ASSERT_TRUE(host::WriteFile(path, left, host::Durability::kSurvivesProcess).ok());
    }
    control_.Change([](ControlRecord& r) { r.reports.clear(); });
    agent = StartAgent({"--stop-workers"});
    for (const std::uint32_t region : {1U, 2U, 3U, 4U}) ASSERT_TRUE(WaitForPhase(region, v1::WORKER_PHASE_RUNNING));
    EXPECT_THAT(HoldWorkers(), ::testing::UnorderedElementsAreArray(pids)) << "none was started anew";
    EXPECT_THAT(control_.record().exits, SizeIs(0));
    EXPECT_THAT(agent->Output(), HasSubstr("worker found by its process worker=inst-1/1#101"));
    EXPECT_EQ(std::filesystem::exists(path + ".unreadable"), !left.empty());
  }
  control_.SetDesired({Order(1), Order(2)});
  ASSERT_TRUE(WaitForExits(2));  // those that are not wanted any more end in order
  for (const v1::WorkerExited& exited : control_.record().exits) EXPECT_GT(exited.identity().region(), 2u);
  agent->Signal(SIGTERM);
  EXPECT_EQ(agent->Wait(), Exited(0));
  EXPECT_TRUE(WaitForWorkersToEnd());
}

TEST_F(AgentWorkersTest, ControlPlaneAwayLeavesWorkersAloneAndItsReturnTellsAll) {
  const auto agent = StartAdmitted({"--stop-workers"});
  RunFour();
  const std::vector<pid_t> pids = HoldWorkers();
  control_.Stop();
  kill(pids[0], SIGKILL);
  ASSERT_TRUE(agent->WaitForText("worker ended worker=inst-1/1#101"));
  control_.Change([](ControlRecord& r) { r.reports.clear(); });
  control_.Start();
  ASSERT_TRUE(WaitForExits(1));  // sent on return
  EXPECT_EQ(control_.record().exits[0].signal(), SIGKILL);
  for (const std::uint32_t region : {2U, 3U, 4U}) ASSERT_TRUE(WaitForPhase(region, v1::WORKER_PHASE_RUNNING));
  EXPECT_EQ(HoldWorkers(), (std::vector<pid_t>{pids[1], pids[2], pids[3]}));
}

TEST_F(AgentWorkersTest, StopWorkersEndsAllBeforeItExitsAndTellsTheControlPlane) {
  const auto agent = StartAdmitted({"--stop-workers"});
  RunFour();
  agent->Signal(SIGTERM);
  EXPECT_EQ(agent->Wait(), Exited(0));
  EXPECT_FALSE(WorkersLive());
  ASSERT_TRUE(WaitForExits(4));
  for (const v1::WorkerExited& exited : control_.record().exits) EXPECT_EQ(exited.reason(), "exited with code 0");
}

TEST_F(AgentWorkersTest, StubbornWorkerIsKilledAfterItsTime) {
  SetMode(1, "stubborn");
  const auto agent = StartAdmitted({"--stop-workers"});
  control_.SetDesired({Order(1)});
  ASSERT_TRUE(WaitForPhase(1, v1::WORKER_PHASE_RUNNING));
  HoldWorkers();
  agent->Signal(SIGTERM);
  EXPECT_EQ(agent->Wait(), Exited(0));
  EXPECT_TRUE(WaitForWorkersToEnd());
  ASSERT_TRUE(WaitForExits(1));
  EXPECT_EQ(control_.record().exits[0].reason(), "killed: did not stop within 3 s of SIGTERM");
}

TEST_F(AgentWorkersTest, SecondSignalKillsAtOnce) {
  SetMode(1, "stubborn");
  const auto agent = StartAdmitted({"--stop-workers"});
  control_.SetDesired({Order(1)});
  ASSERT_TRUE(WaitForPhase(1, v1::WORKER_PHASE_RUNNING));
  HoldWorkers();
  agent->Signal(SIGTERM);
  ASSERT_TRUE(agent->WaitForText("stop=true"));
  agent->Signal(SIGTERM);
  EXPECT_EQ(agent->Wait(), Exited(0));
  ASSERT_TRUE(WaitForExits(1));
  EXPECT_EQ(control_.record().exits[0].reason(), "killed: ordered to stop at once");
}

TEST_F(AgentWorkersTest, WorkersOfAnAgentThatDiesWithItsParentDieWithItEvenWhenItIsKilled) {
  const auto agent = StartAdmitted({"--die-with-parent"});
  RunFour();
  agent->Signal(SIGKILL);
  agent->Wait();
  EXPECT_TRUE(WaitForWorkersToEnd());
}

TEST_F(AgentWorkersTest, AgentThatDiesWithItsParentEndsItsWorkersInOrder) {
  // A shell is the parent: it starts the agent, prints its pid, and is killed.
  const std::string bin = TESSERA_BINARY_DIR;
  const std::string command = bin + "/bin/tessera-agent --control " + control_.address() + " --state-dir " +
                              state_dir_ + " --metrics-listen 127.0.0.1:0 --port-range " + port_range_ +
                              " --region-binary " + bin +
                              "/tests/agent_fake_worker --join-token good-token --stop-workers --die-with-parent";
  const host::WatchedProgram shell({"/bin/sh", "-c", command + " & echo agent $!.; wait"});
  RunFour();
  const std::string log = shell.Output();
  const auto pid = static_cast<pid_t>(std::strtol(log.c_str() + log.find("agent ") + 6, nullptr, 10));
  const auto agent = host::Process::Adopt(pid, host::ProcessStartTime(pid).value());
  ASSERT_TRUE(agent.ok()) << log;
  shell.Signal(SIGKILL);
  EXPECT_TRUE(WaitForWorkersToEnd());
  EXPECT_TRUE(agent->WaitUntilEnded(host::kTestPatience));
  ASSERT_TRUE(WaitForExits(4));
  for (const v1::WorkerExited& exited : control_.record().exits) EXPECT_EQ(exited.reason(), "exited with code 0");
}

}  // namespace
}  // namespace tessera::agent
