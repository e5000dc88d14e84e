#include "agent/process.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <linux/close_range.h>
#include <netinet/in.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iterator>
#include <sstream>
#include <utility>

#include "absl/strings/str_cat.h"

namespace tessera::agent {
namespace {

// What the child of Exec needs, prepared before vfork: between it and exec the child shares our memory, so it may only
// make system calls.
struct Launch {
  char* const* argv;
  char* const* environment;
  int log_fd, null_fd;
  bool die_with_parent;
  pid_t parent;
  volatile int error = 0;
};

[[noreturn]] void Exec(Launch& launch) {
  const auto fail = [&launch] {
    launch.error = errno;
    _exit(127);
  };
  setsid();
  if (launch.die_with_parent) {
    if (prctl(PR_SET_PDEATHSIG, SIGKILL) != 0) fail();
    if (getppid() != launch.parent) fail();  // it ended before the line above
  }
  if (dup2(launch.null_fd, STDIN_FILENO) < 0 || dup2(launch.log_fd, STDOUT_FILENO) < 0 ||
      dup2(launch.log_fd, STDERR_FILENO) < 0) {
    fail();
  }
  // Ours are all close-on-exec; this is for what a library or whoever started us left open.
  syscall(SYS_close_range, 3U, ~0U, CLOSE_RANGE_CLOEXEC);
  struct sigaction plain {};
  plain.sa_handler = SIG_DFL;
  for (const int signal : {SIGPIPE, SIGINT, SIGTERM, SIGHUP, SIGCHLD}) sigaction(signal, &plain, nullptr);
  sigset_t none;
  sigemptyset(&none);
  sigprocmask(SIG_SETMASK, &none, nullptr);
  execve(launch.argv[0], launch.argv, launch.environment);
  fail();
  __builtin_unreachable();
}

// The state letter and the fields after the command's name, which may itself hold blanks and parentheses.
std::optional<std::vector<std::string>> StatFields(pid_t pid) {
  std::ifstream in(absl::StrCat("/proc/", pid, "/stat"));
  std::string text((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
  const std::size_t name_end = text.rfind(')');
  if (name_end == std::string::npos) return std::nullopt;
  std::istringstream fields(text.substr(name_end + 1));
  return std::vector<std::string>(std::istream_iterator<std::string>(fields), std::istream_iterator<std::string>());
}

std::vector<char*> EnvironmentWithout(const std::vector<std::string>& names) {
  std::vector<char*> kept;
  for (char** variable = environ; *variable != nullptr; ++variable) {
    const std::string name(*variable, std::strcspn(*variable, "="));
    if (std::find(names.begin(), names.end(), name) == names.end()) kept.push_back(*variable);
  }
  kept.push_back(nullptr);
  return kept;
}

int PidfdOpen(pid_t pid) { return static_cast<int>(syscall(SYS_pidfd_open, pid, 0)); }

}  // namespace

absl::StatusOr<Process> Process::Spawn(const SpawnSpec& spec) {
  const int log_fd = open(spec.log_path.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0600);
  if (log_fd < 0) return absl::UnavailableError(absl::StrCat(spec.log_path, ": ", std::strerror(errno)));
  const int null_fd = open("/dev/null", O_RDONLY | O_CLOEXEC);
  std::vector<char*> argv;
  for (const std::string& argument : spec.argv) argv.push_back(const_cast<char*>(argument.c_str()));
  argv.push_back(nullptr);
  std::vector<char*> environment = EnvironmentWithout(spec.without_environment);
  Launch launch{argv.data(), environment.data(), log_fd, null_fd, spec.die_with_parent, getpid()};

  // vfork, not fork: no copy of our page tables and no fork handlers of libraries that own threads. Signals wait, so
  // that no handler of ours runs in the child while it shares our memory.
  sigset_t all, before;
  sigfillset(&all);
  pthread_sigmask(SIG_SETMASK, &all, &before);
  const pid_t pid = vfork();
  if (pid == 0) Exec(launch);
  const int fork_error = errno;
  pthread_sigmask(SIG_SETMASK, &before, nullptr);
  close(log_fd);
  close(null_fd);

  if (pid < 0) return absl::UnavailableError(absl::StrCat("cannot fork: ", std::strerror(fork_error)));
  if (launch.error != 0) {
    waitpid(pid, nullptr, 0);
    return absl::UnavailableError(absl::StrCat("cannot run ", spec.argv[0], ": ", std::strerror(launch.error)));
  }
  const int pidfd = PidfdOpen(pid);
  if (pidfd < 0) {
    const int error = errno;
    kill(pid, SIGKILL);  // ours and not reaped yet, so the pid is still its own
    waitpid(pid, nullptr, 0);
    return absl::UnavailableError(absl::StrCat("cannot watch ", spec.argv[0], ": ", std::strerror(error)));
  }
  return Process(pid, pidfd, ProcessStartTime(pid).value_or(0));
}

absl::StatusOr<Process> Process::Adopt(pid_t pid, std::uint64_t start_time) {
  if (pid <= 0) return absl::NotFoundError("no pid");
  const int pidfd = PidfdOpen(pid);
  if (pidfd < 0) return absl::NotFoundError(absl::StrCat("no process ", pid));
  Process process(pid, pidfd, start_time);
  // Asked after the pidfd is held: if this is our process, so is the pidfd.
  if (ProcessStartTime(pid) != start_time) return absl::NotFoundError(absl::StrCat("process ", pid, " is another one"));
  return process;
}

Process::Process(pid_t pid, int pidfd, std::uint64_t start_time) : pid_(pid), pidfd_(pidfd), start_time_(start_time) {}
Process::Process(Process&& other) noexcept
    : pid_(other.pid_), pidfd_(std::exchange(other.pidfd_, -1)), start_time_(other.start_time_) {}
Process& Process::operator=(Process&& other) noexcept {
  std::swap(pid_, other.pid_);
  std::swap(pidfd_, other.pidfd_);
  std::swap(start_time_, other.start_time_);
  return *this;
}
Process::~Process() {
  if (pidfd_ >= 0) close(pidfd_);
}

void Process::Signal(int signal) const { syscall(SYS_pidfd_send_signal, pidfd_, signal, nullptr, 0); }

ExitStatus Process::Reap() const {
  siginfo_t info{};
  if (waitid(P_PIDFD, static_cast<id_t>(pidfd_), &info, WEXITED) != 0) return {};  // ECHILD: adopted
  if (info.si_code == CLD_EXITED) return {.known = true, .code = info.si_status};
  return {.known = true, .signal = info.si_status};
}

std::optional<std::uint64_t> ProcessStartTime(pid_t pid) {
  const auto fields = StatFields(pid);
  // proc(5): the state is field 3, the start time field 22.
  if (!fields || fields->size() < 20 || fields->front() == "Z" || fields->front() == "X") return std::nullopt;
  return std::strtoull((*fields)[19].c_str(), nullptr, 10);
}

std::string BootId() {
  std::ifstream in("/proc/sys/kernel/random/boot_id");
  std::string id;
  std::getline(in, id);
  return id;
}

bool PortsFree(const std::string& address, std::uint16_t first) {
  sockaddr_in name{};
  name.sin_family = AF_INET;
  if (inet_pton(AF_INET, address.c_str(), &name.sin_addr) != 1) return true;  // a name: the worker finds out
  for (const int offset : {0, 1, 2}) {
    const int fd = socket(AF_INET, (offset < 2 ? SOCK_DGRAM : SOCK_STREAM) | SOCK_CLOEXEC, 0);
    const int on = 1;
    if (offset == 2)
      setsockopt(fd, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);  // as HTTP servers do: see past TIME_WAIT
    name.sin_port = htons(static_cast<std::uint16_t>(first + offset));
    const bool bound = bind(fd, reinterpret_cast<const sockaddr*>(&name), sizeof name) == 0;
    close(fd);
    if (!bound) return false;
  }
  return true;
}

}  // namespace tessera::agent
