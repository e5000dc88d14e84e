#include "core/physics/thread_team.h"

#include <gtest/gtest.h>

#include <array>
#include <thread>
#include <vector>

namespace tessera::physics {
namespace {

TEST(ThreadTeamTest, EachIndexIsDoneOnceWithAnyNumberOfThreads) {
  for (const int threads : {1, 2, 3, 7}) {
    ThreadTeam team(threads);
    for (const std::size_t count : {0, 1, 15, 16, 17, 64, 1000}) {
      std::vector<int> done(count, 0);
      team.For(count, 16, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) ++done[i];
      });
      EXPECT_EQ(done, std::vector<int>(count, 1)) << threads << " threads, " << count;
    }
  }
}

TEST(ThreadTeamTest, ALoopSeesWhatTheLastOneWrote) {
  ThreadTeam team(3);
  std::vector<std::uint64_t> values(500, 1), sums(500);
  for (int round = 0; round < 2000; ++round) {
    team.For(values.size(), 8, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) sums[i] = values[i] + values[values.size() - 1 - i];
    });
    team.For(values.size(), 32, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) values[i] = (sums[i] + i) % 1009;
    });
  }
  std::vector<std::uint64_t> alone(500, 1);
  for (int round = 0; round < 2000; ++round) {
    for (std::size_t i = 0; i < alone.size(); ++i) sums[i] = alone[i] + alone[alone.size() - 1 - i];
    for (std::size_t i = 0; i < alone.size(); ++i) alone[i] = (sums[i] + i) % 1009;
  }
  EXPECT_EQ(values, alone);
}

TEST(ThreadTeamTest, AShareIsDoneByOneThreadAndTheOwnersByTheOwner) {
  ThreadTeam team(2);
  for (int round = 0; round < 1000; ++round) {
    std::array<std::thread::id, 10> done;
    team.For(done.size(), 1, [&](std::size_t begin, std::size_t) { done[begin] = std::this_thread::get_id(); });
    for (std::size_t i = 0; i < done.size(); ++i) {
      if (team.ThreadOf(i, 1) == 0) {
        ASSERT_EQ(done[i], std::this_thread::get_id()) << i;
      }
      ASSERT_EQ(done[i], done[team.ThreadOf(i, 1)]) << i;
    }
  }
}

// Far more threads than processors: most shares are done by the owner, and those that a thread takes late are not done
// twice.
TEST(ThreadTeamTest, ThreadsWithoutAProcessorHoldNothingUp) {
  ThreadTeam team(kMaxStepThreads);
  std::vector<int> done(2 * kMaxStepThreads, 0);
  for (int round = 1; round <= 200; ++round) {
    team.For(done.size(), 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) ++done[i];
    });
    for (const int times : done) ASSERT_EQ(times, round);
    if (round % 10 == 0) team.Dismiss();
  }
}

TEST(ThreadTeamTest, ASmallLoopIsACallOfTheOwner) {
  ThreadTeam team(2);
  const std::thread::id owner = std::this_thread::get_id();
  int calls = 0;
  team.For(16, 16, [&](std::size_t begin, std::size_t end) {
    EXPECT_EQ(std::this_thread::get_id(), owner);
    EXPECT_EQ(begin, 0u);
    EXPECT_EQ(end, 16u);
    ++calls;
  });
  EXPECT_EQ(calls, 1);
}

TEST(ThreadTeamTest, ALoopAfterADismissalIsSharedToo) {
  ThreadTeam team(3);
  std::array<int, 12> done{};
  for (int round = 1; round <= 300; ++round) {
    team.For(done.size(), 2, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) ++done[i];
    });
    team.Dismiss();
    for (const int times : done) ASSERT_EQ(times, round);
  }
}

TEST(ThreadTeamTest, EndsWhereNothingWasEverHandedOut) {
  ThreadTeam team(4);
  EXPECT_EQ(team.size(), 4u);
  EXPECT_EQ(ThreadTeam::Alone().size(), 1u);
}

}  // namespace
}  // namespace tessera::physics
