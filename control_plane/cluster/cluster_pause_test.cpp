// A world is paused, makes single ticks, is set to another pace and goes on.
#include <gtest/gtest.h>

#include <limits>
#include <string>

#include "control_plane/testing/cluster_harness.h"

namespace tessera::control {
namespace {

using std::chrono::seconds;

TEST(PauseTest, AWorldIsPausedByAMapAndNothingElseIsPlannedUntilItGoesOn) {
  ClusterHarness harness;
  harness.AddHost("alpha", 4);
  harness.AddHost("beta", 4);
  const std::string id = Start(harness, 2);
  v1::PauseInstanceRequest pause;
  pause.set_id(id);
  pause.set_validate_only(true);
  ASSERT_TRUE(harness.cluster().PauseInstance(harness.now, pause).ok());
  harness.Run(seconds(3));
  EXPECT_EQ(harness.Get(id).state(), v1::INSTANCE_STATE_RUNNING) << "it was only asked whether it could be";
  pause.set_validate_only(false);
  ASSERT_TRUE(harness.cluster().PauseInstance(harness.now, pause).ok());
  ASSERT_TRUE(harness.cluster().PauseInstance(harness.now, pause).ok());
  harness.Run(seconds(3));
  EXPECT_EQ(harness.Get(id).state(), v1::INSTANCE_STATE_PAUSED);
  EXPECT_EQ(harness.Get(id).ticks_per_second(), 0);
  const v1::Instance paused = harness.Get(id);
  EXPECT_NE(paused.events(paused.events_size() - 1).text().find("paused after tick "), std::string::npos);
  ASSERT_TRUE(Scale(harness, id, 3).ok());
  harness.Restart();
  harness.Run(seconds(3));
  EXPECT_EQ(harness.Get(id).state(), v1::INSTANCE_STATE_PAUSED);
  EXPECT_EQ(harness.Get(id).regions(), 2u) << "it is scaled when it goes on";

  v1::SetPropertyRequest property;
  property.set_id(id);
  EXPECT_EQ(harness.cluster().SetProperty(property).status().code(), absl::StatusCode::kFailedPrecondition);
  v1::ResumeInstanceRequest resume;
  resume.set_id(id);
  ASSERT_TRUE(harness.cluster().ResumeInstance(harness.now, resume).ok());
  EXPECT_EQ(harness.Get(id).state(), v1::INSTANCE_STATE_RUNNING) << "at once: nobody has to agree on a tick";
  harness.Run(seconds(5));
  ExpectSettled(harness, id, 3);
}

TEST(PauseTest, APausedWorldMakesTicksAndAStepThatCannotBeIsRefusedByItsField) {
  ClusterHarness harness;
  harness.AddHost("alpha", 4);
  const std::string id = Start(harness, 2);
  v1::ResumeInstanceRequest step;
  step.set_id(id);
  step.set_ticks(3);
  const auto refused = [&] {
    return std::string(harness.cluster().ResumeInstance(harness.now, step).status().message());
  };
  EXPECT_EQ(refused(), "id: " + id + " is not paused, so it makes no single ticks");
  v1::PauseInstanceRequest pause;
  pause.set_id(id);
  ASSERT_TRUE(harness.cluster().PauseInstance(harness.now, pause).ok());
  harness.Run(seconds(3));
  ASSERT_EQ(harness.Get(id).state(), v1::INSTANCE_STATE_PAUSED);
  const auto tick = [&] { return harness.Get(id).region_status(0).report().tick(); };
  const std::uint64_t begin = tick();
  step.set_ticks(36'001);
  EXPECT_EQ(refused(), "ticks: 36001 is not in 1 to 36000");
  step.set_ticks(3);
  step.set_validate_only(true);
  ASSERT_TRUE(harness.cluster().ResumeInstance(harness.now, step).ok());
  harness.Run(seconds(3));
  EXPECT_EQ(tick(), begin) << "it was only asked whether it could be";
  step.set_validate_only(false);
  ASSERT_TRUE(harness.cluster().ResumeInstance(harness.now, step).ok());
  EXPECT_EQ(refused(), "id: " + id + " is about to stand; try again");
  harness.Run(seconds(3));
  EXPECT_EQ(harness.Get(id).state(), v1::INSTANCE_STATE_PAUSED);
  const v1::Instance now = harness.Get(id);
  ASSERT_EQ(now.region_status_size(), 2);
  for (const v1::RegionStatus& region : now.region_status()) {
    EXPECT_EQ(region.report().tick(), begin + 3) << region.region();
  }
  EXPECT_NE(now.events(now.events_size() - 1).text().find("paused after tick " + std::to_string(begin + 3)),
            std::string::npos);
}

TEST(PauseTest, OnlyAWorldThatRunsIsPausedAndOnlyAtAPaceThatItCanHave) {
  ClusterHarness harness;
  harness.AddHost("alpha", 4);
  v1::PauseInstanceRequest pause;
  pause.set_id("inst-99");
  EXPECT_EQ(harness.cluster().PauseInstance(harness.now, pause).status().message(), "id: no instance inst-99");
  const std::string id = Start(harness, 2);
  v1::SetPaceRequest pace;
  pace.set_id(id);
  for (const double asked : {0.0, 0.5, 1e9, std::numeric_limits<double>::quiet_NaN()}) {
    pace.set_ticks_per_second(asked);
    EXPECT_EQ(harness.cluster().SetPace(harness.now, pace).status().code(), absl::StatusCode::kInvalidArgument);
  }
  v1::DeleteInstanceRequest remove;
  remove.set_id(id);
  ASSERT_TRUE(harness.cluster().DeleteInstance(harness.now, remove).ok());
  pause.set_id(id);
  EXPECT_EQ(harness.cluster().PauseInstance(harness.now, pause).status().message(), "id: " + id + " does not run");
}

}  // namespace
}  // namespace tessera::control
