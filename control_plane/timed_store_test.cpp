#include "control_plane/timed_store.h"

#include <gtest/gtest.h>

#include <chrono>
#include <vector>

#include "control_plane/memory_store.h"

namespace tessera::control {
namespace {

TEST(TimedStoreTest, TellsOfEachWriteAndPassesAllOn) {
  MemoryStore memory;
  std::vector<std::chrono::nanoseconds> took;
  TimedStore store(memory, [&](std::chrono::nanoseconds write) { took.push_back(write); });
  const auto first = store.Put("host/1", "alpha", kAbsent);
  ASSERT_TRUE(first.ok());
  EXPECT_EQ(store.revision(), *first);
  EXPECT_EQ(store.Get("host/1")->value, "alpha");
  EXPECT_EQ(store.List("host/")->size(), 1u);
  EXPECT_TRUE(store.ListWithout("host/", "host/1")->empty());
  EXPECT_EQ(took.size(), 1u) << "reading is no write";
  memory.FailNext(1);
  EXPECT_EQ(store.Put("host/2", "beta", kAbsent).status().code(), absl::StatusCode::kUnavailable);
  EXPECT_EQ(took.size(), 2u) << "one that fails takes time too";
  EXPECT_GE(took[0].count(), 0);
}

TEST(TimedStoreTest, BeforeAWriteItIsKnownHowLongTheLastOneTook) {
  MemoryStore memory;
  std::vector<std::chrono::nanoseconds> took, before;
  TimedStore store(
      memory, [&](std::chrono::nanoseconds write) { took.push_back(write); },
      [&](std::chrono::nanoseconds last) {
        EXPECT_EQ(memory.revision(), static_cast<Revision>(before.size()));
        before.push_back(last);
      });
  ASSERT_TRUE(store.Put("a", "1", kAbsent).ok());
  ASSERT_TRUE(store.Put("b", "1", kAbsent).ok());
  ASSERT_EQ(before.size(), 2u);
  EXPECT_EQ(before[0].count(), 0);
  EXPECT_EQ(before[1], took[0]);
}

}  // namespace
}  // namespace tessera::control
