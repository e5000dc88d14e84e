#include "region_worker/core/run_statistics.h"

#include <gmock/gmock.h>

#include <chrono>
#include <cstdint>
#include <vector>

#include "region_worker/testing/regions.h"
#include "region_worker/testing/small_world.h"

namespace tessera::worker {
namespace {

using ::testing::ElementsAre;
using ::testing::SizeIs;

// One region that is alone in a world of four balls.
class RunStatisticsTest : public ::testing::Test {
 protected:
  void Step() { statistics.Stepped(region, region.Step(), kRate_hz); }

  static constexpr std::uint32_t kRate_hz = 3;  // a census each third tick
  region::Region region{ConfigOf(1, 1)};
  RunStatistics statistics;
};

TEST_F(RunStatisticsTest, ARemovalIsNoBodyThatIsNotFiniteAndNoHandover) {
  region::StepResult result;
  result.departures = {{BodyId(1), Epoch(1), region::DepartureReason::kRemoved, RegionId()},
                       {BodyId(2), Epoch(1), region::DepartureReason::kRemoved, RegionId()},
                       {BodyId(3), Epoch(1), region::DepartureReason::kHandedOver, kSecond}};
  result.nonfinite = {BodyId(2)};
  result.handed_in = 5;
  result.handed_out = 1;
  statistics.Stepped(region, result, kRate_hz);
  statistics.Stepped(region, {}, kRate_hz);
  const TickCounts& counts = statistics.counts();
  EXPECT_EQ(counts.ticks, 2U);
  EXPECT_EQ(counts.removed_bodies, 1U);
  EXPECT_EQ(counts.nonfinite_bodies, 1U);
  EXPECT_EQ(counts.handovers_in, 5U);
  EXPECT_EQ(counts.handovers_out, 1U);
  EXPECT_THAT(statistics.taken_out(), ElementsAre(BodyId(2)));
}

TEST_F(RunStatisticsTest, TheNewestBodiesThatWereTakenOutAreKept) {
  for (std::uint64_t id = 1; id <= RunStatistics::kTakenOutKept + 2; ++id) {
    region::StepResult result;
    result.nonfinite = {BodyId(id)};
    statistics.Stepped(region, result, kRate_hz);
  }
  EXPECT_THAT(statistics.taken_out(), SizeIs(RunStatistics::kTakenOutKept));
  EXPECT_EQ(statistics.taken_out().front(), BodyId(3));
  EXPECT_EQ(statistics.taken_out().back(), BodyId(RunStatistics::kTakenOutKept + 2));
}

TEST_F(RunStatisticsTest, ACensusIsTakenAtTheBeginningAndEachSecond) {
  statistics.Begin(region);
  for (int i = 0; i < 7; ++i) Step();
  std::vector<Tick> ticks;
  for (const region::RegionCensus& census : statistics.censuses()) {
    ticks.push_back(census.tick);
    EXPECT_EQ(census.owned, 4U);
  }
  EXPECT_THAT(ticks, ElementsAre(Tick(0), Tick(3), Tick(6)));
  for (int i = 0; i < 15; ++i) Step();
  EXPECT_THAT(statistics.censuses(), SizeIs(RunStatistics::kCensusesKept));
  EXPECT_EQ(statistics.censuses().front().tick, Tick(9));
  EXPECT_EQ(statistics.censuses().back().tick, Tick(21));
}

TEST_F(RunStatisticsTest, LateTicksAndTheRateFollowFromTheTimes) {
  TimePoint end = kStart;
  for (std::uint64_t tick = 1; tick <= 11; ++tick) {
    statistics.StepEnded(end, Tick(tick), std::chrono::milliseconds(tick), tick % 4 == 0);
    end += std::chrono::milliseconds(100);
  }
  EXPECT_EQ(statistics.counts().late_ticks, 2U);
  EXPECT_NEAR(statistics.rate_hz(end - std::chrono::milliseconds(100)), 10, 1e-6);
  EXPECT_NEAR(statistics.step_times().max_s, 0.011, 1e-6);
  EXPECT_NEAR(statistics.step_times().p50_s, 0.006, 1e-6);
}

}  // namespace
}  // namespace tessera::worker
