#include "host/end_signals.h"

#include <gtest/gtest.h>

#include <thread>

namespace tessera::host {
namespace {

TEST(EndSignalsTest, ABlockedSignalWaitsUntilItIsTaken) {
  std::thread([] {
    const sigset_t signals = BlockSignals({SIGUSR1, SIGUSR2});
    ASSERT_EQ(pthread_kill(pthread_self(), SIGUSR2), 0);
    const timespec at_once{};
    EXPECT_EQ(sigtimedwait(&signals, nullptr, &at_once), SIGUSR2);
    EXPECT_EQ(sigtimedwait(&signals, nullptr, &at_once), -1) << "there is no other";
  }).join();
}

TEST(EndSignalsTest, ASetHasTheSignalsThatWereNamedAlone) {
  const sigset_t signals = SetOfSignals({SIGTERM, SIGHUP});
  EXPECT_EQ(sigismember(&signals, SIGTERM), 1);
  EXPECT_EQ(sigismember(&signals, SIGHUP), 1);
  EXPECT_EQ(sigismember(&signals, SIGINT), 0);
}

}  // namespace
}  // namespace tessera::host
