#include "bench/slow_fsync.h"

#include <gtest/gtest.h>
#include <signal.h>

#include <string>
#include <thread>

#include "host/temporary_folder.h"

namespace tessera::bench {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

constexpr auto kPatience = 30s;

// `dd` ends with one fsync of what it wrote.
host::ProcessSpec OneFsync(const std::string& folder) {
  return {.argv = {"/bin/dd", "if=/dev/zero", "of=" + folder + "/file", "bs=4096", "count=1", "conv=fsync"},
          .log_path = folder + "/log"};
}

TEST(SlowFsyncTest, EachCallTakesAsMuchLongerAsIsWanted) {
  const host::TemporaryFolder folder;
  const auto slow = SlowFsync::Begin();
  if (!slow.ok()) GTEST_SKIP() << slow.status();
  // As fast as ever, and it succeeds.
  auto fast = (*slow)->Start(OneFsync(folder.path()));
  ASSERT_TRUE(fast.ok()) << fast.status();
  EXPECT_TRUE(fast->Wait(kPatience).value().Clean());
  EXPECT_EQ((*slow)->delayed(), 0u);
  (*slow)->SetDelay(200ms);
  const Clock::time_point begun = Clock::now();
  auto delayed = (*slow)->Start(OneFsync(folder.path()));
  ASSERT_TRUE(delayed.ok()) << delayed.status();
  EXPECT_TRUE(delayed->Wait(kPatience).value().Clean());
  EXPECT_GE(Clock::now() - begun, 200ms);
  EXPECT_EQ((*slow)->delayed(), 1u);
}

TEST(SlowFsyncTest, AProgramThatIsKilledMeanwhileEnds) {
  const host::TemporaryFolder folder;
  const auto slow = SlowFsync::Begin();
  if (!slow.ok()) GTEST_SKIP() << slow.status();
  (*slow)->SetDelay(1h);
  auto program = (*slow)->Start(OneFsync(folder.path()));
  ASSERT_TRUE(program.ok()) << program.status();
  while ((*slow)->delayed() == 0) std::this_thread::yield();
  program->Signal(SIGKILL);
  EXPECT_EQ(program->Wait(kPatience).value().signal, SIGKILL);
}

TEST(SlowFsyncTest, AProgramThatIsNotThereIsNamed) {
  const host::TemporaryFolder folder;
  const auto slow = SlowFsync::Begin();
  if (!slow.ok()) GTEST_SKIP() << slow.status();
  const auto program = (*slow)->Start({.argv = {"/no/such/program"}, .log_path = folder.path() + "/log"});
  EXPECT_NE(program.status().message().find("/no/such/program"), std::string::npos) << program.status();
}

}  // namespace
}  // namespace tessera::bench
