// The judgement whether a long run grew: windows, like against like, slopes, and the turns that are drawn.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <vector>

#include "bench/soak_figures.h"
#include "bench/soak_process.h"
#include "bench/soak_series.h"
#include "bench/soak_steps.h"
#include "bench/soak_turns.h"

namespace tessera::bench {
namespace {

using ::testing::Contains;
using ::testing::DoubleNear;
using ::testing::Each;
using ::testing::Key;
using ::testing::Not;
using ::testing::Optional;

constexpr double kHour = 3600;

SoakSample SampleAt(double at_s, int load, double memory, double descriptors = 20, double threads = 4) {
  return {.at_s = at_s, .load = load, .memory_bytes = memory, .descriptors = descriptors, .threads = threads};
}

// Every 10 s from `from_s` to `to_s`, regions four and six in turns of five minutes; six need half as much again.
SoakSeries Series(const std::string& process, double from_s, double to_s, double bytes, double bytes_an_hour) {
  SoakSeries series{.process = process, .since_s = from_s, .samples = {}};
  for (double at_s = from_s; at_s <= to_s; at_s += 10) {
    const bool six = std::fmod(at_s, 600) >= 300;
    const double grown = bytes + bytes_an_hour * (at_s - from_s) / kHour;
    series.samples.push_back(SampleAt(at_s, six ? 6 : 4, (six ? 1.5 : 1) * grown, six ? 30 : 20));
  }
  return series;
}

TEST(SoakWindowsTest, AnHourComparesTheTenMinutesAfterTheWarmUpWithTheLastTen) {
  const SoakWindows windows = WindowsOf(kHour);
  EXPECT_TRUE(windows.counts);
  EXPECT_DOUBLE_EQ(windows.early_begin_s, 600);
  EXPECT_DOUBLE_EQ(windows.early_end_s, 1200);
  EXPECT_DOUBLE_EQ(windows.late_begin_s, 3000);
  EXPECT_DOUBLE_EQ(windows.late_end_s, 3600);
  EXPECT_FALSE(windows.IsEarly(599));
  EXPECT_TRUE(windows.IsEarly(600));
  EXPECT_FALSE(windows.IsLate(2999));
  EXPECT_TRUE(windows.IsLate(3600));
}

TEST(SoakWindowsTest, WindowsOfARunThatCountsDoNotOverlap) {
  const SoakWindows windows = WindowsOf(1500);
  EXPECT_TRUE(windows.counts);
  EXPECT_LE(windows.early_end_s, windows.late_begin_s);
  EXPECT_DOUBLE_EQ(windows.early_begin_s, 600);
}

TEST(SoakWindowsTest, AShortRunHasWindowsOfAFifthAndDoesNotCount) {
  const SoakWindows windows = WindowsOf(120);
  EXPECT_FALSE(windows.counts);
  EXPECT_DOUBLE_EQ(windows.early_begin_s, 24);
  EXPECT_DOUBLE_EQ(windows.early_end_s, 48);
  EXPECT_DOUBLE_EQ(windows.late_begin_s, 96);
  EXPECT_FALSE(WindowsOf(1499).counts);
}

TEST(SoakSeriesTest, LikeIsComparedWithLike) {
  // Nothing grows, but the late window has more of the time in which it needs more.
  SoakSeries series{.process = "control", .since_s = 0, .samples = {}};
  for (int i = 0; i < 60; ++i) {
    series.samples.push_back(SampleAt(600 + 10 * i, i < 50 ? 4 : 6, i < 50 ? 100 : 150));
    series.samples.push_back(SampleAt(3000 + 10 * i, i < 10 ? 4 : 6, i < 10 ? 100 : 150));
  }
  const auto change = MedianChange(series, &SoakSample::memory_bytes, WindowsOf(kHour));
  ASSERT_TRUE(change.has_value());
  EXPECT_DOUBLE_EQ(change->Share(), 0);
  EXPECT_DOUBLE_EQ(change->Difference(), 0);
}

TEST(SoakSeriesTest, GrowthIsThatOfTheLoadThatGrowsMost) {
  SoakSeries series{.process = "control", .since_s = 0, .samples = {}};
  for (int i = 0; i < 10; ++i) {
    for (const int load : {4, 6}) {
      series.samples.push_back(SampleAt(600 + 10 * i, load, 100, 20));
      series.samples.push_back(SampleAt(3300 + 10 * i, load, load == 6 ? 110 : 90, load == 6 ? 23 : 20));
    }
  }
  EXPECT_NEAR(MedianChange(series, &SoakSample::memory_bytes, WindowsOf(kHour))->Share(), 0.1, 1e-12);
  EXPECT_DOUBLE_EQ(MedianChange(series, &SoakSample::descriptors, WindowsOf(kHour))->Difference(), 3);
}

TEST(SoakSeriesTest, ALoadWithFewSamplesInAWindowSaysNothing) {
  SoakSeries series{.process = "control", .since_s = 0, .samples = {}};
  for (int i = 0; i < 2; ++i) series.samples.push_back(SampleAt(700 + 10 * i, 4, 100));
  for (int i = 0; i < 20; ++i) series.samples.push_back(SampleAt(3100 + 10 * i, 4, 500));
  EXPECT_EQ(MedianChange(series, &SoakSample::memory_bytes, WindowsOf(kHour)), std::nullopt);
}

TEST(SoakSeriesTest, ASlopeIsFoundThroughChangesOfLoad) {
  const SoakSeries series = Series("worker 1", 1000, 2500, 100, 36);
  // The median of slopes within four regions (36 an hour) and within six (54) lies between them.
  const auto slope = SlopePerHour(series, &SoakSample::memory_bytes, 60);
  ASSERT_TRUE(slope.has_value());
  EXPECT_GT(*slope, 35);
  EXPECT_LT(*slope, 55);
  EXPECT_THAT(SlopePerHour(series, &SoakSample::descriptors, 60), Optional(DoubleNear(0, 1e-12)));
}

TEST(SoakSeriesTest, AStartUpAndASingleLeapAreNoSlope) {
  SoakSeries series{.process = "worker 1", .since_s = 0, .samples = {}};
  for (int i = 0; i <= 60; ++i) series.samples.push_back(SampleAt(10 * i, 4, i < 6 ? 10 * i : 100));
  series.samples[30].memory_bytes = 1000;
  EXPECT_THAT(SlopeSharePerHour(series, &SoakSample::memory_bytes, 60), Optional(DoubleNear(0, 1e-12)));
}

TEST(SoakSeriesTest, AShortLifeHasNoSlope) {
  EXPECT_EQ(SlopePerHour(Series("worker 1", 0, 100, 100, 36), &SoakSample::memory_bytes, 60), std::nullopt);
}

Samples StepPage(double fast, double slow) {
  const std::string name = "tessera_region_step_seconds";
  return {{name + "_bucket{le=\"0.001\"}", fast},        {name + "_bucket{le=\"0.01\"}", fast + slow},
          {name + "_bucket{le=\"+Inf\"}", fast + slow},  {name + "_count", fast + slow},
          {name + "_sum", 0.0005 * fast + 0.005 * slow}, {"tessera_region_ticks_total", 12345}};
}

TEST(SoakStepsTest, StepsOfWorkersThatComeAndGoAreSummedUp) {
  SoakSteps steps;
  steps.Take("worker 1", StepPage(500, 0), 4);
  steps.Mark(10);
  steps.Take("worker 1", StepPage(1100, 0), 4);
  steps.Take("worker 2", StepPage(600, 0), 4);  // a new one, from its start
  steps.Mark(20);
  EXPECT_EQ(steps.P99(4, 0, 10), std::nullopt);  // too few
  const auto p99 = steps.P99(4, 10, 20);         // 1200 fast ones
  ASSERT_TRUE(p99.has_value());
  EXPECT_NEAR(*p99, 0.00099, 1e-9);
}

TEST(SoakStepsTest, TheLateWindowIsHeldAgainstTheEarlyOneUnderOneLoad) {
  SoakSteps steps;
  const SoakWindows windows = WindowsOf(100);  // 20 to 40 against 80 to 100
  steps.Take("a", StepPage(0, 0), 4);
  steps.Take("b", StepPage(0, 0), 6);
  steps.Mark(20);
  steps.Take("a", StepPage(2000, 0), 4);
  steps.Take("b", StepPage(0, 2000), 6);
  steps.Mark(40);
  steps.Mark(80);
  steps.Take("a", StepPage(4000, 0), 4);
  steps.Take("b", StepPage(0, 4000), 6);
  steps.Mark(100);
  EXPECT_THAT(steps.P99Ratio(windows), Optional(DoubleNear(1, 1e-9)));
  EXPECT_THAT(steps.loads(), ::testing::ElementsAre(4, 6));
  steps.Take("a", StepPage(4000, 2000), 4);  // half of the late ones are slow
  steps.Mark(100);
  const auto ratio = steps.P99Ratio(windows);
  ASSERT_TRUE(ratio.has_value());
  EXPECT_GT(*ratio, 5);
}

TEST(SoakFiguresTest, ProcessesThatLiveThroughoutAndWorkersAreKeptApart) {
  const std::vector<SoakSeries> all{Series("control", 0, kHour, 1000, 60), Series("local-1", 0, kHour, 1000, 0),
                                    Series("worker 1", 0, kHour, 1000, 600), Series("worker 2", 100, 900, 1000, 0),
                                    Series("worker 3", 1300, 1350, 1000, 9000)};
  const SoakFigures figures = FiguresOf(all, SoakSteps(), kHour);
  EXPECT_THAT(figures.throughout, Contains(Key("worker 1")));
  EXPECT_THAT(figures.throughout, Not(Contains(Key("worker 2"))));
  // 60 an hour of 1000 over the 40 minutes between the windows.
  EXPECT_THAT(figures.memory_growth(), Optional(DoubleNear(0.04, 0.002)));
  EXPECT_THAT(figures.handles_growth(), Optional(DoubleNear(0, 1e-12)));
  EXPECT_EQ(figures.workers_measured, 2);
  ASSERT_TRUE(figures.worker_memory_slope.has_value());
  EXPECT_GT(*figures.worker_memory_slope, 0.1);  // the median of .5 or so and 0
  EXPECT_LT(*figures.worker_memory_slope, 0.4);
  EXPECT_EQ(figures.step_p99_ratio, std::nullopt);
}

TEST(SoakFiguresTest, AHandleThatStaysOpenIsFound) {
  SoakSeries control = Series("control", 0, kHour, 1000, 0);
  for (SoakSample& sample : control.samples) {
    if (sample.at_s > 2000) ++sample.threads;
  }
  EXPECT_THAT(FiguresOf({control}, SoakSteps(), kHour).handles_growth(), Optional(DoubleNear(1, 1e-12)));
}

TEST(SoakProcessTest, ReadsOwnMemoryAndThreads) {
  const auto sample =
      ParseStatus("Name:\tx\nRssAnon:\t    2000 kB\nRssFile:\t  900 kB\nVmSwap:\t  24 kB\nThreads:\t7\n");
  ASSERT_TRUE(sample.has_value());
  EXPECT_DOUBLE_EQ(sample->memory_bytes, 2024 * 1024.0);
  EXPECT_DOUBLE_EQ(sample->threads, 7);
  EXPECT_FALSE(ParseStatus("Name:\tx\nState:\tZ (zombie)\nThreads:\t1\n").has_value());
}

TEST(SoakProcessTest, CountsOpenDescriptors) {
  const auto before = ReadSoakProcess(getpid());
  ASSERT_TRUE(before.has_value());
  const int copy = dup(STDERR_FILENO);
  const auto after = ReadSoakProcess(getpid());
  close(copy);
  ASSERT_TRUE(after.has_value());
  EXPECT_EQ(after->descriptors, before->descriptors + 1);
  EXPECT_GT(after->memory_bytes, 0);
}

TEST(SoakTurnsTest, PlayersChangeOnceInFourTurns) {
  const auto turns = DrawSoakTurns(25, 400);
  ASSERT_EQ(turns.size(), 400u);
  for (std::size_t i = 0; i < turns.size(); i += 4) {
    EXPECT_EQ(std::count_if(turns.begin() + static_cast<std::ptrdiff_t>(i),
                            turns.begin() + static_cast<std::ptrdiff_t>(i) + 4,
                            [](const SoakTurn& turn) { return turn.kind == SoakTurnKind::kPlayers; }),
              1);
  }
}

TEST(SoakTurnsTest, EachOtherKindComesOnceBeforeAnyComesAgain) {
  std::map<SoakTurnKind, int> counts;
  int others = 0;
  for (const SoakTurn& turn : DrawSoakTurns(7, 400)) {
    if (turn.kind == SoakTurnKind::kPlayers) continue;
    ++counts[turn.kind];
    if (++others % 5 != 0) continue;
    std::vector<int> so_far;
    so_far.reserve(counts.size());
    for (const auto& [kind, count] : counts) so_far.push_back(count);
    ASSERT_EQ(so_far.size(), 5u);
    ASSERT_THAT(so_far, Each(others / 5));
  }
  EXPECT_EQ(others, 300);
}

TEST(SoakTurnsTest, OneSeedDrawsTheSameTurns) {
  const auto some = DrawSoakTurns(25, 50), more = DrawSoakTurns(25, 90), others = DrawSoakTurns(26, 90);
  const auto same = [](const SoakTurn& a, const SoakTurn& b) { return a.kind == b.kind && a.draw == b.draw; };
  EXPECT_TRUE(std::equal(some.begin(), some.end(), more.begin(), same));
  EXPECT_FALSE(std::equal(more.begin(), more.end(), others.begin(), same));
}

}  // namespace
}  // namespace tessera::bench
