#include "host/process.h"

#include <fcntl.h>
#include <linux/close_range.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <utility>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "host/files.h"
#include "host/log_rotation.h"
#include "host/wait_readable.h"

namespace tessera::host {
namespace {

constexpr std::size_t kMaxProcBytes = 1 << 16;  // a file of /proc/PID is far smaller

// Everything that the child needs between vfork and exec. It may share our memory until exec, so it may only make
// system calls.
struct Launch {
  char* const* argv;
  char* const* environment;
  int input_fd, output_fd, error_fd;
  int parent_death_signal;
  pid_t parent;
  int report_fd;  // takes the child's errno; closed by exec
  int cgroup_fd;  // takes who is to be in the group; -1: it stays in ours
};

[[noreturn]] void Exec(const Launch& launch) {
  const auto fail = [&launch] {
    const int error = errno;
    (void)!write(launch.report_fd, &error, sizeof error);
    _exit(127);
  };
  setsid();
  if (launch.cgroup_fd >= 0 && write(launch.cgroup_fd, "0", 1) != 1) fail();  // 0 is whoever writes
  if (launch.parent_death_signal != 0) {
    if (prctl(PR_SET_PDEATHSIG, launch.parent_death_signal) != 0) fail();
    if (getppid() != launch.parent) fail();  // the parent ended before the line above
  }
  if (dup2(launch.input_fd, STDIN_FILENO) < 0 || dup2(launch.output_fd, STDOUT_FILENO) < 0 ||
      dup2(launch.error_fd, STDERR_FILENO) < 0) {
    fail();
  }
  // Our own descriptors are all close-on-exec; this is for those that a library or our own parent left open.
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

std::vector<char*> EnvironmentWithout(const std::vector<std::string>& names) {
  std::vector<char*> kept;
  for (char** variable = environ; *variable != nullptr; ++variable) {
    const std::string name(*variable, std::strcspn(*variable, "="));
    const bool is_ours = name == kLogFileEnvironment;
    if (!is_ours && std::find(names.begin(), names.end(), name) == names.end()) kept.push_back(*variable);
  }
  return kept;
}

int OpenToAppend(const std::string& path) {
  return open(path.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0600);
}

int PidfdOpen(pid_t pid) { return static_cast<int>(syscall(SYS_pidfd_open, pid, 0)); }

absl::Status Unavailable(const std::string& what, int error) {
  return absl::UnavailableError(absl::StrCat(what, ": ", std::strerror(error)));
}

// vfork, not fork: no copy of our page tables and no fork handlers of libraries that own threads; where a sanitizer
// makes a fork of it, the child has memory of its own. Signals wait, so that no handler of ours runs in the child while
// it shares our memory. Returns the pid, or -1 and sets errno.
pid_t VforkAndExec(const Launch& launch) {
  sigset_t all, before;
  sigfillset(&all);
  pthread_sigmask(SIG_SETMASK, &all, &before);
  const pid_t pid = vfork();
  if (pid == 0) Exec(launch);
  const int fork_error = errno;
  pthread_sigmask(SIG_SETMASK, &before, nullptr);
  errno = fork_error;
  return pid;
}

// The child's errno if it could not run its program, else 0.
int ReadError(int report_fd) {
  int error = 0;
  ssize_t got = 0;
  do {
    got = read(report_fd, &error, sizeof error);
  } while (got < 0 && errno == EINTR);
  return got == sizeof error ? error : 0;
}

}  // namespace

std::string ExitStatus::Describe() const {
  if (!known) return "ended; its exit status is unknown";
  if (signal == 0) return absl::StrCat("exited with code ", code);
  const char* name = sigabbrev_np(signal);
  const char* text = sigdescr_np(signal);
  if (name == nullptr || text == nullptr) return absl::StrCat("killed by signal ", signal);
  return absl::StrCat("killed by SIG", name, " (", text, ")");
}

absl::StatusOr<Process> Process::Spawn(const ProcessSpec& spec) {
  (void)RotateLogIfLarge(spec.log_path);
  const int error_fd = OpenToAppend(spec.log_path);
  if (error_fd < 0) return Unavailable(spec.log_path, errno);
  const int output_fd = spec.output_path.empty() ? error_fd : OpenToAppend(spec.output_path);
  if (output_fd < 0) {
    const int error = errno;
    close(error_fd);
    return Unavailable(spec.output_path, error);
  }
  const std::string cgroup_procs = spec.cgroup + "/cgroup.procs";
  const int cgroup_fd = spec.cgroup.empty() ? -1 : OpenToAppend(cgroup_procs);
  if (!spec.cgroup.empty() && cgroup_fd < 0) {
    const int error = errno;
    close(error_fd);
    if (output_fd != error_fd) close(output_fd);
    return Unavailable(cgroup_procs, error);
  }
  const int null_fd = open("/dev/null", O_RDONLY | O_CLOEXEC);
  std::vector<char*> argv;
  for (const std::string& argument : spec.argv) argv.push_back(const_cast<char*>(argument.c_str()));
  argv.push_back(nullptr);
  std::vector<char*> environment = EnvironmentWithout(spec.without_environment);
  std::string log_variable = absl::StrCat(kLogFileEnvironment, "=", spec.log_path);
  environment.insert(environment.end(), {log_variable.data(), nullptr});
  std::array<int, 2> report{-1, -1};  // its writing end is closed by exec
  const int report_error = pipe2(report.data(), O_CLOEXEC) == 0 ? 0 : errno;
  const Launch launch{.argv = argv.data(),
                      .environment = environment.data(),
                      .input_fd = null_fd,
                      .output_fd = output_fd,
                      .error_fd = error_fd,
                      .parent_death_signal = spec.parent_death_signal,
                      .parent = getpid(),
                      .report_fd = report[1],
                      .cgroup_fd = cgroup_fd};
  const pid_t pid = report_error == 0 ? VforkAndExec(launch) : -1;
  const int fork_error = report_error == 0 ? errno : report_error;
  close(error_fd);
  if (output_fd != error_fd) close(output_fd);
  if (cgroup_fd >= 0) close(cgroup_fd);
  close(null_fd);
  close(report[1]);
  const int exec_error = ReadError(report[0]);
  close(report[0]);

  if (pid < 0) return Unavailable("cannot fork", fork_error);
  if (exec_error != 0) {
    waitpid(pid, nullptr, 0);
    return Unavailable(absl::StrCat("cannot run ", spec.argv[0]), exec_error);
  }
  const int pidfd = PidfdOpen(pid);
  if (pidfd < 0) {
    const int error = errno;
    kill(pid, SIGKILL);  // our child and not reaped yet, so the pid is still its own
    waitpid(pid, nullptr, 0);
    return Unavailable(absl::StrCat("cannot watch ", spec.argv[0]), error);
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

bool Process::WaitUntilEnded(std::chrono::milliseconds timeout) const { return WaitReadable({pidfd_}, timeout); }

ExitStatus Process::Reap() const {
  siginfo_t info{};
  if (waitid(P_PIDFD, static_cast<id_t>(pidfd_), &info, WEXITED) != 0) return {};  // ECHILD: adopted
  if (info.si_code == CLD_EXITED) return {.known = true, .code = info.si_status};
  return {.known = true, .signal = info.si_status};
}

std::optional<std::uint64_t> ProcessStartTime(pid_t pid) {
  const auto stat = ReadFile(absl::StrCat("/proc/", pid, "/stat"), kMaxProcBytes);
  if (!stat.ok()) return std::nullopt;
  // proc(5): field 2 is the command's name in parentheses, which may itself hold blanks and parentheses; field 3 is the
  // state, field 22 the start time.
  const std::size_t name_end = stat->rfind(')');
  if (name_end == std::string::npos) return std::nullopt;
  const std::vector<std::string> fields = absl::StrSplit(stat->substr(name_end + 1), ' ', absl::SkipEmpty());
  if (fields.size() < 20 || fields[0] == "Z" || fields[0] == "X") return std::nullopt;
  return std::strtoull(fields[19].c_str(), nullptr, 10);
}

std::string BootId() {
  const auto id = ReadFile("/proc/sys/kernel/random/boot_id", kMaxProcBytes);
  return id.ok() ? std::string(absl::StripAsciiWhitespace(*id)) : "";
}

}  // namespace tessera::host
