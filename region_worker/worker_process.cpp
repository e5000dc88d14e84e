#include "region_worker/worker_process.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <fstream>
#include <random>

#include "telemetry/http_get.h"

namespace tessera::worker {
namespace {

using Clock = std::chrono::steady_clock;

int MsLeft(Clock::time_point deadline) {
  const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(deadline - Clock::now()).count();
  return static_cast<int>(std::max<std::int64_t>(left, 0));
}

sockaddr_in Loopback(std::uint16_t port) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(port);
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  return address;
}

bool IsFree(std::uint16_t port, int type) {
  const int fd = socket(AF_INET, type | SOCK_CLOEXEC, 0);
  const sockaddr_in address = Loopback(port);
  const bool free = bind(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0;
  close(fd);
  return free;
}

}  // namespace

WorkerProcess::WorkerProcess(const std::vector<std::string>& arguments) {
  std::vector<std::string> all = {std::string(TESSERA_BINARY_DIR) + "/bin/tessera-region"};
  all.insert(all.end(), arguments.begin(), arguments.end());
  std::vector<char*> argv;
  argv.reserve(all.size() + 1);
  for (std::string& argument : all) argv.push_back(argument.data());
  argv.push_back(nullptr);
  int ends[2];
  if (pipe2(ends, O_CLOEXEC) != 0) return;
  pid_ = fork();
  if (pid_ == 0) {
    dup2(ends[1], STDERR_FILENO);
    execv(argv[0], argv.data());
    _exit(127);
  }
  close(ends[1]);
  stderr_ = ends[0];
  pidfd_ = static_cast<int>(syscall(SYS_pidfd_open, pid_, 0));
}

WorkerProcess::~WorkerProcess() {
  if (!status_) {
    Signal(SIGKILL);
    Wait();
  }
  close(stderr_);
  close(pidfd_);
  if (testing::Test::HasFailure()) std::fprintf(stderr, "--- worker %d said:\n%s", pid_, said_.c_str());
}

void WorkerProcess::Signal(int signal) const {
  if (!status_) kill(pid_, signal);
}

bool WorkerProcess::ReadMore(Clock::time_point deadline) {
  pollfd fd = {.fd = stderr_, .events = POLLIN, .revents = 0};
  if (poll(&fd, 1, MsLeft(deadline)) <= 0) return false;
  char buffer[4096];
  const ssize_t got = read(stderr_, buffer, sizeof buffer);
  if (got <= 0) return false;
  said_.append(buffer, static_cast<std::size_t>(got));
  return true;
}

bool WorkerProcess::WaitForLine(const std::string& text) {
  const auto deadline = Clock::now() + kPatience;
  while (said_.find(text) == std::string::npos) {
    if (!ReadMore(deadline)) return said_.find(text) != std::string::npos;
  }
  return true;
}

int WorkerProcess::Wait() {
  if (status_) return *status_;
  const auto deadline = Clock::now() + kPatience;
  while (ReadMore(deadline)) {
  }
  pollfd fd = {.fd = pidfd_, .events = POLLIN, .revents = 0};
  if (poll(&fd, 1, MsLeft(deadline)) <= 0) return -1;
  int raw = 0;
  waitpid(pid_, &raw, 0);
  status_ = WIFEXITED(raw) ? WEXITSTATUS(raw) : 128 + WTERMSIG(raw);
  return *status_;
}

std::string ScenePath(const std::string& name) {
  return std::string(TESSERA_SOURCE_DIR) + "/scenes/" + name + ".textproto";
}

std::string WriteTestFile(const std::string& name, const std::string& text) {
  const std::string path = testing::TempDir() + "tessera_worker_" + std::to_string(getpid()) + "_" + name;
  std::ofstream(path, std::ios::binary) << text;
  return path;
}

std::uint16_t FreeBasePort(std::uint32_t regions) {
  std::random_device random;
  for (int attempt = 0; attempt < 1000; ++attempt) {
    // Below the ports that the system chooses for others (32768 and up).
    const auto base = static_cast<std::uint16_t>(12'000 + random() % 20'000);
    bool free = true;
    for (std::uint32_t i = 0; free && i < 3 * regions; ++i) {
      const auto port = static_cast<std::uint16_t>(base + i);
      free = IsFree(port, SOCK_DGRAM) && IsFree(port, SOCK_STREAM);
    }
    if (free) return base;
  }
  ADD_FAILURE() << "no free ports";
  return 0;
}

std::string ReadMetrics(std::uint16_t port) {
  const auto answer = telemetry::HttpGet("127.0.0.1:" + std::to_string(port), "/metrics");
  if (!answer.ok() || answer->status != 200) {
    ADD_FAILURE() << (answer.ok() ? "status " + std::to_string(answer->status) : answer.status().ToString());
    return "";
  }
  return answer->body;
}

}  // namespace tessera::worker
