// Two regions whose link fails while a body is handed over: the grant is sent again, and taken once.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/region/region.h"
#include "core/region/testing/kept_bodies.h"
#include "core/region/testing/small_world.h"

namespace tessera::region {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

constexpr BodyId kBall{1};

// A ball that flies from region 1 to region 2.
class RegionLinkTest : public ::testing::Test {
 protected:
  RegionLinkTest() {
    Send(kOne, one.Start());
    Send(kTwo, two.Start());
  }
  static Config ConfigOf(RegionId self) {
    Scene scene = Balls({{-0.4, 0, 0}});
    scene.bodies[0].initial.linear_velocity = {6, 0, 0};
    scene.bodies[0].may_sleep = false;
    const PartitionMap map = *MakeGridMap(scene.ground(), 2);
    return {self, Incarnation(1), std::make_shared<const Scene>(std::move(scene)), map, {}, nullptr};
  }
  void Send(RegionId from, const std::vector<OutgoingFrame>& frames) {
    for (const OutgoingFrame& frame : frames) {
      if (lost) continue;
      EXPECT_TRUE((from == kOne ? two : one).Receive(from, frame.bytes).ok());
    }
  }
  // Each region steps once.
  void Step() {
    ASSERT_TRUE(one.CanStep() && two.CanStep());
    const StepResult first = one.Step(), second = two.Step();
    taken_in += first.handed_in + second.handed_in;
    Send(kOne, first.frames);
    Send(kTwo, second.frames);
    EXPECT_FALSE(one.Owns(kBall) && two.Owns(kBall));
  }
  void StepUntilGranted() {
    while (KeptBodies(one).empty()) ASSERT_NO_FATAL_FAILURE(Step());
  }
  // Neither hears the other any more, and both notice; some time later they do again.
  void FailAndReconnect() {
    lost = true;
    Step();
    one.TakeLinkDown(kTwo);
    two.TakeLinkDown(kOne);
    for (int tick = 0; tick < 10; ++tick) Step();
    EXPECT_FALSE(one.IsLinkUp(kTwo));
    EXPECT_THAT(KeptBodies(one), ElementsAre(kBall)) << "no acknowledgement came";
    lost = false;
    for (int tick = 0; tick < 60; ++tick) Step();
    EXPECT_TRUE(one.IsLinkUp(kTwo) && two.IsLinkUp(kOne));
  }
  void ExpectTakenOnce() const {
    EXPECT_EQ(taken_in, 1U);
    EXPECT_FALSE(one.Owns(kBall));
    EXPECT_TRUE(two.Owns(kBall));
    EXPECT_EQ(two.owned()[0].epoch, Epoch(2));
    EXPECT_THAT(KeptBodies(one), IsEmpty()) << "it was acknowledged";
  }

  Region one{ConfigOf(kOne)}, two{ConfigOf(kTwo)};
  bool lost = false;
  std::uint64_t taken_in = 0;
};

TEST_F(RegionLinkTest, AGrantWhoseAcknowledgementWasLostIsSentAgainAndTakenOnce) {
  StepUntilGranted();
  FailAndReconnect();
  ExpectTakenOnce();
}

TEST_F(RegionLinkTest, AGrantThatWasLostIsSentAgainAndTakenOnce) {
  while (KeptBodies(one).empty()) {
    // The frame of the step that grants is lost.
    lost = one.owned()[0].state.position.x + 6.0 / 60 > RegionSettings().hysteresis_m;
    ASSERT_NO_FATAL_FAILURE(Step());
  }
  ASSERT_TRUE(lost);
  one.TakeLinkDown(kTwo);
  two.TakeLinkDown(kOne);
  FailAndReconnect();
  ExpectTakenOnce();
}

}  // namespace
}  // namespace tessera::region
