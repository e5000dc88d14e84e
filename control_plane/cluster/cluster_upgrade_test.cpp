// A world that is to be upgraded stands, and goes on when nothing comes of it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "control_plane/testing/cluster_harness.h"

namespace tessera::control {
namespace {

using std::chrono::seconds;
using testing::Contains;

class UpgradeTest : public testing::Test {
 protected:
  UpgradeTest() {
    harness_.AddHost("alpha", 4);
    id_ = Start(harness_, 2);
  }
  absl::Status Begin(bool validate_only = false) {
    return harness_.cluster().BeginUpgrade(harness_.now, id_, validate_only).status();
  }
  std::uint64_t Tick() {
    const auto tick = harness_.cluster().UpgradeTick(id_);
    return tick.ok() ? tick->value_or(0) : 0;
  }
  std::uint64_t TickOfRegion(int index) { return harness_.Get(id_).region_status(index).report().tick(); }
  std::vector<std::string> Events() {
    std::vector<std::string> texts;
    const v1::Instance world = harness_.Get(id_);
    for (const v1::InstanceEvent& event : world.events()) texts.push_back(event.text());
    return texts;
  }

  ClusterHarness harness_;
  std::string id_;
};

TEST_F(UpgradeTest, ItStandsAfterOneTickAndGoesOnWhenNothingComesOfIt) {
  ASSERT_TRUE(Begin(true).ok());
  harness_.Run(seconds(3));
  EXPECT_EQ(harness_.Get(id_).state(), v1::INSTANCE_STATE_RUNNING) << "it was only asked whether it could be";
  ASSERT_TRUE(Begin().ok());
  EXPECT_EQ(Tick(), 0u) << "it runs still";
  harness_.Run(seconds(3));
  EXPECT_EQ(harness_.Get(id_).state(), v1::INSTANCE_STATE_PAUSED);
  ASSERT_NE(Tick(), 0u);
  EXPECT_EQ(Tick(), TickOfRegion(0));
  EXPECT_EQ(Tick(), TickOfRegion(1));
  EXPECT_EQ(Begin().message(), "id: " + id_ + " is being upgraded already");

  ASSERT_TRUE(harness_.cluster().EndUpgrade(harness_.now, id_, "not upgraded: no room").ok());
  ASSERT_TRUE(harness_.cluster().EndUpgrade(harness_.now, id_, "not upgraded: no room").ok());
  EXPECT_EQ(harness_.Get(id_).state(), v1::INSTANCE_STATE_RUNNING);
  EXPECT_THAT(Events(), Contains("not upgraded: no room"));
  EXPECT_EQ(harness_.cluster().UpgradeTick(id_).status().code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_TRUE(Begin().ok()) << "it may be tried again";
}

TEST_F(UpgradeTest, ItGoesOnWhereTheControlPlaneThatCarriedItOutIsGone) {
  ASSERT_TRUE(Begin().ok());
  harness_.Run(seconds(3));
  ASSERT_EQ(harness_.Get(id_).state(), v1::INSTANCE_STATE_PAUSED);
  harness_.Run(seconds(10));
  ASSERT_EQ(harness_.Get(id_).state(), v1::INSTANCE_STATE_PAUSED) << "it is carried out here";
  harness_.Restart();
  harness_.Run(seconds(3));
  EXPECT_EQ(harness_.Get(id_).state(), v1::INSTANCE_STATE_RUNNING);
  const std::uint64_t tick = TickOfRegion(0);
  harness_.Run(seconds(1));
  EXPECT_GT(TickOfRegion(0), tick);
}

TEST_F(UpgradeTest, OneThatWasPausedBeforeStaysSo) {
  v1::PauseInstanceRequest pause;
  pause.set_id(id_);
  ASSERT_TRUE(harness_.cluster().PauseInstance(harness_.now, pause).ok());
  harness_.Run(seconds(3));
  ASSERT_TRUE(Begin().ok());
  EXPECT_NE(Tick(), 0u) << "at once";
  ASSERT_TRUE(harness_.cluster().EndUpgrade(harness_.now, id_, "not upgraded").ok());
  harness_.Run(seconds(3));
  EXPECT_EQ(harness_.Get(id_).state(), v1::INSTANCE_STATE_PAUSED);
}

TEST_F(UpgradeTest, OneThatDoesNotRunIsRefused) {
  v1::DeleteInstanceRequest remove;
  remove.set_id(id_);
  ASSERT_TRUE(harness_.cluster().DeleteInstance(harness_.now, remove).ok());
  EXPECT_EQ(Begin().message(), "id: " + id_ + " does not run");
  EXPECT_EQ(harness_.cluster().BeginUpgrade(harness_.now, "inst-99", false).status().message(),
            "id: no instance inst-99");
}

}  // namespace
}  // namespace tessera::control
