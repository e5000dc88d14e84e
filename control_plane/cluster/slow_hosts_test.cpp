// Which hosts a world has to leave, by the reports of its regions alone.
#include "control_plane/cluster/slow_hosts.h"

#include <gmock/gmock.h>

#include "control_plane/control_settings.h"
#include "control_plane/testing/state_rig.h"

namespace tessera::control {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

// Regions 1 and 2 on alpha and beta, of 1000 bodies each, in a world of 60 ticks a second.
class SlowHostsTest : public ::testing::Test {
 protected:
  SlowHostsTest() {
    for (WorkerEntry& worker : instance_.workers) worker.report.set_owned(1000);
    StepsTake(0.010, 0.010);
  }
  void StepsTake(double first_s, double second_s) {
    StateRig::WorkerOf(instance_, 1).report.mutable_step()->set_p50_seconds(first_s);
    StateRig::WorkerOf(instance_, 2).report.mutable_step()->set_p50_seconds(second_s);
  }
  // The last answer of one look a second.
  std::optional<SlowRegion> LookFor(milliseconds span) {
    std::optional<SlowRegion> slow = slow_hosts_.Look(instance_, rig_.now);
    for (; span.count() > 0; span -= seconds(1)) {
      rig_.Pass(seconds(1));
      slow = slow_hosts_.Look(instance_, rig_.now);
    }
    return slow;
  }

  StateRig rig_;
  HostEntry &alpha_ = rig_.AddHost("alpha"), &beta_ = rig_.AddHost("beta");
  InstanceEntry& instance_ = rig_.AddRunning({&alpha_, &beta_});
  SlowHosts slow_hosts_;
};

TEST_F(SlowHostsTest, ARegionIsMovedOnceItHasBeenSlowByItsHostForLongEnough) {
  StepsTake(0.010, 0.030);
  EXPECT_FALSE(LookFor(kSlowHostAfter - seconds(1)).has_value());
  const auto slow = LookFor(seconds(1));
  ASSERT_TRUE(slow.has_value());
  EXPECT_EQ(slow->region, 2u);
  EXPECT_EQ(slow->host_id, beta_.record.id());
  EXPECT_NEAR(slow->cost_ratio, 3, 1e-9);
  EXPECT_EQ(Describe(*slow, "beta"),
            "region 2 on beta: 30 ms a step of 17 ms, and a body costs 3.0 times what it does elsewhere");
}

TEST_F(SlowHostsTest, AMomentOfHealthBeginsItAnew) {
  StepsTake(0.010, 0.030);
  EXPECT_FALSE(LookFor(kSlowHostAfter - seconds(1)).has_value());
  StepsTake(0.010, 0.010);
  EXPECT_FALSE(LookFor(seconds(1)).has_value());
  StepsTake(0.010, 0.030);
  EXPECT_FALSE(LookFor(kSlowHostAfter - seconds(1)).has_value());
}

TEST_F(SlowHostsTest, AHostThatIsSlowerButInTimeIsLeftAlone) {
  StepsTake(0.004, 0.016);
  EXPECT_FALSE(LookFor(2 * kSlowHostAfter).has_value());
}

TEST_F(SlowHostsTest, AWorldThatIsSlowEverywhereAlikeProvesNothingAboutHosts) {
  StepsTake(0.030, 0.040);
  EXPECT_FALSE(LookFor(2 * kSlowHostAfter).has_value());
}

TEST_F(SlowHostsTest, ARegionWithMoreBodiesIsNotItsHostsFault) {
  StepsTake(0.010, 0.030);
  StateRig::WorkerOf(instance_, 2).report.set_owned(3000);
  EXPECT_FALSE(LookFor(2 * kSlowHostAfter).has_value());
}

TEST_F(SlowHostsTest, AWorldOnOneHostHasNothingToCompareWith) {
  InstanceEntry& alone = rig_.AddRunning({&alpha_, &alpha_});
  for (WorkerEntry& worker : alone.workers) {
    worker.report.set_owned(100);
    worker.report.mutable_step()->set_p50_seconds(worker.region == 1 ? 0.100 : 0.010);
  }
  EXPECT_FALSE(slow_hosts_.Look(alone, rig_.now).has_value());
  rig_.Pass(2 * kSlowHostAfter);
  EXPECT_FALSE(slow_hosts_.Look(alone, rig_.now).has_value());
}

// At half the pace a tick takes twice as long, and a paused world is never late.
TEST_F(SlowHostsTest, ATickIsAsLongAsThePaceSays) {
  StepsTake(0.010, 0.030);
  records::Instance slower = instance_.record;
  slower.mutable_map()->mutable_terms()->set_ticks_per_second(30);
  ASSERT_TRUE(rig_.state->StoreInstance(instance_, slower).ok());
  EXPECT_FALSE(LookFor(2 * kSlowHostAfter).has_value());
  slower.mutable_map()->mutable_terms()->set_paused(true);
  ASSERT_TRUE(rig_.state->StoreInstance(instance_, slower).ok());
  StepsTake(0.010, 0.300);
  EXPECT_FALSE(LookFor(2 * kSlowHostAfter).has_value());
}

TEST_F(SlowHostsTest, TheHostIsAvoidedForAWhileAndNothingElseMovedMeanwhile) {
  StepsTake(0.010, 0.030);
  const auto slow = LookFor(kSlowHostAfter);
  ASSERT_TRUE(slow.has_value());
  slow_hosts_.NoteMoved(instance_.number, *slow, rig_.now);
  EXPECT_TRUE(slow_hosts_.Avoids(instance_.number, beta_.record.id(), rig_.now));
  EXPECT_FALSE(slow_hosts_.Avoids(instance_.number, alpha_.record.id(), rig_.now));
  EXPECT_FALSE(LookFor(kSlowHostInterval - seconds(1)).has_value());
  EXPECT_TRUE(LookFor(seconds(1)).has_value()) << "it is slow still";
  EXPECT_FALSE(slow_hosts_.Avoids(instance_.number, beta_.record.id(), rig_.now));
}

}  // namespace
}  // namespace tessera::control
