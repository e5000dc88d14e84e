#include "agent/testing/agent_fixture.h"

#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstdlib>

#include "agent/supervisor.h"
#include "core/world/scene_io.h"

namespace tessera::agent {
namespace {

// Three ports a worker, well below the ephemeral range, and another place in it for each test process.
constexpr int kTestPorts = 90;
std::uint16_t FirstTestPort() { return static_cast<std::uint16_t>(10'000 + (getpid() % 200) * kTestPorts); }

}  // namespace

AgentFixture::AgentFixture() {
  prctl(PR_SET_CHILD_SUBREAPER, 1);  // workers that an agent leaves behind become ours to wait for
  state_dir_ = folder_ + "/state";
  first_port_ = FirstTestPort();
  port_range_ = std::to_string(first_port_) + "-" + std::to_string(first_port_ + kTestPorts - 1);
  setenv("FAKE_WORKER_GUARD", std::to_string(getpid()).c_str(), 1);
  for (const int region : {1, 2, 3, 4}) SetMode(region, "");

  v1::Scene scene;
  scene.set_name("for the agent's tests");
  scene_hash_ = SceneHash(scene);
  control_.Change([&](ControlRecord& record) { record.scenes[scene_hash_] = scene.SerializeAsString(); });
}

AgentFixture::~AgentFixture() {
  HoldWorkers();
  for (const host::Process& process : held_) process.Signal(SIGKILL);
  for (const host::Process& process : held_) {
    process.WaitUntilEnded(host::kTestPatience);
    waitpid(process.pid(), nullptr, WNOHANG);
  }
}

std::unique_ptr<host::WatchedProgram> AgentFixture::StartAgent(const std::vector<std::string>& extra,
                                                               const std::vector<std::string>& around) {
  const std::string bin = TESSERA_BINARY_DIR;
  const std::vector<std::pair<std::string, std::string>> usual = {
      {"--control", control_.address()},
      {"--state-dir", state_dir_},
      {"--metrics-listen", "127.0.0.1:0"},
      {"--port-range", port_range_},
      {"--region-binary", bin + "/tests/agent_fake_worker"}};
  std::vector<std::string> argv = around;
  argv.push_back(bin + "/bin/tessera-agent");
  for (const auto& [flag, value] : usual) {
    if (std::find(extra.begin(), extra.end(), flag) == extra.end()) argv.insert(argv.end(), {flag, value});
  }
  argv.insert(argv.end(), extra.begin(), extra.end());
  return std::make_unique<host::WatchedProgram>(argv);
}

std::unique_ptr<host::WatchedProgram> AgentFixture::StartAdmitted(const std::vector<std::string>& extra,
                                                                  const std::vector<std::string>& around) {
  std::vector<std::string> flags{"--join-token", "good-token"};
  flags.insert(flags.end(), extra.begin(), extra.end());
  auto agent = StartAgent(flags, around);
  EXPECT_TRUE(control_.WaitUntil([](const ControlRecord& r) { return r.streams == 1; })) << agent->Output();
  return agent;
}

void AgentFixture::SetMode(int region, const std::string& mode) {
  setenv(("FAKE_WORKER_" + std::to_string(region)).c_str(), mode.c_str(), 1);
}

v1::WorkerOrder AgentFixture::Order(std::uint32_t region, std::uint64_t revision, bool run) const {
  v1::WorkerOrder order;
  order.set_revision(revision);
  order.set_instance_id("inst-1");
  order.set_region(region);
  order.set_incarnation(100 + region);
  order.set_scene_hash(scene_hash_);
  order.set_instance_key(std::string(32, 'k'));
  order.set_certificate("certificate");
  order.set_run(run);
  return order;
}

bool AgentFixture::WaitForPhase(std::uint32_t region, v1::WorkerPhase phase) {
  return control_.WaitUntil([&](const ControlRecord& record) {
    const auto report = record.reports.find(region);
    return report != record.reports.end() && report->second.phase() == phase;
  });
}

bool AgentFixture::WaitForExits(std::size_t count) {
  return control_.WaitUntil([&](const ControlRecord& record) { return record.exits.size() >= count; });
}

std::vector<pid_t> AgentFixture::HoldWorkers() {
  std::vector<pid_t> pids;
  for (const auto& [region, report] : control_.record().reports) {
    const auto pid = static_cast<pid_t>(report.identity().pid());
    pids.push_back(pid);
    const bool known = std::any_of(held_.begin(), held_.end(), [&](const host::Process& p) { return p.pid() == pid; });
    const auto start_time = host::ProcessStartTime(pid);
    if (known || !start_time) continue;
    if (auto process = host::Process::Adopt(pid, *start_time); process.ok()) held_.push_back(*std::move(process));
  }
  return pids;
}

bool AgentFixture::WaitForWorkersToEnd() {
  return std::all_of(held_.begin(), held_.end(),
                     [](const host::Process& p) { return p.WaitUntilEnded(host::kTestPatience); });
}

bool AgentFixture::WorkersLive() const {
  return std::all_of(held_.begin(), held_.end(), [](const host::Process& p) { return host::IsAlive(p.pid()); });
}

}  // namespace tessera::agent
