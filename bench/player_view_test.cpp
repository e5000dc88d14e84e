#include "bench/player_view.h"

#include <gtest/gtest.h>

#include <string>

#include "bench/stage_pace.h"

namespace tessera::bench {
namespace {

TEST(PlayerViewTest, TakesWhatThePlayerSays) {
  PlayerView view;
  EXPECT_FALSE(view.body());
  ASSERT_TRUE(view.Take(InLine(BodyId(1'000'007), Tick(31))).ok());
  ASSERT_TRUE(view.Take(FramesLine({480, 3})).ok());
  EXPECT_EQ(view.body(), BodyId(1'000'007));
  EXPECT_EQ(view.tick(), Tick(31));
  EXPECT_EQ(view.frames().due, 480U);
  EXPECT_EQ(view.frames().late, 3U);
  EXPECT_FALSE(view.ended());
}

TEST(PlayerViewTest, SeesWhatWasInItsLastWholeLook) {
  const SeenPlace place{Tick(60), RegionId(2), -12.25, 0.5, 3, 1.5};
  PlayerView view;
  ASSERT_TRUE(view.Take(SeesLine(BodyId(1000), place)).ok());
  EXPECT_TRUE(view.sees().empty()) << "the look is not whole yet";
  ASSERT_TRUE(view.Take(AllSeenLine()).ok());
  ASSERT_EQ(view.sees().size(), 1U);
  EXPECT_EQ(view.sees().at(BodyId(1000)), place);
  ASSERT_TRUE(view.Take(SeesLine(BodyId(1001), place)).ok());
  ASSERT_TRUE(view.Take(AllSeenLine()).ok());
  EXPECT_FALSE(view.sees().contains(BodyId(1000))) << "it is not seen any more";
}

TEST(PlayerViewTest, AGapOfAnEarlierWatchDoesNotCount) {
  PlayerView view;
  view.WatchAnew(1);
  ASSERT_TRUE(view.Take(GapLine({1, 40, false, 0})).ok());
  EXPECT_EQ(view.gap().watched, 40U);
  view.WatchAnew(2);
  ASSERT_TRUE(view.Take(GapLine({1, 40, true, 0.2})).ok());
  EXPECT_FALSE(view.gap().over);
  ASSERT_TRUE(view.Take(GapLine({2, 30, true, 0.125})).ok());
  EXPECT_TRUE(view.gap().over);
  EXPECT_DOUBLE_EQ(view.gap().seconds, 0.125);
}

TEST(PlayerViewTest, ItsEndIsOneLineAndTheFirstReasonStands) {
  PlayerView view;
  const std::string line = EndedLine("UNAVAILABLE: the regions\nare silent");
  EXPECT_EQ(line.find('\n'), std::string::npos);
  ASSERT_TRUE(view.Take(line).ok());
  view.End("its process has ended");
  EXPECT_TRUE(view.ended());
  EXPECT_EQ(view.reason(), "UNAVAILABLE: the regions are silent");
}

TEST(PlayerViewTest, RefusesWhatNoPlayerSays) {
  PlayerView view;
  for (const char* line :
       {"", "in", "in 7", "in seven 3", "in 7 3 1", "frames 1", "sees 1 2 3 4 5 6", "seen 1", "gap 1 2 3", "watch 1"}) {
    EXPECT_EQ(view.Take(line).code(), absl::StatusCode::kInvalidArgument) << line;
  }
  EXPECT_FALSE(view.body());
  EXPECT_EQ(view.frames().due, 0U);
}

TEST(StagePaceTest, AStageIsInTimeIfFramesAndTicksAre) {
  EXPECT_TRUE(IsInTime({.frames = 1000, .late_frames = 50, .ticks = 400, .late_ticks = 20}));
  EXPECT_FALSE(IsInTime({.frames = 1000, .late_frames = 51, .ticks = 400, .late_ticks = 0}));
  EXPECT_FALSE(IsInTime({.frames = 1000, .late_frames = 0, .ticks = 400, .late_ticks = 21}));
}

TEST(StagePaceTest, AStageWhereNothingHappensIsNotInTime) {
  EXPECT_FALSE(IsInTime({}));
  EXPECT_FALSE(IsInTime({.frames = 1000, .late_frames = 0, .ticks = 0, .late_ticks = 0}));
  EXPECT_FALSE(IsInTime({.frames = 0, .late_frames = 0, .ticks = 400, .late_ticks = 0}));
}

}  // namespace
}  // namespace tessera::bench
