// How an agent comes to a control plane, stays with it, and starts and ends: the real program.
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <csignal>
#include <filesystem>
#include <fstream>
#include <thread>

#include "agent/limits.h"
#include "agent/testing/agent_fixture.h"
#include "gmock/gmock.h"
#include "host/files.h"
#include "host/landlock.h"
#include "host/testing/hide_landlock.h"
#include "host/wait_readable.h"
#include "telemetry/http_get.h"

namespace tessera::agent {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::SizeIs;

class AgentAdmissionTest : public AgentFixture {
 protected:
  static std::size_t Count(const std::string& text, const std::string& what) {
    std::size_t count = 0;
    for (auto at = text.find(what); at != std::string::npos; at = text.find(what, at + 1)) ++count;
    return count;
  }
};

TEST_F(AgentAdmissionTest, TokenAdmitsOnceAndTheSecretFromThenOn) {
  const auto first = StartAdmitted({"--capacity", "5"});
  const v1::AgentHello hello = control_.record().hellos.at(0);
  EXPECT_EQ(hello.join_token(), "good-token");
  EXPECT_EQ(hello.advertise_address(), "127.0.0.1");
  EXPECT_EQ(hello.resources().region_capacity(), 5U);
  EXPECT_GT(hello.resources().memory_bytes(), 0U);
  EXPECT_GT(hello.metrics_port(), 0U);
  EXPECT_THAT(hello.boot_id(), SizeIs(36));
  ASSERT_TRUE(control_.WaitUntil([](const ControlRecord& r) { return r.heartbeats >= 3; }));
  struct stat info {};
  ASSERT_EQ(stat((state_dir_ + "/host.json").c_str(), &info), 0);
  EXPECT_EQ(info.st_mode & 0777U, 0600U);
  ASSERT_EQ(stat((state_dir_ + "/agent.sock").c_str(), &info), 0);
  EXPECT_EQ(info.st_mode & 0777U, 0600U);
  first->Signal(SIGTERM);
  EXPECT_EQ(first->Wait(), Exited(0));

  const auto second = StartAgent({"--join-token-file", folder_ + "/gone"});  // not needed any more
  ASSERT_TRUE(control_.WaitUntil([](const ControlRecord& r) { return r.hellos.size() == 2 && r.streams == 1; }));
  EXPECT_EQ(control_.record().hellos.at(1).join_token(), "");
  EXPECT_EQ(control_.record().hellos.at(1).host_id(), "host-1");
  for (const std::string& log : {first->Output(), second->Output()}) {
    EXPECT_THAT(log, Not(HasSubstr("good-token")));
    EXPECT_THAT(log, Not(HasSubstr("host-secret")));
  }
}

TEST_F(AgentAdmissionTest, WrongAndUsedTokensEndItWithTheControlPlanesWords) {
  const auto wrong = StartAgent({"--join-token", "bad-token"});
  EXPECT_EQ(wrong->Wait(), Exited(1));
  EXPECT_THAT(wrong->Output(), HasSubstr("refused this host: join token is unknown\n"));
  EXPECT_FALSE(std::filesystem::exists(state_dir_ + "/host.json"));
  control_.Change([](ControlRecord& r) { r.token_used = true; });
  const auto used = StartAgent({"--join-token", "good-token"});
  EXPECT_EQ(used->Wait(), Exited(1));
  EXPECT_THAT(used->Output(), HasSubstr("refused this host: join token has been used\n"));
}

// The control plane's part of it is HostsTest.AnAgentWhoseAnswerWasLostIsAdmittedByItsTokenAgain.
TEST_F(AgentAdmissionTest, ATokenIsShownUntilItsAnswerComes) {
  control_.Change([](ControlRecord& r) { r.lost_answers = 2; });
  const auto agent = StartAgent({"--join-token", "good-token"});
  ASSERT_TRUE(control_.WaitUntil([](const ControlRecord& r) { return r.heartbeats > 0; }));
  const std::vector<v1::AgentHello> hellos = control_.record().hellos;
  ASSERT_THAT(hellos, SizeIs(3));
  for (const v1::AgentHello& hello : hellos) EXPECT_EQ(hello.join_token(), "good-token");
}

TEST_F(AgentAdmissionTest, RemovedHostIsToldWhereItsIdentityLies) {
  const auto first = StartAdmitted();
  control_.Stop();
  control_.Change([](ControlRecord& r) { r.secret = "another"; });
  control_.Start();
  EXPECT_EQ(first->Wait(), Exited(1));
  EXPECT_THAT(first->Output(), HasSubstr("host id or secret is wrong (identity from " + state_dir_ + "/host.json"));
}

TEST_F(AgentAdmissionTest, UnreachableControlPlaneIsSaidOnceAndTriedUntilItIsThere) {
  control_.Stop();
  const auto agent = StartAgent({"--join-token", "good-token"});
  ASSERT_TRUE(agent->WaitForText("control plane away"));
  control_.Start();
  ASSERT_TRUE(control_.WaitUntil([](const ControlRecord& r) { return r.streams == 1; }));
  control_.Stop();
  control_.Change([](ControlRecord& r) { r.heartbeats = 0; });
  control_.Start();
  ASSERT_TRUE(control_.WaitUntil([](const ControlRecord& r) { return r.heartbeats > 0; }));
  agent->Signal(SIGINT);
  EXPECT_EQ(agent->Wait(), Exited(0));
  EXPECT_EQ(Count(agent->Output(), "control plane away"), 2U);
  EXPECT_EQ(Count(agent->Output(), "control plane connected"), 2U);
}

TEST_F(AgentAdmissionTest, UsageErrorsExitWith2AndOneLine) {
  const std::vector<std::pair<std::vector<std::string>, std::string>> cases = {
      {{"--control", "nonsense", "--join-token", "x"}, "--control \"nonsense\" is not of the form HOST:PORT"},
      {{"--no-such-flag"}, "--no-such-flag"},
      {{}, "has not been admitted yet"},
      {{"--join-token-file", "/no/file"}, "/host.json): --join-token-file /no/file: No such file or directory"},
      {{"--join-token", "x", "--state-dir", "/tmp/" + std::string(100, 'x')}, "choose a shorter --state-dir"},
      {{"--join-token", "x", "--log-level", "loud"}, "--log-level"},
  };
  for (const auto& [flags, line] : cases) {
    const auto agent = StartAgent(flags);
    EXPECT_EQ(agent->Wait(), Exited(2)) << line;
    EXPECT_THAT(agent->Output(), HasSubstr(line));
  }
}

TEST_F(AgentAdmissionTest, VersionIsPrinted) {
  const auto agent = StartAgent({"--version"});
  EXPECT_EQ(agent->Wait(), Exited(0));
  EXPECT_THAT(agent->Output(), HasSubstr("tessera-agent " TESSERA_VERSION));
}

TEST_F(AgentAdmissionTest, SecondAgentOnTheSameStateIsRefused) {
  const auto first = StartAdmitted();
  const auto second = StartAgent();
  EXPECT_EQ(second->Wait(), Exited(1));
  EXPECT_THAT(second->Output(), HasSubstr("another agent runs on state folder " + state_dir_));
  EXPECT_EQ(control_.record().streams, 1);
}

TEST_F(AgentAdmissionTest, MissingWorkerProgramIsSaidAtTheStart) {
  const auto agent = StartAgent({"--join-token", "x", "--region-binary", folder_ + "/none"});
  EXPECT_EQ(agent->Wait(), Exited(1));
  EXPECT_THAT(agent->Output(), HasSubstr(folder_ + "/none: No such file or directory; give --region-binary"));
}

TEST_F(AgentAdmissionTest, DamagedStateIsAnErrorThatNamesTheFile) {
  std::filesystem::create_directories(state_dir_);
  std::ofstream(state_dir_ + "/host.json") << "garbage";
  const auto agent = StartAgent();
  EXPECT_EQ(agent->Wait(), Exited(1));
  EXPECT_THAT(agent->Output(), HasSubstr(state_dir_ + "/host.json"));
}

TEST_F(AgentAdmissionTest, SystemdHearsReadyStatusAndStopping) {
  const std::string path = folder_ + "/notify";
  const int fd = socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  sockaddr_un name{};
  name.sun_family = AF_UNIX;
  path.copy(name.sun_path, sizeof name.sun_path - 1);
  ASSERT_EQ(bind(fd, reinterpret_cast<const sockaddr*>(&name), sizeof name), 0);
  setenv("NOTIFY_SOCKET", path.c_str(), 1);
  setenv("WATCHDOG_USEC", "20000", 1);
  std::string heard;
  const auto hear = [&](const std::string& text) {
    char buffer[512];
    while (heard.find(text) == std::string::npos && host::WaitReadable({fd}, host::kTestPatience)) {
      const ssize_t n = recv(fd, buffer, sizeof buffer, 0);
      heard.append(buffer, static_cast<std::size_t>(std::max<ssize_t>(n, 0))).append("\n");
    }
    return heard.find(text) != std::string::npos;
  };
  const auto agent = StartAgent({"--join-token", "good-token"});
  unsetenv("NOTIFY_SOCKET");
  unsetenv("WATCHDOG_USEC");
  EXPECT_TRUE(hear("READY=1\n"));
  EXPECT_TRUE(hear("STATUS=0 workers; control plane connected\n"));
  heard.clear();
  EXPECT_TRUE(hear("WATCHDOG=1\n"));
  EXPECT_TRUE(hear("WATCHDOG=1\n"));
  agent->Signal(SIGTERM);
  EXPECT_TRUE(hear("STOPPING=1\n"));
  EXPECT_EQ(agent->Wait(), Exited(0));
  close(fd);
}

TEST_F(AgentAdmissionTest, AKernelWithoutLandlockIsWarnedOfWhereWorkersAreToBeInASandbox) {
  constexpr char kWarning[] = "workers keep the files of this user missing=\"Landlock: ";
  std::thread on_such_a_kernel([&] {
    ASSERT_TRUE(host::HideLandlock());
    const auto warns = StartAdmitted();
    ASSERT_TRUE(warns->WaitForText("control plane connected")) << "or its successor has no identity";
    EXPECT_THAT(warns->Output(), HasSubstr(std::string(kWarning) + "Function not implemented\""));
    warns->Signal(SIGTERM);
    EXPECT_EQ(warns->Wait(), Exited(0));
    const auto without = StartAgent({"--worker-sandbox", "off"});
    ASSERT_TRUE(without->WaitForText("control plane connected"));
    EXPECT_THAT(without->Output(), Not(HasSubstr(kWarning))) << "nothing is missed";
    without->Signal(SIGTERM);
    EXPECT_EQ(without->Wait(), Exited(0));
  });
  on_such_a_kernel.join();
  if (!host::LandlockVersion().ok()) return;
  const auto agent = StartAgent();
  ASSERT_TRUE(agent->WaitForText("control plane connected"));
  EXPECT_THAT(agent->Output(), Not(HasSubstr(kWarning)));
}

TEST_F(AgentAdmissionTest, ReadyFileTellsWhereTheMetricsAreAndTheyCount) {
  const std::string ready = folder_ + "/ready.json";
  std::ofstream(ready) << "left over";
  const auto agent = StartAdmitted({"--ready-file", ready, "--stop-workers"});
  SetMode(2, "exit:1");
  control_.SetDesired({Order(1)});
  ASSERT_TRUE(WaitForPhase(1, v1::WORKER_PHASE_RUNNING));
  ASSERT_TRUE(control_.WaitUntil([](const ControlRecord& r) { return r.heartbeats >= 2; }));
  const std::string line = host::ReadFile(ready, kMaxStateFileBytes).value();
  const std::uint32_t port = control_.record().hellos.at(0).metrics_port();
  EXPECT_EQ(line, "{\"host_id\":\"host-1\",\"metrics\":\"127.0.0.1:" + std::to_string(port) +
                      "\",\"pid\":" + std::to_string(agent->pid()) + "}\n");
  const auto page = telemetry::HttpGet("127.0.0.1:" + std::to_string(port), "/metrics");
  ASSERT_TRUE(page.ok()) << page.status();
  const std::string& metrics = page->body;
  EXPECT_THAT(metrics, HasSubstr("\ntessera_agent_workers 1\n"));
  EXPECT_THAT(metrics, HasSubstr("\ntessera_agent_worker_starts_total 1\n"));
  EXPECT_THAT(metrics, HasSubstr("\ntessera_agent_control_connected 1\n"));
  EXPECT_THAT(metrics, Not(HasSubstr("\ntessera_agent_heartbeats_total 0\n")));
  for (const char* result : {"clean", "error", "signal"}) {
    EXPECT_THAT(metrics, HasSubstr("\ntessera_agent_worker_exits_total{result=\"" + std::string(result) + "\"} 0\n"));
  }
  EXPECT_THAT(metrics, HasSubstr("\nprocess_resident_memory_bytes "));
}

TEST_F(AgentAdmissionTest, AMetricsTokenIsAskedForAndItsFileIsGivenToWorkers) {
  const std::string token = "0123456789abcdef", path = folder_ + "/metrics.token";
  std::ofstream(path) << token << "\n";
  const auto agent = StartAdmitted({"--metrics-token-file", path});
  control_.SetDesired({Order(1)});
  ASSERT_TRUE(WaitForPhase(1, v1::WORKER_PHASE_RUNNING));
  const std::string address = "127.0.0.1:" + std::to_string(control_.record().hellos.at(0).metrics_port());
  EXPECT_EQ(telemetry::HttpGet(address, "/metrics").value().status, 401);
  EXPECT_EQ(telemetry::HttpGet(address, "/metrics", token).value().status, 200);
  const auto pid = control_.record().reports.at(1).identity().pid();
  const auto command_line = host::ReadFile("/proc/" + std::to_string(pid) + "/cmdline", 65536);
  ASSERT_TRUE(command_line.ok()) << command_line.status();
  EXPECT_THAT(*command_line, HasSubstr("--metrics-token-file" + std::string(1, '\0') + path));
  EXPECT_THAT(*command_line, Not(HasSubstr(token))) << "others on this machine see it";
}

TEST_F(AgentAdmissionTest, AMetricsCertificateThatIsNotThereEndsItByName) {
  const auto agent = StartAgent({"--join-token", "good-token", "--metrics-tls-cert", folder_ + "/none.pem",
                                 "--metrics-tls-key", folder_ + "/none.key"});
  EXPECT_EQ(agent->Wait(), Exited(2));
  EXPECT_THAT(agent->Output(), HasSubstr("--metrics-tls-cert "));
}

TEST_F(AgentAdmissionTest, AMetricsTokenFileThatIsNotThereEndsItByName) {
  const auto agent = StartAgent({"--join-token", "good-token", "--metrics-token-file", folder_ + "/none"});
  EXPECT_EQ(agent->Wait(), Exited(2));
  EXPECT_THAT(agent->Output(), HasSubstr("--metrics-token-file " + folder_ + "/none: "));
}

}  // namespace
}  // namespace tessera::agent
