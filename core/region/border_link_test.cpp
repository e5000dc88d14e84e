// One border's frames in step: which are promised, which are passed over, how its link goes down and comes up.
#include "core/region/border_link.h"

#include <gmock/gmock.h>

#include "core/region/settings.h"

namespace tessera::region {
namespace {

using ::testing::HasSubstr;

// Two ends of one border, region 1's and region 2's, and what is between them.
class BorderLinkTest : public ::testing::Test {
 protected:
  BorderLinkTest() : catalog(MakeScene()) {}
  static std::shared_ptr<const Scene> MakeScene() {
    auto scene = std::make_shared<Scene>();
    BodyDef def;
    def.id = BodyId(1);
    scene->bodies.push_back(def);
    return scene;
  }
  // After a step of `from` to `tick`: what it sends comes to `to`.
  static BorderFrame Made(BorderLink& from, Tick tick, std::uint32_t promised, bool asleep = true) {
    BorderFrame frame;
    frame.tick = tick;
    frame.sender = from.peer() == RegionId(2) ? RegionId(1) : RegionId(2);
    if (!asleep) {
      GhostRecord ghost{BodyId(1), Epoch(1), {}, {}, {}, {}, {}};
      ghost.state.linear_velocity = {1, 0, 0};
      frame.ghosts.push_back(ghost);
    }
    frame.stamp = from.StampFrame(promised);
    return frame;
  }
  absl::Status Bring(const BorderFrame& frame, BorderLink& to, Tick now) {
    const std::vector<std::uint8_t> bytes = Encode(frame, {});
    const BorderFrame* taken = nullptr;
    const absl::StatusOr<BorderFrameHeader> header = DecodeHeader(bytes);
    EXPECT_TRUE(header.ok());
    absl::Status status = to.Put(*header, bytes, catalog, now, &taken);
    came = taken != nullptr;
    return status;
  }
  void Request(BorderLink& from, BorderLink& to, Tick tick) { Request(from, to, tick, tick); }
  void Request(BorderLink& from, BorderLink& to, Tick tick, Tick tick_there) {
    BorderFrame request;
    request.tick = tick;
    request.sender = from.peer() == RegionId(2) ? RegionId(1) : RegionId(2);
    request.stamp = from.StampReconnect();
    EXPECT_TRUE(Bring(request, to, tick_there).ok());
  }

  Catalog catalog;
  BorderLink low{RegionId(1), RegionId(2)}, high{RegionId(2), RegionId(1)};
  bool came = false;
};

TEST_F(BorderLinkTest, WhatIsPromisedNeedNotCome) {
  ASSERT_EQ(low.DutyNow(Tick(0)), BorderLink::Duty::kFrame);
  (void)low.StampFrame(3);
  EXPECT_FALSE(low.Ready());
  ASSERT_TRUE(Bring(Made(high, Tick(0), 3), low, Tick(0)).ok());
  for (std::uint64_t t = 0; t < 4; ++t) {
    ASSERT_TRUE(low.Ready()) << t;
    EXPECT_EQ(low.Take(Tick(t)).tick, Tick(t));
    const BorderLink::Duty duty = low.DutyNow(Tick(t + 1));
    EXPECT_EQ(duty, t < 3 ? BorderLink::Duty::kNothing : BorderLink::Duty::kFrame);
  }
  EXPECT_FALSE(low.Ready());
}

TEST_F(BorderLinkTest, AFrameThatComesEarlyHidesNothingThatWasPromised) {
  (void)low.StampFrame(3);
  ASSERT_TRUE(Bring(Made(high, Tick(0), 2), low, Tick(0)).ok());
  for (int i = 0; i < 2; ++i) ASSERT_EQ(high.DutyNow(Tick(1)), BorderLink::Duty::kNothing);
  ASSERT_TRUE(Bring(Made(high, Tick(3), 0), low, Tick(0)).ok());
  for (std::uint64_t t = 0; t <= 3; ++t) {
    ASSERT_TRUE(low.Ready()) << t;
    EXPECT_EQ(low.Take(Tick(t)).tick, Tick(t));
  }
}

TEST_F(BorderLinkTest, NobodyPromisesWhatIsAwake) {
  (void)low.StampFrame(0);
  EXPECT_THAT(std::string(Bring(Made(high, Tick(0), 3, false), low, Tick(0)).message()), HasSubstr("promises"));
  EXPECT_FALSE(low.Ready());
}

TEST_F(BorderLinkTest, AClosedBorderOpensAtATickThatBothKnow) {
  (void)low.StampFrame(0);
  (void)high.StampFrame(0);
  low.TakeDown();
  EXPECT_TRUE(low.Ready());
  EXPECT_EQ(low.DutyNow(Tick(50)), BorderLink::Duty::kReconnect);
  Request(low, high, Tick(50));
  EXPECT_FALSE(high.up());  // it has heard of the closing
  Request(high, low, Tick(50));
  Request(low, high, Tick(50));
  Request(high, low, Tick(50));
  for (std::uint64_t t = 51; t < 50 + kReconnectDelayTicks; ++t) {
    EXPECT_NE(low.DutyNow(Tick(t)), BorderLink::Duty::kFirstFrame);
    EXPECT_NE(high.DutyNow(Tick(t)), BorderLink::Duty::kFirstFrame);
  }
  const Tick at(50 + kReconnectDelayTicks);
  EXPECT_EQ(low.DutyNow(at), BorderLink::Duty::kFirstFrame);
  EXPECT_EQ(high.DutyNow(at), BorderLink::Duty::kFirstFrame);
  (void)low.StampFrame(0);
  ASSERT_TRUE(Bring(Made(high, at, 0), low, at).ok());
  EXPECT_TRUE(came);
  EXPECT_TRUE(low.up());
  EXPECT_TRUE(low.Ready());
}

TEST_F(BorderLinkTest, WhoIsFarBehindAdoptsTheLaterTick) {
  low.TakeDown();
  high.TakeDown();
  Request(low, high, Tick(900), Tick(100));
  Request(high, low, Tick(100), Tick(900));
  Request(low, high, Tick(900), Tick(100));
  EXPECT_EQ(low.Take(Tick(900)).tick, Tick());
  EXPECT_EQ(high.Take(Tick(100)).tick, Tick(900));
  EXPECT_EQ(high.Take(Tick(901)).tick, Tick());
}

// It may have sent its frame 0 at the tick agreed, between other steps than this side would.
TEST_F(BorderLinkTest, WhoAdoptsATickAgreesAnewOnOneToOpenAt) {
  low.TakeDown();
  Request(low, high, Tick(50));
  Request(high, low, Tick(50));
  Request(low, high, Tick(50));
  Request(high, low, Tick(50));
  low.Jumped();
  const Tick at(50 + kReconnectDelayTicks);
  EXPECT_NE(low.DutyNow(at), BorderLink::Duty::kFirstFrame);
  EXPECT_EQ(high.DutyNow(at), BorderLink::Duty::kFirstFrame);
  (void)high.StampFrame(0);
  Request(low, high, at);
  EXPECT_FALSE(high.up());  // it has heard of it
  Request(high, low, at);
  Request(low, high, at);
  Request(high, low, at);
  EXPECT_EQ(low.DutyNow(at + kReconnectDelayTicks), BorderLink::Duty::kFirstFrame);
  EXPECT_EQ(high.DutyNow(at + kReconnectDelayTicks), BorderLink::Duty::kFirstFrame);
}

// Ticks that run ahead of steps, around a circle of borders, show in some frames of each.
TEST_F(BorderLinkTest, ABorderWhoseTicksDifferAgainAndAgainIsClosed) {
  (void)low.StampFrame(0);
  std::uint64_t steps = 0;
  for (std::uint64_t t = 0; low.up() && t < 400; ++t, ++steps) {
    ASSERT_TRUE(Bring(Made(high, Tick(t + t / 4), 0), low, Tick(t + t / 4)).ok());
    (void)low.Take(Tick(t + t / 4 - (t > 0 && t % 4 == 0 ? 1 : 0)));
    if (low.DutyNow(Tick(t + 1 + t / 4)) == BorderLink::Duty::kFrame) (void)low.StampFrame(0);
  }
  EXPECT_FALSE(low.up());
  EXPECT_GT(steps, 24U);
}

TEST_F(BorderLinkTest, AFrameFromBeforeAClosingIsPassedOver) {
  const BorderFrame late = Made(high, Tick(0), 0);
  low.TakeDown();
  EXPECT_TRUE(Bring(late, low, Tick(0)).ok());
  EXPECT_FALSE(came);
  EXPECT_FALSE(low.up());
}

}  // namespace
}  // namespace tessera::region
