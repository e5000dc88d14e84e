#include "agent/process.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <cstdlib>
#include <filesystem>

#include "agent/agent_fixture.h"
#include "agent/state_dir.h"
#include "gmock/gmock.h"

namespace tessera::agent {
namespace {

using ::testing::HasSubstr;

class ProcessTest : public ::testing::Test {
 protected:
  ProcessTest() {
    std::string pattern = std::filesystem::temp_directory_path().string() + "/tessera-process-XXXXXX";
    folder_ = mkdtemp(pattern.data());
  }
  ~ProcessTest() override { std::filesystem::remove_all(folder_); }

  absl::StatusOr<Process> Shell(const std::string& script) const {
    return Process::Spawn({.argv = {"/bin/sh", "-c", script},
                           .log_path = Log(),
                           .die_with_parent = true,
                           .without_environment = {"GONE"}});
  }
  ExitStatus RunShell(const std::string& script) const {
    const auto process = Shell(script);
    EXPECT_TRUE(process.ok() && WaitReadable(process->pidfd()));
    return process->Reap();
  }
  std::string Log() const { return folder_ + "/log"; }

  std::string folder_;
};

TEST_F(ProcessTest, TellsExitCodeAndSignal) {
  const ExitStatus code = RunShell("exit 7");
  EXPECT_TRUE(code.known);
  EXPECT_EQ(code.code, 7);
  EXPECT_EQ(code.signal, 0);
  EXPECT_EQ(RunShell("kill -SEGV $$").signal, SIGSEGV);
}

TEST_F(ProcessTest, OutputGoesToItsLog) {
  RunShell("echo out; echo err >&2");
  RunShell("echo more");
  EXPECT_EQ(ReadFile(Log()).value(), "out\nerr\nmore\n");
}

TEST_F(ProcessTest, LeadsASessionOfItsOwnWithNothingOfOurs) {
  const int open_fd = open("/dev/null", O_RDONLY);  // without close-on-exec, as a library might
  setenv("GONE", "secret", 1);
  setenv("KEPT", "value", 1);
  sigset_t blocked;
  sigemptyset(&blocked);
  sigaddset(&blocked, SIGTERM);
  pthread_sigmask(SIG_BLOCK, &blocked, nullptr);
  RunShell(
      "cut -d' ' -f1,6 /proc/$$/stat; ls /proc/$$/fd | tr '\\n' ' '; grep SigBlk /proc/self/status; echo "
      "\"$KEPT[$GONE]\"");
  pthread_sigmask(SIG_UNBLOCK, &blocked, nullptr);
  close(open_fd);
  const auto lines = LastLines(Log(), 9);
  ASSERT_EQ(lines.size(), 3U);
  const auto space = lines[0].find(' ');
  EXPECT_EQ(lines[0].substr(0, space), lines[0].substr(space + 1));  // its session is its pid
  EXPECT_THAT(lines[1], HasSubstr("0 1 2 SigBlk: 0000000000000000"));
  EXPECT_EQ(lines[2], "value[]");
}

TEST_F(ProcessTest, ProgramThatCannotRunIsAnErrorThatNamesIt) {
  const auto process = Process::Spawn({.argv = {folder_ + "/nothing"}, .log_path = Log()});
  EXPECT_EQ(std::string(process.status().message()), "cannot run " + folder_ + "/nothing: No such file or directory");
  EXPECT_EQ(waitpid(-1, nullptr, WNOHANG), -1);  // no zombie is left
  EXPECT_THAT(std::string(Process::Spawn({.argv = {"/bin/true"}, .log_path = "/no/log"}).status().message()),
              HasSubstr("/no/log"));
}

TEST_F(ProcessTest, AdoptsByPidAndStartTimeOnly) {
  const auto process = Shell("read line < /dev/zero");  // until killed
  ASSERT_TRUE(process.ok());
  const auto adopted = Process::Adopt(process->pid(), process->start_time());
  ASSERT_TRUE(adopted.ok());
  EXPECT_EQ(Process::Adopt(process->pid(), process->start_time() + 1).status().code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(Process::Adopt(0, 0).status().code(), absl::StatusCode::kNotFound);
  adopted->Signal(SIGKILL);
  EXPECT_TRUE(WaitReadable(adopted->pidfd()));
  EXPECT_FALSE(ProcessStartTime(process->pid()));  // ended, though not reaped yet
  EXPECT_EQ(process->Reap().signal, SIGKILL);
  EXPECT_FALSE(adopted->Reap().known);
}

TEST_F(ProcessTest, SeesWhichPortsAreTaken) {
  const int fd = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  sockaddr_in name{};
  name.sin_family = AF_INET;
  name.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  ASSERT_EQ(bind(fd, reinterpret_cast<const sockaddr*>(&name), sizeof name), 0);
  socklen_t size = sizeof name;
  getsockname(fd, reinterpret_cast<sockaddr*>(&name), &size);
  const std::uint16_t port = ntohs(name.sin_port);
  EXPECT_FALSE(PortsFree("127.0.0.1", port));
  EXPECT_FALSE(PortsFree("0.0.0.0", static_cast<std::uint16_t>(port - 1)));  // its second
  close(fd);
}

}  // namespace
}  // namespace tessera::agent
