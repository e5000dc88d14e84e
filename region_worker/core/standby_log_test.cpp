#include "region_worker/core/standby_log.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/region/log.h"
#include "region_worker/testing/core_rig.h"

namespace tessera::worker {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

class StandbyLogTest : public ::testing::Test {
 protected:
  void SetStandby() { log.SetStandby(rig.kOther, rig.region, rig.actions); }
  void Follow() { log.Follow(rig.links, rig.now, rig.region, rig.actions); }
  // Steps and sends the log of the tick; whether each message that left is a whole state.
  std::vector<bool> Step() {
    Follow();
    rig.actions.clear();
    const region::StepResult result = rig.Step();
    log.Send(result.log, result.tick, rig.now, rig.links, rig.actions);
    std::vector<bool> whole;
    for (const SentMessage& sent : TakeSent(rig.actions)) {
      whole.push_back(region::DecodeLogHeader(sent.message.bytes)->whole);
    }
    return whole;
  }
  void Taken(Tick tick) { log.OnTaken(rig.kOther, tick, rig.region, rig.actions); }

  CoreRig rig;
  StandbyLog log;
};

TEST_F(StandbyLogTest, WithoutAStandbyNothingIsSentAndNoLeaseIsNeeded) {
  rig.LinkUp(rig.kOther);
  EXPECT_THAT(Step(), IsEmpty());
  EXPECT_TRUE(log.LeaseHeld(rig.now));
  EXPECT_FALSE(log.unprotected());
}

TEST_F(StandbyLogTest, BeginsWithAWholeStateOnEachNewLink) {
  SetStandby();
  EXPECT_THAT(Step(), IsEmpty()) << "there is no link yet";
  rig.LinkUp(rig.kOther);
  EXPECT_THAT(Step(), ElementsAre(true));
  EXPECT_THAT(Step(), ElementsAre(false));
  Taken(Tick(3));
  EXPECT_FALSE(log.unprotected());
  rig.links.Down(rig.kOther);
  EXPECT_THAT(Step(), IsEmpty());
  EXPECT_TRUE(log.unprotected());
  rig.LinkUp(rig.kOther);
  EXPECT_THAT(Step(), ElementsAre(true));
}

TEST_F(StandbyLogTest, AnAcknowledgementProtectsAndRenewsTheLeaseFromWhenTheLogWasSent) {
  rig.LinkUp(rig.kOther);
  SetStandby();
  EXPECT_FALSE(log.LeaseHeld(rig.now));
  Step();
  EXPECT_TRUE(log.unprotected());
  const TimePoint sent = rig.now;
  rig.now += Lease::kTtl / 2;
  Taken(rig.region.tick());
  EXPECT_EQ(log.acknowledged(), rig.region.tick());
  EXPECT_EQ(rig.region.acknowledged(), rig.region.tick());
  EXPECT_FALSE(log.unprotected());
  EXPECT_TRUE(log.LeaseHeld(rig.now));
  EXPECT_FALSE(log.LeaseHeld(sent + Lease::kTtl));
}

TEST_F(StandbyLogTest, OthersAcknowledgementsAndThoseOfNothingThatWasSentCountForNothing) {
  rig.LinkUp(rig.kOther);
  SetStandby();
  Taken(Tick(5));
  Step();
  log.OnTaken(RegionId(3), rig.region.tick(), rig.region, rig.actions);
  EXPECT_TRUE(log.unprotected());
  EXPECT_FALSE(log.LeaseHeld(rig.now));
}

TEST_F(StandbyLogTest, AStandbyThatTakesNothingGetsNothingMoreUntilItHasCaughtUp) {
  rig.LinkUp(rig.kOther);
  SetStandby();
  Step();
  Taken(rig.region.tick());
  Step();
  const Tick last = rig.region.tick();
  rig.now += StandbyLog::kJam + std::chrono::milliseconds(1);
  EXPECT_THAT(Step(), IsEmpty());
  EXPECT_TRUE(log.unprotected());
  Taken(last);
  EXPECT_TRUE(log.unprotected());
  EXPECT_THAT(Step(), ElementsAre(true));
}

TEST_F(StandbyLogTest, AGapIsMendedByAWholeState) {
  rig.LinkUp(rig.kOther);
  SetStandby();
  Step();
  EXPECT_THAT(Step(), ElementsAre(false));
  log.OnAgain(RegionId(3), rig.region, rig.actions);
  EXPECT_THAT(Step(), ElementsAre(false));
  log.OnAgain(rig.kOther, rig.region, rig.actions);
  EXPECT_THAT(Step(), ElementsAre(true));
}

TEST_F(StandbyLogTest, AStandbyThatIsNoneAnyMoreIsNotWaitedFor) {
  rig.LinkUp(rig.kOther);
  SetStandby();
  log.SetStandby(RegionId(), rig.region, rig.actions);
  EXPECT_TRUE(log.LeaseHeld(rig.now));
  EXPECT_FALSE(log.unprotected());
  EXPECT_THAT(Step(), IsEmpty());
}

}  // namespace
}  // namespace tessera::worker
