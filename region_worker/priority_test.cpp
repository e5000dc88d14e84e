#include "region_worker/priority.h"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <thread>

namespace tessera::worker {
namespace {

// Each in a thread of its own, so that the test program stays as it is.
template <class Function>
void InThread(Function function) {
  std::thread(function).join();
}

int NiceOfThisThread() { return getpriority(PRIO_PROCESS, 0); }

TEST(PriorityTest, AThreadGoesFirstOrStaysAsItWas) {
  const int before = NiceOfThisThread();
  InThread([before] {
    const absl::Status status = GoFirst();
    if (status.ok()) {
      EXPECT_EQ(NiceOfThisThread(), kFirst);
    } else {
      EXPECT_TRUE(absl::IsPermissionDenied(status)) << status;
      EXPECT_EQ(NiceOfThisThread(), before);
    }
  });
  EXPECT_EQ(NiceOfThisThread(), before);
}

TEST(PriorityTest, WhatItStartsDoesNotGoFirst) {
  InThread([] {
    (void)GoFirst();
    InThread([] { EXPECT_GE(NiceOfThisThread(), 0); });
  });
}

}  // namespace
}  // namespace tessera::worker
