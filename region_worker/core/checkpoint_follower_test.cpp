#include "region_worker/core/checkpoint_follower.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "region_worker/testing/core_rig.h"

namespace tessera::worker {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

class CheckpointFollowerTest : public ::testing::Test {
 protected:
  void Follow(std::uint64_t tick) {
    checkpoints.Follow(StateFile{.tick = Tick(tick), .path = "file", .hash = {}}, rig.region, rig.actions);
  }
  void OrderTheNextWhileOneIsWritten() {
    Follow(0);
    rig.StepTo(Tick(1));
    Follow(1);
    EXPECT_THAT(Written(), SizeIs(1));
  }
  std::vector<WriteCheckpoint> Written() const { return AllOf<WriteCheckpoint>(rig.actions); }

  CoreRig rig;
  CheckpointFollower checkpoints;
};

TEST_F(CheckpointFollowerTest, TheStateIsWrittenOnceRightAfterItsTick) {
  Follow(3);
  rig.StepTo(Tick(2));
  Follow(3);
  EXPECT_THAT(Written(), IsEmpty());
  rig.StepTo(Tick(3));
  Follow(3);
  ASSERT_THAT(Written(), SizeIs(1));
  EXPECT_EQ(Written()[0].state, rig.region.SaveState());
  rig.StepTo(Tick(4));
  Follow(3);
  EXPECT_THAT(Written(), SizeIs(1));
  EXPECT_EQ(checkpoints.tick(), Tick());
  checkpoints.Written(Tick(3), absl::OkStatus(), rig.actions);
  EXPECT_EQ(checkpoints.tick(), Tick(3));
  EXPECT_EQ(checkpoints.failure(), "");
}

TEST_F(CheckpointFollowerTest, AFileThatCannotBeWrittenIsReportedUntilAnotherIsOrdered) {
  Follow(0);
  checkpoints.Written(Tick(0), absl::UnavailableError("disk full"), rig.actions);
  EXPECT_EQ(checkpoints.failure(), "disk full");
  Follow(0);
  EXPECT_EQ(checkpoints.failure(), "disk full");
  Follow(5);
  EXPECT_EQ(checkpoints.failure(), "");
}

TEST_F(CheckpointFollowerTest, ARegionThatStandsTriesAgainWhenItIsAskedAgain) {
  Follow(0);
  checkpoints.Written(Tick(0), absl::UnavailableError("disk full"), rig.actions);
  checkpoints.Follow(std::nullopt, rig.region, rig.actions);
  EXPECT_EQ(checkpoints.failure(), "");
  Follow(0);
  EXPECT_THAT(Written(), SizeIs(2));
}

TEST_F(CheckpointFollowerTest, ATickThatHasPassedCannotBeWritten) {
  rig.StepTo(Tick(5));
  Follow(3);
  EXPECT_THAT(Written(), IsEmpty());
  EXPECT_THAT(checkpoints.failure(), HasSubstr("tick 3 has passed"));
}

TEST_F(CheckpointFollowerTest, NoneIsWrittenWhileAnotherIs) {
  OrderTheNextWhileOneIsWritten();
  EXPECT_EQ(checkpoints.failure(), "") << "it may stand here";
  rig.StepTo(Tick(2));
  Follow(1);
  EXPECT_THAT(Written(), SizeIs(1));
  EXPECT_THAT(checkpoints.failure(), HasSubstr("still being written"));
}

TEST_F(CheckpointFollowerTest, ARegionThatStandsWritesItOnceTheOneBeforeIs) {
  OrderTheNextWhileOneIsWritten();
  checkpoints.Written(Tick(0), absl::OkStatus(), rig.actions);
  Follow(1);
  ASSERT_THAT(Written(), SizeIs(2));
  EXPECT_EQ(Written()[1].tick, Tick(1));
  EXPECT_EQ(checkpoints.failure(), "");
}

TEST_F(CheckpointFollowerTest, NoneIsWrittenWhileABorderIsDown) {
  CoreRig two{2};
  two.region.TakeLinkDown(two.kOther);
  checkpoints.Follow(StateFile{.tick = Tick(0), .path = "file", .hash = {}}, two.region, two.actions);
  EXPECT_THAT(AllOf<WriteCheckpoint>(two.actions), IsEmpty());
  two.StepTo(Tick(1));
  checkpoints.Follow(StateFile{.tick = Tick(0), .path = "file", .hash = {}}, two.region, two.actions);
  EXPECT_THAT(AllOf<WriteCheckpoint>(two.actions), IsEmpty());
  EXPECT_THAT(checkpoints.failure(), HasSubstr("a border's link was down"));
}

}  // namespace
}  // namespace tessera::worker
