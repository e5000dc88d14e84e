#include "region_worker/core/tick_driver.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "region_worker/testing/regions.h"
#include "region_worker/testing/small_world.h"

namespace tessera::worker {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::Field;
using ::testing::IsEmpty;

class TickDriverTest : public ::testing::Test {
 protected:
  void Begin(std::uint32_t regions) {
    ticks.emplace(WithoutPromises(ConfigOf(1, regions)));
    links.Up(kSecond, Incarnation(1), kStart, actions);
    ticks->SendFirstFrames(links, actions);
    ticks->Run(kStart);
  }
  void Step(TimePoint now) {
    ASSERT_TRUE(ticks->Due(now));
    ticks->Step(now, {}, links, actions);
    ticks->StepEnded(now);
  }
  // Brings the frames of region 2 that are for this one.
  void Bring(const std::vector<region::OutgoingFrame>& frames) {
    for (const region::OutgoingFrame& frame : frames) {
      if (frame.to != kSelf) continue;
      EXPECT_TRUE(ticks->region().Receive(kSecond, frame.bytes).ok());
    }
  }

  std::optional<TickDriver> ticks;
  LinkTable links{kSelf};
  Actions actions;
};

TEST_F(TickDriverTest, TicksAreDueOneAfterTheOtherOnceItRuns) {
  ticks.emplace(ConfigOf(1, 1));
  EXPECT_FALSE(ticks->Due(kStart));
  EXPECT_EQ(ticks->wake_at(kStart), std::nullopt);
  Begin(1);
  Step(kStart);
  EXPECT_TRUE(ticks->stepped());
  EXPECT_FALSE(ticks->Due(kStart));
  EXPECT_EQ(ticks->wake_at(kStart), kStart + ticks->tick_length());
  Step(kStart + ticks->tick_length());
  EXPECT_EQ(ticks->region().tick(), Tick(2));
}

TEST_F(TickDriverTest, TimeBeforeARestartIsNotCaughtUpWith) {
  Begin(1);
  Step(kStart);
  const TimePoint later = kStart + std::chrono::seconds(5);
  ticks->Restart(later);
  Step(later);
  EXPECT_FALSE(ticks->Due(later));
}

TEST_F(TickDriverTest, WaitsForTheNeighboursFramesAndSaysForHowLong) {
  region::Region other(WithoutPromises(ConfigOf(2, 2)));
  Begin(2);
  EXPECT_FALSE(ticks->Due(kStart));
  Bring(other.Start());
  const TimePoint came = kStart + std::chrono::milliseconds(30);
  Step(came);
  EXPECT_EQ(ticks->frame_wait(), std::chrono::milliseconds(30));
}

TEST_F(TickDriverTest, SaysForWhomTheStepWaitedLast) {
  region::Region other(WithoutPromises(ConfigOf(2, 2)));
  Begin(2);
  EXPECT_FALSE(ticks->Due(kStart));
  Bring(other.Start());
  Step(kStart + std::chrono::milliseconds(30));
  EXPECT_THAT(ticks->waited_for(), ElementsAre(kSecond));
}

TEST_F(TickDriverTest, AStepWhoseFramesWereThereWaitedForNobody) {
  region::Region other(WithoutPromises(ConfigOf(2, 2)));
  Begin(2);
  Bring(other.Start());
  Step(kStart);
  EXPECT_THAT(ticks->waited_for(), IsEmpty());
  EXPECT_EQ(ticks->frame_wait(), Duration(0));
}

TEST_F(TickDriverTest, TheFramesOfATickAreSent) {
  Begin(2);
  region::Region other(WithoutPromises(ConfigOf(2, 2)));
  Bring(other.Start());
  actions.clear();
  Step(kStart);
  EXPECT_THAT(TakeSent(actions), Contains(Field(&SentMessage::to, kSecond)));
}

TEST_F(TickDriverTest, WhileItWaitsItSaysThatItIsWell) {
  Begin(2);
  actions.clear();
  ticks->Watch(kStart + NeighbourWatch::kInterval, true, links, actions);
  int alive = 0;
  for (const SentMessage& sent : TakeSent(actions)) alive += sent.message.kind == LinkMessageKind::kAlive;
  EXPECT_EQ(alive, 1);
}

TEST_F(TickDriverTest, TakesTheLinkOfASilentNeighbourDownOnlyIfItMay) {
  Begin(2);
  TimePoint now = kStart;
  const auto watch = [&](bool may_give_up) {
    for (const TimePoint end = now + std::chrono::seconds(2); now < end; now += NeighbourWatch::kInterval) {
      ticks->Watch(now, may_give_up, links, actions);
    }
    return ticks->links_down();
  };
  EXPECT_EQ(watch(false), 0U);
  EXPECT_EQ(watch(true), 1U);
  EXPECT_FALSE(ticks->region().IsLinkUp(kSecond));
  EXPECT_TRUE(ticks->Due(now));
}

}  // namespace
}  // namespace tessera::worker
