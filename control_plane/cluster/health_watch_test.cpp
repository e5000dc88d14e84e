#include "control_plane/cluster/health_watch.h"

#include <gmock/gmock.h>

#include "control_plane/standbys.h"
#include "control_plane/testing/state_rig.h"

namespace tessera::control {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using ::testing::ElementsAre;
using ::testing::Field;
using ::testing::IsEmpty;
using ::testing::SizeIs;

// Two regions on two hosts, each the other's standby, whose workers step and hear each other unless a test says not.
class HealthWatchTest : public ::testing::Test {
 protected:
  HealthWatchTest() {
    for (WorkerEntry& worker : instance_.workers) worker.report.add_linked_regions(3 - worker.region);
  }
  // As the timer would look, for so long; the faults at the end.
  HealthFaults Pass(milliseconds span) {
    HealthFaults faults;
    for (milliseconds passed{0}; passed < span; passed += milliseconds(100)) {
      rig_.Pass(milliseconds(100));
      for (WorkerEntry& worker : instance_.workers) {
        if (!still_.contains(worker.region)) worker.report.set_tick(worker.report.tick() + 6);
      }
      faults = watch_.Look(instance_, rig_.now);
    }
    return faults;
  }
  // As after a restart of the control plane, before the region's agent attaches.
  void Unheard(std::uint32_t region) {
    WorkerEntry& worker = StateRig::WorkerOf(instance_, region);
    worker.reported = false;
    worker.report.Clear();
    still_.insert(region);
  }
  void Change(const std::function<void(records::Instance&)>& change) {
    records::Instance next = instance_.record;
    change(next);
    ASSERT_TRUE(rig_.state->StoreInstance(instance_, next).ok());
  }

  StateRig rig_;
  HostEntry &alpha_ = rig_.AddHost("alpha"), &beta_ = rig_.AddHost("beta");
  InstanceEntry& instance_ = rig_.AddRunning({&alpha_, &beta_});
  std::set<std::uint32_t> still_;  // regions that do not step
  HealthWatch watch_{*rig_.state};
};

TEST_F(HealthWatchTest, AWorldInGoodHealthHasNoFaults) { EXPECT_EQ(Pass(seconds(20)).Text(), ""); }

TEST_F(HealthWatchTest, ARegionOfWhichNothingWasHeardSinceTheStartIsNotKnownToStep) {
  Unheard(2);
  EXPECT_EQ(Pass(milliseconds(1700)).Text(), "") << "agents dial again within a second or two";
  EXPECT_EQ(Pass(milliseconds(100)).Text(), "not known to step yet: region 2") << "before RUNNING is false for 2 s";
  EXPECT_THAT(Pass(milliseconds(200)).still, IsEmpty()) << "no event for who attaches late";
  const HealthFaults faults = Pass(seconds(10));
  EXPECT_THAT(faults.still, ElementsAre(2));
  EXPECT_THAT(faults.unknown, ElementsAre(2)) << "and that is all that is said of it";
  beta_.lost = true;
  EXPECT_THAT(Pass(milliseconds(100)).still, IsEmpty()) << "then its host is silent, which is told elsewhere";
}

TEST_F(HealthWatchTest, OneReportOfARegionShowsNoStep) {
  const WorkerEntry heard = instance_.workers[1];
  Unheard(2);
  EXPECT_EQ(Pass(milliseconds(1500)).Text(), "");
  instance_.workers[1] = heard;
  EXPECT_EQ(Pass(milliseconds(300)).Text(), "not known to step yet: region 2") << "it may have stood before";
  still_ = {};
  EXPECT_EQ(Pass(milliseconds(100)).Text(), "");
  still_ = {2};
  EXPECT_EQ(Pass(milliseconds(2200)).Text(), "no steps are known of region 2") << "from now on it is one that stopped";
}

TEST_F(HealthWatchTest, WhatItsStandbyGainsWasSteppedByARegionThatIsNotHeardYet) {
  Unheard(2);
  v1::StandbyStatus& copy = *instance_.workers[0].report.mutable_standby_copies(0);
  for (int i = 0; i < 30; ++i) {
    copy.set_tick(copy.tick() + 6);
    EXPECT_EQ(Pass(milliseconds(100)).Text(), "") << i;
  }
  copy.set_incarnation(99);
  EXPECT_THAT(Pass(milliseconds(2200)).still, ElementsAre(2)) << "that is another life's";
}

TEST_F(HealthWatchTest, AStandbyWithoutAWholeCopyIsNamedAfterItsPatience) {
  instance_.workers[1].report.clear_standby_copies();
  EXPECT_EQ(Pass(seconds(5)).Text(), "") << "a copy takes a moment";
  EXPECT_EQ(Pass(milliseconds(200)).Text(), "region 1 on alpha: its standby, region 2 on beta, has no whole copy");
  v1::StandbyStatus& copy = *instance_.workers[1].report.add_standby_copies();
  copy.set_incarnation(instance_.workers[0].incarnation);
  EXPECT_EQ(Pass(milliseconds(100)).Text(), "");
}

TEST_F(HealthWatchTest, ARegionWhoseStandbyDoesNotTakeItsLogIsUncovered) {
  instance_.workers[0].report.set_unprotected(true);
  EXPECT_THAT(Pass(milliseconds(5200)).uncovered, ElementsAre("region 1 on alpha: its standby, region 2 on beta, has "
                                                              "no whole copy"));
}

TEST_F(HealthWatchTest, ARegionWithoutAStandbyIsNamedThoughOthersAreThere) {
  Change([](records::Instance& next) { next.mutable_map()->mutable_regions(1)->set_standby(0); });
  EXPECT_EQ(Pass(milliseconds(5200)).Text(), "region 2 on beta: it has no standby");
}

TEST_F(HealthWatchTest, AWorldOfOneRegionHasNoneByItsNature) {
  InstanceEntry& alone = rig_.AddRunning({&alpha_});
  HealthFaults faults;
  for (int i = 0; i < 100; ++i) {
    rig_.Pass(milliseconds(100));
    alone.workers[0].report.set_tick(alone.workers[0].report.tick() + 6);
    faults = watch_.Look(alone, rig_.now);
  }
  EXPECT_EQ(faults.Text(), "");
}

TEST_F(HealthWatchTest, ARegionThatDoesNotStepIsStillWithinTwoSeconds) {
  EXPECT_EQ(Pass(milliseconds(300)).Text(), "");
  still_ = {2};
  EXPECT_THAT(Pass(seconds(2)).still, IsEmpty());
  EXPECT_EQ(Pass(milliseconds(200)).Text(), "no steps are known of region 2");
  still_ = {1, 2};
  EXPECT_EQ(Pass(milliseconds(2200)).Text(), "no steps are known of regions 1, 2");
  still_ = {};
  EXPECT_EQ(Pass(milliseconds(100)).Text(), "");
}

TEST_F(HealthWatchTest, APauseAFailoverAndASlowPaceAreNoFaults) {
  still_ = {1, 2};
  Change([](records::Instance& next) { next.mutable_map()->mutable_terms()->set_paused(true); });
  EXPECT_EQ(Pass(seconds(10)).Text(), "");
  Change([](records::Instance& next) {
    next.mutable_map()->clear_terms();
    next.mutable_failover()->add_dead()->set_region(3);
  });
  EXPECT_EQ(Pass(seconds(10)).Text(), "") << "that is told of as a failover";
  Change([](records::Instance& next) {
    next.clear_failover();
    next.mutable_map()->mutable_terms()->set_ticks_per_second(1);
  });
  EXPECT_EQ(Pass(milliseconds(2400)).Text(), "") << "a step a second";
  EXPECT_THAT(Pass(milliseconds(300)).still, ElementsAre(1, 2));
}

TEST_F(HealthWatchTest, NeighboursWithoutALinkAreNamed) {
  instance_.workers[1].report.clear_linked_regions();
  EXPECT_EQ(Pass(seconds(5)).Text(), "");
  const HealthFaults faults = Pass(milliseconds(200));
  EXPECT_THAT(faults.cut, ElementsAre(AllOf(Field(&CutLink::one, 1U), Field(&CutLink::other, 2U),
                                            Field(&CutLink::since, rig_.now.steady - milliseconds(5100)))));
  EXPECT_EQ(faults.Text(), "regions 1 and 2 have no link");
}

TEST_F(HealthWatchTest, NeighboursThatHearEachOtherInBetweenAreNotNamed) {
  for (int i = 0; i < 5; ++i) {
    instance_.workers[1].report.clear_linked_regions();
    EXPECT_EQ(Pass(seconds(4)).Text(), "");
    instance_.workers[1].report.add_linked_regions(1);
    EXPECT_EQ(Pass(milliseconds(100)).Text(), "");
  }
}

TEST_F(HealthWatchTest, ARegionWithoutALeaseIsNotCutFromNeighboursThatHearNothingOfIt) {
  instance_.workers[1].report.clear_linked_regions();
  EXPECT_THAT(Pass(seconds(3)).cut, IsEmpty());
  instance_.workers[0].report.set_paused(true);
  EXPECT_THAT(Pass(seconds(20)).cut, IsEmpty());
  instance_.workers[0].report.set_paused(false);
  EXPECT_THAT(Pass(milliseconds(1900)).cut, IsEmpty()) << "with the 3 s before it";
  EXPECT_THAT(Pass(milliseconds(400)).cut, SizeIs(1)) << "that heard nothing all the time";
}

TEST_F(HealthWatchTest, TimeInWhichNobodyLookedProvesNothing) {
  still_ = {1};
  instance_.workers[0].report.set_unprotected(true);
  instance_.workers[1].report.clear_linked_regions();
  Pass(milliseconds(100));
  rig_.Pass(seconds(30));  // this process stood still
  EXPECT_EQ(watch_.Look(instance_, rig_.now).Text(), "");
}

TEST_F(HealthWatchTest, WhatIsToldOtherwiseIsNotToldTwice) {
  still_ = {1, 2};
  beta_.lost = true;
  instance_.workers[0].gone = true;
  EXPECT_EQ(Pass(seconds(10)).Text(), "");
}

}  // namespace
}  // namespace tessera::control
