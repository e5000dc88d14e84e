#include "region_worker/core/tick_pacer.h"

#include <gtest/gtest.h>

namespace tessera::worker {
namespace {

using std::chrono::milliseconds;

TEST(TickPacerTest, TicksDoNotDrift) {
  for (const std::uint32_t rate : {10u, 60u, 77u, 240u}) {
    TickPacer pacer(rate);
    const TimePoint start{};
    pacer.Start(start);
    for (std::uint32_t tick = 0; tick < rate * 3600; ++tick) EXPECT_FALSE(pacer.Finished(pacer.due()));
    EXPECT_EQ(pacer.due(), start + std::chrono::hours(1)) << rate;
  }
}

TEST(TickPacerTest, TickIsLateWhenItEndsMoreThanATickAfterItsTime) {
  TickPacer pacer(10);
  pacer.Start(TimePoint{});
  EXPECT_FALSE(pacer.Finished(pacer.due() + milliseconds(100)));
  EXPECT_TRUE(pacer.Finished(pacer.due() + milliseconds(101)));
}

TEST(TickPacerTest, CatchesUpAFewTicks) {
  TickPacer pacer(10);
  const TimePoint start{};
  pacer.Start(start);
  EXPECT_TRUE(pacer.Finished(start + milliseconds(350)));  // one slow tick
  EXPECT_EQ(pacer.due(), start + milliseconds(100));       // the next ones are due at once
  for (int i = 0; i < 4; ++i) pacer.Finished(start + milliseconds(360));
  EXPECT_EQ(pacer.due(), start + milliseconds(500));  // and then nothing is lost
}

TEST(TickPacerTest, DoesNotRaceThroughALongPause) {
  TickPacer pacer(10);
  const TimePoint start{};
  pacer.Start(start);
  const TimePoint after = start + std::chrono::seconds(60);
  EXPECT_TRUE(pacer.Finished(after));
  EXPECT_EQ(pacer.due(), after);
  EXPECT_FALSE(pacer.Finished(after + milliseconds(1)));
  EXPECT_EQ(pacer.due(), after + milliseconds(100));
}

TEST(TickPacerTest, SetsItsClockBackByTheLeastThatTicksBeganLate) {
  TickPacer pacer(10);
  const TimePoint start{};
  pacer.Start(start);
  for (std::uint32_t tick = 0; tick < TickPacer::kTicksPerShift; ++tick) {
    pacer.Began(pacer.due() + milliseconds(20 + tick % 3));
    pacer.Finished(pacer.due() + milliseconds(30));
  }
  EXPECT_EQ(pacer.due(), start + milliseconds(100) * TickPacer::kTicksPerShift + milliseconds(20));
}

TEST(TickPacerTest, LatenessThatComesAndGoesCostsNoTime) {
  TickPacer pacer(10);
  const TimePoint start{};
  pacer.Start(start);
  for (std::uint32_t tick = 0; tick < 10 * TickPacer::kTicksPerShift; ++tick) {
    pacer.Began(pacer.due() + (tick % 10 == 0 ? milliseconds(0) : milliseconds(30)));
    pacer.Finished(pacer.due() + milliseconds(40));
  }
  EXPECT_EQ(pacer.due(), start + milliseconds(1000) * TickPacer::kTicksPerShift);
}

TEST(TickPacerTest, AnotherPaceCountsFromTheNextTickOn) {
  TickPacer pacer(60);
  const TimePoint start{};
  pacer.Start(start);
  for (int tick = 0; tick < 60; ++tick) EXPECT_FALSE(pacer.Finished(pacer.due()));
  pacer.SetRate(2.5);
  EXPECT_EQ(pacer.due(), start + std::chrono::seconds(1)) << "it is due as it was";
  for (int tick = 0; tick < 25; ++tick) EXPECT_FALSE(pacer.Finished(pacer.due()));
  EXPECT_EQ(pacer.due(), start + std::chrono::seconds(11));
  EXPECT_EQ(pacer.tick_length(), milliseconds(400));
  pacer.SetRate(60);
  for (int tick = 0; tick < 60; ++tick) EXPECT_FALSE(pacer.Finished(pacer.due()));
  EXPECT_EQ(pacer.due(), start + std::chrono::seconds(12));
}

}  // namespace
}  // namespace tessera::worker
