#include "host/process.h"

#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <cstdlib>
#include <filesystem>

#include "absl/strings/str_cat.h"
#include "gmock/gmock.h"
#include "host/files.h"
#include "host/last_lines.h"
#include "host/log_rotation.h"
#include "host/temporary_folder.h"

namespace tessera::host {
namespace {

using ::testing::HasSubstr;
using namespace std::chrono_literals;

class ProcessTest : public ::testing::Test {
 protected:
  absl::StatusOr<Process> Shell(const std::string& script) const {
    return Process::Spawn({.argv = {"/bin/sh", "-c", script},
                           .log_path = Log(),
                           .parent_death_signal = SIGKILL,
                           .without_environment = {"GONE"}});
  }
  ExitStatus RunShell(const std::string& script) const {
    const auto process = Shell(script);
    EXPECT_TRUE(process.ok() && process->WaitUntilEnded(60s));
    return process->Reap();
  }
  std::string Log() const { return folder_.path() + "/log"; }
  std::string Logged() const { return ReadFile(Log(), 1000).value(); }

  TemporaryFolder folder_;
};

TEST_F(ProcessTest, KnowsItsLogFileAndNotThatOfWhoStartedIt) {
  setenv(kLogFileEnvironment, "/of/this/test.log", 1);
  EXPECT_TRUE(
      RunShell(std::string("echo \"<$") + kLogFileEnvironment + ">\"; env | grep -c " + kLogFileEnvironment).Clean());
  unsetenv(kLogFileEnvironment);
  EXPECT_EQ(Logged(), absl::StrCat("<", Log(), ">\n1\n"));
}

TEST_F(ProcessTest, ALargeLogIsRotatedBeforeTheProcessWrites) {
  ASSERT_TRUE(WriteFile(Log(), std::string(kMaxLogBytes, 'x'), Durability::kSurvivesProcess).ok());
  EXPECT_TRUE(RunShell("echo new").Clean());
  EXPECT_EQ(Logged(), "new\n");
  EXPECT_EQ(std::filesystem::file_size(EarlierLog(Log(), 1)), kMaxLogBytes);
}

TEST_F(ProcessTest, ReportsExitCodeAndSignal) {
  const ExitStatus code = RunShell("exit 7");
  EXPECT_EQ(code, (ExitStatus{.known = true, .code = 7}));
  EXPECT_EQ(code.Describe(), "exited with code 7");
  EXPECT_FALSE(code.Clean());
  EXPECT_TRUE(RunShell("true").Clean());
  const ExitStatus signal = RunShell("kill -SEGV $$");
  EXPECT_EQ(signal, (ExitStatus{.known = true, .signal = SIGSEGV}));
  EXPECT_EQ(signal.Describe(), "killed by SIGSEGV (Segmentation fault)");
  EXPECT_EQ(ExitStatus{}.Describe(), "ended; its exit status is unknown");
}

TEST_F(ProcessTest, OutputGoesToItsLog) {
  RunShell("echo out; echo err >&2");
  RunShell("echo more");
  EXPECT_EQ(Logged(), "out\nerr\nmore\n");
}

TEST_F(ProcessTest, StandardOutputCanGoToAFileOfItsOwn) {
  const std::string output = folder_.path() + "/output";
  const auto process =
      Process::Spawn({.argv = {"/bin/sh", "-c", "echo out; echo err >&2"}, .log_path = Log(), .output_path = output});
  ASSERT_TRUE(process.ok() && process->WaitUntilEnded(60s));
  EXPECT_TRUE(process->Reap().Clean());
  EXPECT_EQ(Logged(), "err\n");
  EXPECT_EQ(ReadFile(output, 1000).value(), "out\n");
}

TEST_F(ProcessTest, LeadsASessionOfItsOwnWithNothingOfOurs) {
  const int open_fd = open("/dev/null", O_RDONLY);  // without close-on-exec, as a library might
  setenv("GONE", "secret", 1);
  setenv("KEPT", "value", 1);
  sigset_t blocked;
  sigemptyset(&blocked);
  sigaddset(&blocked, SIGTERM);
  pthread_sigmask(SIG_BLOCK, &blocked, nullptr);
  // No pipe of the shell's own: it holds that open for a moment.
  RunShell("cut -d' ' -f1,6 /proc/$$/stat; ls -m /proc/$$/fd; grep SigBlk /proc/self/status; echo \"$KEPT[$GONE]\"");
  pthread_sigmask(SIG_UNBLOCK, &blocked, nullptr);
  close(open_fd);
  const auto lines = LastLines(Log(), 9);
  ASSERT_EQ(lines.size(), 4U);
  const auto space = lines[0].find(' ');
  EXPECT_EQ(lines[0].substr(0, space), lines[0].substr(space + 1));  // its session is its pid
  EXPECT_EQ(lines[1], "0, 1, 2");
  EXPECT_THAT(lines[2], HasSubstr("SigBlk: 0000000000000000"));
  EXPECT_EQ(lines[3], "value[]");
}

TEST_F(ProcessTest, ProgramThatCannotRunIsAnErrorThatNamesIt) {
  const auto process = Process::Spawn({.argv = {"/nowhere/at-all"}, .log_path = Log()});
  EXPECT_EQ(std::string(process.status().message()), "cannot run /nowhere/at-all: No such file or directory");
  EXPECT_EQ(waitpid(-1, nullptr, WNOHANG), -1);  // no zombie is left
  for (const ProcessSpec& spec : {ProcessSpec{.argv = {"/bin/true"}, .log_path = "/no/file"},
                                  ProcessSpec{.argv = {"/bin/true"}, .log_path = Log(), .output_path = "/no/file"}}) {
    EXPECT_THAT(std::string(Process::Spawn(spec).status().message()), HasSubstr("/no/file"));
  }
}

TEST_F(ProcessTest, AdoptsByPidAndStartTimeOnly) {
  const auto process = Shell("read line < /dev/zero");  // until killed
  ASSERT_TRUE(process.ok());
  const auto adopted = Process::Adopt(process->pid(), process->start_time());
  ASSERT_TRUE(adopted.ok());
  EXPECT_EQ(Process::Adopt(process->pid(), process->start_time() + 1).status().code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(Process::Adopt(0, 0).status().code(), absl::StatusCode::kNotFound);
  EXPECT_FALSE(adopted->WaitUntilEnded(0s));
  adopted->Signal(SIGKILL);
  EXPECT_TRUE(adopted->WaitUntilEnded(60s));
  EXPECT_FALSE(IsAlive(process->pid()));  // ended, though not reaped yet
  EXPECT_EQ(process->Reap().signal, SIGKILL);
  EXPECT_FALSE(adopted->Reap().known);
}

TEST(BootIdTest, IsTheSameAllTheTime) {
  EXPECT_EQ(BootId().size(), 36U);
  EXPECT_EQ(BootId(), BootId());
}

}  // namespace
}  // namespace tessera::host
