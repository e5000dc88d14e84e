#include "local_cluster/child_process.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/inotify.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <deque>
#include <filesystem>
#include <fstream>

#include "local_cluster/command_error.h"

namespace tessera::local {
namespace {

using Clock = std::chrono::steady_clock;

int MillisUntil(Clock::time_point deadline) {
  const auto left = std::chrono::ceil<std::chrono::milliseconds>(deadline - Clock::now()).count();
  return static_cast<int>(std::max<std::int64_t>(left, 0));
}

int OpenToAppend(const std::string& file) {
  const int fd = open(file.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0600);
  if (fd < 0) throw CommandError(fmt::format("{}: {}", file, std::strerror(errno)));
  return fd;
}

// Between fork and exec: only async-signal-safe calls.
[[noreturn]] void Exec(char* const* argv, int output_fd, int log_fd, int error_fd, pid_t parent) {
  prctl(PR_SET_PDEATHSIG, SIGTERM);
  if (getppid() != parent) _exit(127);
  dup2(output_fd, STDOUT_FILENO);
  dup2(log_fd, STDERR_FILENO);
  const int null_fd = open("/dev/null", O_RDONLY);
  dup2(null_fd, STDIN_FILENO);
  sigset_t none;
  sigemptyset(&none);
  sigprocmask(SIG_SETMASK, &none, nullptr);
  execv(argv[0], argv);
  const int error = errno;
  [[maybe_unused]] const ssize_t written = write(error_fd, &error, sizeof error);
  _exit(127);
}

}  // namespace

std::string ExitStatus::Describe() const {
  return signal != 0 ? fmt::format("signal {}", signal) : fmt::format("exit status {}", code);
}

ChildProcess::ChildProcess(const std::vector<std::string>& argv, const std::string& log_file,
                           const std::string& output_file) {
  const int log_fd = OpenToAppend(log_file);
  const int output_fd = OpenToAppend(output_file.empty() ? log_file : output_file);
  std::array<int, 2> error_pipe{};
  if (pipe2(error_pipe.data(), O_CLOEXEC) != 0) throw CommandError(fmt::format("pipe: {}", std::strerror(errno)));
  std::vector<char*> raw;
  raw.reserve(argv.size() + 1);
  for (const std::string& argument : argv) raw.push_back(const_cast<char*>(argument.c_str()));
  raw.push_back(nullptr);
  const pid_t parent = getpid();
  pid_ = fork();
  if (pid_ == 0) Exec(raw.data(), output_fd, log_fd, error_pipe[1], parent);
  close(output_fd);
  close(log_fd);
  close(error_pipe[1]);
  int error = pid_ < 0 ? errno : 0;
  if (pid_ > 0 && read(error_pipe[0], &error, sizeof error) <= 0) error = 0;
  close(error_pipe[0]);
  if (error != 0) {
    if (pid_ > 0) waitpid(pid_, nullptr, 0);
    pid_ = -1;
    throw CommandError(fmt::format("cannot start {}: {}", argv.front(), std::strerror(error)));
  }
  pidfd_ = static_cast<int>(syscall(SYS_pidfd_open, pid_, 0));
}

ChildProcess::~ChildProcess() {
  if (pid_ > 0) End(std::chrono::seconds(10));
  if (pidfd_ >= 0) close(pidfd_);
}

std::optional<ExitStatus> ChildProcess::Wait(std::chrono::milliseconds timeout) {
  if (ended_) return ended_;
  const auto deadline = Clock::now() + timeout;
  pollfd watch{pidfd_, POLLIN, 0};
  while (poll(&watch, 1, MillisUntil(deadline)) < 0 && errno == EINTR) {
  }
  int status = 0;
  if (waitpid(pid_, &status, WNOHANG) != pid_) return std::nullopt;
  ended_ = WIFSIGNALED(status) ? ExitStatus{0, WTERMSIG(status)} : ExitStatus{WEXITSTATUS(status), 0};
  return ended_;
}

void ChildProcess::Signal(int signal) const {
  if (!ended_) kill(pid_, signal);
}

ExitStatus ChildProcess::End(std::chrono::milliseconds patience) {
  Signal(SIGTERM);
  if (const auto status = Wait(patience)) return *status;
  Signal(SIGKILL);
  while (!Wait(std::chrono::seconds(1))) {
  }
  return *ended_;
}

bool ChildProcess::WaitForFile(const std::string& path, std::chrono::milliseconds timeout) {
  const auto deadline = Clock::now() + timeout;
  const int events = inotify_init1(IN_CLOEXEC | IN_NONBLOCK);
  inotify_add_watch(events, std::filesystem::path(path).parent_path().c_str(),
                    IN_MOVED_TO | IN_CREATE | IN_CLOSE_WRITE);
  bool found = false;
  while (!(found = std::filesystem::exists(path)) && !Wait(std::chrono::milliseconds(0)) && Clock::now() < deadline) {
    std::array<pollfd, 2> watch{pollfd{events, POLLIN, 0}, pollfd{pidfd_, POLLIN, 0}};
    poll(watch.data(), watch.size(), MillisUntil(deadline));
    std::array<char, 4096> ignored;
    while (read(events, ignored.data(), ignored.size()) > 0) {
    }
  }
  close(events);
  return found;
}

std::string LastLines(const std::string& file, int count) {
  std::ifstream in(file);
  std::deque<std::string> lines;
  for (std::string line; std::getline(in, line);) {
    lines.push_back(line);
    if (static_cast<int>(lines.size()) > count) lines.pop_front();
  }
  std::string out;
  for (const std::string& line : lines) out += "\n  " + line;
  return out;
}

bool IsAlive(std::int64_t pid) {
  std::ifstream in(fmt::format("/proc/{}/stat", pid));
  std::string text;
  std::getline(in, text, '\0');  // fails, and does not throw, where the process ends between opening and reading
  const auto name_ends = text.rfind(')');  // proc(5): the state comes after the name in parentheses
  return name_ends != std::string::npos && text.size() > name_ends + 2 && text[name_ends + 2] != 'Z';
}

}  // namespace tessera::local
