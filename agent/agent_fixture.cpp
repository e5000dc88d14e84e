#include "agent/agent_fixture.h"

#include <poll.h>
#include <sys/inotify.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <filesystem>

#include "agent/state_dir.h"
#include "agent/supervisor.h"
#include "core/world/scene_io.h"

namespace tessera::agent {
namespace {

// Three ports a worker, well below the ephemeral range, and another place in it for each test process.
constexpr int kTestPorts = 90;
std::uint16_t FirstTestPort() { return static_cast<std::uint16_t>(10'000 + (getpid() % 200) * kTestPorts); }

}  // namespace

void PrintTo(const ExitStatus& status, std::ostream* out) { *out << Describe(status); }

bool WaitReadable(int fd, std::chrono::milliseconds patience) {
  const auto deadline = std::chrono::steady_clock::now() + patience;
  pollfd watch{fd, POLLIN, 0};
  for (;;) {
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(deadline - std::chrono::steady_clock::now());
    const int got = poll(&watch, 1, static_cast<int>(std::max<std::int64_t>(left.count(), 0)));
    if (got > 0) return true;
    if (got == 0 || errno != EINTR) return false;
  }
}

Program::Program(std::vector<std::string> argv, std::string log_path) : log_path_(std::move(log_path)) {
  auto process = Process::Spawn({.argv = std::move(argv), .log_path = log_path_, .die_with_parent = true});
  EXPECT_TRUE(process.ok()) << process.status();
  process_ = *std::move(process);
}

Program::~Program() {
  if (ended_) return;
  Signal(SIGKILL);
  Wait();
}

ExitStatus Program::Wait() {
  if (ended_) return *ended_;
  const bool ended = WaitReadable(process_->pidfd());
  EXPECT_TRUE(ended) << "did not end:\n" << Log();
  if (!ended) Signal(SIGKILL);
  ended_ = process_->Reap();
  return *ended_;
}

std::string Program::Log() const { return ReadFile(log_path_).value_or(""); }

bool Program::WaitForLog(const std::string& text) const {
  const int events = inotify_init1(IN_CLOEXEC | IN_NONBLOCK);
  inotify_add_watch(events, log_path_.c_str(), IN_MODIFY);
  const auto deadline = std::chrono::steady_clock::now() + kTestPatience;
  bool found = false;
  while (!(found = Log().find(text) != std::string::npos) && std::chrono::steady_clock::now() < deadline) {
    if (!WaitReadable(events)) break;
    std::array<char, 4096> ignored;
    while (read(events, ignored.data(), ignored.size()) > 0) {
    }
  }
  close(events);
  return found;
}

AgentFixture::AgentFixture() {
  prctl(PR_SET_CHILD_SUBREAPER, 1);  // workers that an agent leaves behind become ours to wait for
  std::string pattern = std::filesystem::temp_directory_path().string() + "/tessera-agent-XXXXXX";
  folder_ = mkdtemp(pattern.data());
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
  for (const Process& process : held_) process.Signal(SIGKILL);
  for (const Process& process : held_) {
    WaitReadable(process.pidfd());
    waitpid(process.pid(), nullptr, WNOHANG);
  }
  std::error_code ignored;
  std::filesystem::remove_all(folder_, ignored);
}

std::unique_ptr<Program> AgentFixture::StartAgent(const std::vector<std::string>& extra) {
  const std::string bin = TESSERA_BINARY_DIR;
  const std::vector<std::pair<std::string, std::string>> usual = {
      {"--control", control_.address()},
      {"--state-dir", state_dir_},
      {"--metrics-listen", "127.0.0.1:0"},
      {"--port-range", port_range_},
      {"--region-binary", bin + "/tests/agent_fake_worker"}};
  std::vector<std::string> argv{bin + "/bin/tessera-agent"};
  for (const auto& [flag, value] : usual) {
    if (std::find(extra.begin(), extra.end(), flag) == extra.end()) argv.insert(argv.end(), {flag, value});
  }
  argv.insert(argv.end(), extra.begin(), extra.end());
  return std::make_unique<Program>(argv, folder_ + "/agent-" + std::to_string(++starts_) + ".log");
}

std::unique_ptr<Program> AgentFixture::StartAdmitted(const std::vector<std::string>& extra) {
  std::vector<std::string> flags{"--join-token", "good-token"};
  flags.insert(flags.end(), extra.begin(), extra.end());
  auto agent = StartAgent(flags);
  EXPECT_TRUE(control_.WaitUntil([](const ControlRecord& r) { return r.streams == 1; })) << agent->Log();
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
  order.set_instance_key("TOP-SECRET-INSTANCE-KEY-32-BYTES");
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
    const bool known = std::any_of(held_.begin(), held_.end(), [&](const Process& p) { return p.pid() == pid; });
    const auto start_time = ProcessStartTime(pid);
    if (known || !start_time) continue;
    if (auto process = Process::Adopt(pid, *start_time); process.ok()) held_.push_back(*std::move(process));
  }
  return pids;
}

bool AgentFixture::WaitForWorkersToEnd() {
  return std::all_of(held_.begin(), held_.end(), [](const Process& p) { return WaitReadable(p.pidfd()); });
}

bool AgentFixture::WorkersLive() const {
  return std::all_of(held_.begin(), held_.end(),
                     [](const Process& p) { return ProcessStartTime(p.pid()).has_value(); });
}

}  // namespace tessera::agent
