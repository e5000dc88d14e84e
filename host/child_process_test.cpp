#include "host/child_process.h"

#include <gtest/gtest.h>

#include <csignal>
#include <optional>

#include "host/temporary_folder.h"

namespace tessera::host {
namespace {

using namespace std::chrono_literals;

class ChildProcessTest : public testing::Test {
 protected:
  ChildProcess Start(std::vector<std::string> argv) const {
    return ChildProcess::Start({.argv = std::move(argv), .log_path = folder_.path() + "/log"}).value();
  }
  std::string File(const std::string& name) const { return folder_.path() + "/" + name; }

  TemporaryFolder folder_;
};

TEST_F(ChildProcessTest, ReportsTheExitStatusEachTimeItIsAsked) {
  ChildProcess child = Start({"/bin/sh", "-c", "exit 7"});
  for (int i = 0; i < 2; ++i) EXPECT_EQ(child.Wait(20s), (ExitStatus{.known = true, .code = 7}));
}

TEST_F(ChildProcessTest, AProgramThatIsNotThereIsAnErrorThatNamesIt) {
  EXPECT_EQ(std::string(ChildProcess::Start({.argv = {"/no/program"}, .log_path = File("log")}).status().message()),
            "cannot run /no/program: No such file or directory");
}

TEST_F(ChildProcessTest, EndsByForceWhatIgnoresTheRequest) {
  const std::string ready = File("ready");
  ChildProcess child =
      Start({"/bin/sh", "-c", "trap '' TERM; echo > " + ready + "; while :; do read line < /dev/zero; done"});
  ASSERT_TRUE(child.WaitForFile(ready, 20s));
  EXPECT_EQ(child.End(50ms).signal, SIGKILL);
  EXPECT_FALSE(IsAlive(child.pid()));
}

TEST_F(ChildProcessTest, StopsWaitingForAFileWhenTheProcessEndsOrTheTimeIsOver) {
  ChildProcess ends = Start({"/bin/true"});
  EXPECT_FALSE(ends.WaitForFile(File("never"), 20s));
  ChildProcess runs = Start({"/bin/sh", "-c", "read line < /dev/zero"});
  EXPECT_FALSE(runs.WaitForFile(File("never"), 10ms));
}

TEST_F(ChildProcessTest, NothingOutlivesItsObject) {
  std::optional<ChildProcess> child = Start({"/bin/cat", "/dev/zero"});
  const pid_t first = child->pid();
  *child = Start({"/bin/sh", "-c", "read line < /dev/zero"});  // replaced: the first ends
  EXPECT_FALSE(IsAlive(first));
  const pid_t second = child->pid();
  EXPECT_TRUE(IsAlive(second));
  child.reset();
  EXPECT_FALSE(IsAlive(second));
}

}  // namespace
}  // namespace tessera::host
