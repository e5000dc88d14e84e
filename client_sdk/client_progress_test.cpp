#include "client_sdk/client_progress.h"

#include <gtest/gtest.h>

#include "client_sdk/testing/test_now.h"

namespace tessera::client {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr ClientProgress::Seen kNobody{.scene = true, .all_welcomed = false, .any_heard = false};
constexpr ClientProgress::Seen kSome{.scene = true, .all_welcomed = false, .any_heard = true};
constexpr ClientProgress::Seen kAll{.scene = true, .all_welcomed = true, .any_heard = true};
constexpr ClientProgress::Seen kAllWithoutScene{.scene = false, .all_welcomed = true, .any_heard = true};

TEST(ClientProgressTest, PlaysOnceItIsWelcomedHasTheSceneAndTheWorldHasStarted) {
  ClientProgress progress(seconds(10));
  progress.Look(kTestNow, kSome);
  EXPECT_EQ(progress.state(), ClientState::kJoining);
  progress.Look(kTestNow, kAllWithoutScene);
  EXPECT_EQ(progress.state(), ClientState::kJoining);
  progress.Look(kTestNow, kAll);
  EXPECT_EQ(progress.state(), ClientState::kWaiting);
  EXPECT_TRUE(progress.Start());
  EXPECT_FALSE(progress.Start());
  progress.Look(kTestNow, kAll);
  EXPECT_EQ(progress.state(), ClientState::kPlaying);
}

TEST(ClientProgressTest, TheTimeToJoinCountsFromTheLastStep) {
  ClientProgress progress(seconds(10));
  EXPECT_FALSE(progress.Look(kTestNow, kSome).late);
  EXPECT_FALSE(progress.Look(kTestNow + seconds(9), kSome).late);
  progress.Step(kTestNow + seconds(9));  // a part of the scene came
  EXPECT_FALSE(progress.Look(kTestNow + milliseconds(18'999), kSome).late);
  EXPECT_TRUE(progress.Look(kTestNow + seconds(19), kSome).late);
}

TEST(ClientProgressTest, ASilenceIsBorneForAWhile) {
  ClientProgress progress(seconds(10));
  progress.Look(kTestNow, kAll);
  int asked = 0;
  for (milliseconds at{0}; at <= seconds(30); at += milliseconds(500)) {
    const ClientProgress::Due due = progress.Look(kTestNow + at, kNobody);
    EXPECT_FALSE(due.late);
    EXPECT_EQ(due.search, at >= seconds(1)) << at.count();
    EXPECT_EQ(due.lost, at >= seconds(30)) << at.count();
    EXPECT_EQ(due.ask_grant, at == milliseconds(500)) << at.count();
    asked += due.ask_grant ? 1 : 0;
  }
  EXPECT_EQ(asked, 1);
}

TEST(ClientProgressTest, AnAnswerOrAGrantEndsASilence) {
  ClientProgress progress(seconds(10));
  progress.Look(kTestNow, kAll);
  progress.Look(kTestNow, kNobody);
  EXPECT_TRUE(progress.Look(kTestNow + seconds(4), kNobody).ask_grant);
  progress.EndSilence();
  EXPECT_FALSE(progress.Look(kTestNow + seconds(5), kNobody).search);
  EXPECT_TRUE(progress.Look(kTestNow + seconds(8), kNobody).ask_grant);  // again, for it is another silence
  progress.Look(kTestNow + seconds(9), kSome);
  EXPECT_FALSE(progress.Look(kTestNow + seconds(40), kNobody).lost);
}

TEST(ClientProgressTest, WhileItJoinsOnlyTheDeadlineEndsIt) {
  ClientProgress progress(std::chrono::minutes(2));
  progress.Look(kTestNow, kNobody);
  const ClientProgress::Due due = progress.Look(kTestNow + seconds(60), kNobody);
  EXPECT_TRUE(due.search);
  EXPECT_FALSE(due.ask_grant);
  EXPECT_FALSE(due.lost);
}

TEST(ClientProgressTest, TheFirstEndCounts) {
  ClientProgress progress(seconds(10));
  EXPECT_TRUE(progress.End(absl::AbortedError("kicked")));
  EXPECT_FALSE(progress.End(absl::UnavailableError("lost"), true));
  EXPECT_EQ(progress.reason().message(), "kicked");
  EXPECT_FALSE(progress.needs_new_grant());
}

}  // namespace
}  // namespace tessera::client
