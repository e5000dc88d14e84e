#include "local_cluster/child_process.h"

#include <gtest/gtest.h>

#include <csignal>
#include <filesystem>
#include <fstream>

#include "local_cluster/command_error.h"
#include "local_cluster/local_cluster.h"

namespace tessera::local {
namespace {

using std::chrono::seconds;

class ChildProcessTest : public testing::Test {
 protected:
  std::string Log() const { return folder_.path() + "/log"; }
  std::string Logged() const {
    std::ifstream in(Log());
    return {std::istreambuf_iterator<char>(in), {}};
  }
  TemporaryFolder folder_;
};

TEST_F(ChildProcessTest, ReportsTheExitStatusAndKeepsTheOutput) {
  ChildProcess child({"/bin/sh", "-c", "echo out; echo err >&2; exit 7"}, Log());
  const auto status = child.Wait(seconds(20));
  ASSERT_TRUE(status.has_value());
  EXPECT_EQ(status->code, 7);
  EXPECT_EQ(status->signal, 0);
  EXPECT_EQ(Logged(), "out\nerr\n");
  EXPECT_EQ(LastLines(Log(), 1), "\n  err");
}

TEST_F(ChildProcessTest, TakesTheOutputApartFromTheLog) {
  const std::string output = folder_.path() + "/output";
  ChildProcess child({"/bin/sh", "-c", "echo out; echo err >&2"}, Log(), output);
  ASSERT_TRUE(child.Wait(seconds(20)).has_value());
  EXPECT_EQ(Logged(), "err\n");
  EXPECT_EQ(LastLines(output, 9), "\n  out");
}

TEST_F(ChildProcessTest, NamesAProgramThatIsNotThere) {
  try {
    ChildProcess child({"/nowhere/at-all"}, Log());
    FAIL() << "started";
  } catch (const CommandError& error) {
    EXPECT_STREQ(error.what(), "cannot start /nowhere/at-all: No such file or directory");
  }
}

TEST_F(ChildProcessTest, EndsByForceWhatIgnoresTheRequest) {
  const std::string ready = folder_.path() + "/ready";
  ChildProcess child({"/bin/sh", "-c", "trap '' TERM; echo > " + ready + "; while :; do read line < /dev/zero; done"},
                     Log());
  ASSERT_TRUE(child.WaitForFile(ready, seconds(20)));
  EXPECT_EQ(child.End(std::chrono::milliseconds(50)).signal, SIGKILL);
  EXPECT_EQ(kill(child.pid(), 0), -1);
}

TEST_F(ChildProcessTest, StopsWaitingForAFileWhenTheProcessEnds) {
  ChildProcess child({"/bin/true"}, Log());
  EXPECT_FALSE(child.WaitForFile(folder_.path() + "/never", seconds(20)));
}

TEST_F(ChildProcessTest, NothingOutlivesItsObject) {
  pid_t pid = 0;
  {
    ChildProcess child({"/bin/cat", "/dev/zero"}, "/dev/null");
    pid = child.pid();
  }
  EXPECT_EQ(kill(pid, 0), -1);
}

TEST_F(ChildProcessTest, TemporaryFoldersVanish) {
  std::string path;
  {
    TemporaryFolder folder;
    path = folder.path();
    std::ofstream(path + "/file") << "x";
  }
  EXPECT_FALSE(std::filesystem::exists(path));
}

}  // namespace
}  // namespace tessera::local
