// Checkpoints on records and entries alone.
#include "control_plane/cluster/instance_checkpoints.h"

#include <gmock/gmock.h>

#include "control_plane/control_settings.h"
#include "control_plane/secrets.h"
#include "control_plane/testing/state_rig.h"

namespace tessera::control {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using ::testing::HasSubstr;

class CheckpointsTest : public ::testing::Test {
 protected:
  CheckpointsTest() {
    records::Host host = alpha_.record;
    host.set_secret_hash(HashSecret("secret"));
    EXPECT_TRUE(rig_.state->StoreHost(alpha_, host).ok());
  }
  v1::UploadCheckpointRequest UploadOf(std::uint32_t region, std::uint64_t tick) {
    v1::UploadCheckpointRequest request;
    request.set_host_id(alpha_.record.id());
    request.set_host_secret("secret");
    *request.mutable_identity() = StateRig::IdentityOf(instance_, StateRig::WorkerOf(instance_, region));
    request.set_tick(tick);
    request.set_hash("hash");
    return request;
  }
  void Update(const std::function<void(records::Instance&)>& change) {
    records::Instance next = instance_.record;
    change(next);
    ASSERT_TRUE(rig_.state->StoreInstance(instance_, next).ok());
  }
  // Makes one, and returns its tick.
  std::uint64_t Make() {
    const std::uint64_t tick = *checkpoints_.Begin(instance_, rig_.now);
    EXPECT_FALSE(checkpoints_.NoteUploaded(UploadOf(1, tick)));
    const auto manifest = checkpoints_.NoteUploaded(UploadOf(2, tick));
    EXPECT_TRUE(manifest.has_value());
    checkpoints_.NoteMade(instance_, *manifest, 1000, rig_.now);
    return tick;
  }

  StateRig rig_;
  HostEntry& alpha_ = rig_.AddHost("alpha");
  InstanceEntry& instance_ = rig_.AddRunning({&alpha_, &alpha_});
  InstanceCheckpoints checkpoints_{*rig_.state};
};

TEST_F(CheckpointsTest, IsWholeWithTheLastFileAndTheOldestGo) {
  Update([](records::Instance& record) { record.set_keep_checkpoints(2); });
  std::vector<std::uint64_t> ticks;
  for (int i = 0; i < 3; ++i) {
    rig_.Pass(seconds(10));
    ticks.push_back(Make());
  }
  EXPECT_GT(ticks[0], 100U) << "a tick that all are still to reach";
  ASSERT_EQ(instance_.record.checkpoints_size(), 2);
  EXPECT_EQ(instance_.record.checkpoints(0).tick(), ticks[1]);
  EXPECT_EQ(rig_.state->effects().pruned, (std::vector{std::pair(instance_.record.id(), ticks[0])}));
  EXPECT_EQ(checkpoints_.UnderWay(instance_), 0U);
}

TEST_F(CheckpointsTest, AFileIsTakenFromWhoIsPlacedForTheTickThatIsBeingMade) {
  const std::uint64_t tick = *checkpoints_.Begin(instance_, rig_.now);
  EXPECT_EQ(*checkpoints_.Begin(instance_, rig_.now), tick) << "one at a time";
  EXPECT_TRUE(checkpoints_.CheckUpload(UploadOf(1, tick)).ok());
  EXPECT_EQ(checkpoints_.CheckUpload(UploadOf(1, tick + 1)).code(), absl::StatusCode::kFailedPrecondition);
  v1::UploadCheckpointRequest wrong = UploadOf(1, tick);
  wrong.mutable_identity()->set_incarnation(99);
  EXPECT_EQ(checkpoints_.CheckUpload(wrong).code(), absl::StatusCode::kFailedPrecondition);
  wrong.set_host_secret("guess");
  EXPECT_EQ(checkpoints_.CheckUpload(wrong).code(), absl::StatusCode::kUnauthenticated);
}

TEST_F(CheckpointsTest, IsBegunAtItsIntervalAndAbandonedWhenItCannotBeFinished) {
  Update([](records::Instance& record) { record.set_checkpoint_interval_ms(10'000); });
  checkpoints_.Step(instance_, rig_.now);
  EXPECT_EQ(checkpoints_.UnderWay(instance_), 0U);
  rig_.Pass(seconds(10));
  checkpoints_.Step(instance_, rig_.now);
  const std::uint64_t tick = checkpoints_.UnderWay(instance_);
  EXPECT_NE(tick, 0U);
  Update([](records::Instance& record) { record.mutable_planned()->set_effective_tick(7); });
  EXPECT_FALSE(checkpoints_.NoteUploaded(UploadOf(1, tick)));
  checkpoints_.Step(instance_, rig_.now);
  EXPECT_EQ(checkpoints_.UnderWay(instance_), 0U);
  EXPECT_EQ(rig_.state->effects().abandoned.size(), 1U);
}

TEST_F(CheckpointsTest, AWorldThatIsLostFailsWithoutACheckpointAndIsRestoredWithOne) {
  const auto failed = checkpoints_.GiveUp(instance_, "all are dead", rig_.now);
  ASSERT_TRUE(failed.has_value());
  EXPECT_EQ(failed->state(), v1::INSTANCE_STATE_FAILED);
  const std::uint64_t tick = Make();
  EXPECT_FALSE(checkpoints_.GiveUp(instance_, "all are dead", rig_.now).has_value());
  EXPECT_EQ(checkpoints_.RestoreWanted(instance_), "all are dead");
  EXPECT_EQ(std::exchange(rig_.state->effects().restore, {}).size(), 1U);
  checkpoints_.RetryRestore(instance_, rig_.now);
  EXPECT_TRUE(rig_.state->effects().restore.empty()) << "not at once";
  rig_.Pass(kChangeRetry);
  checkpoints_.RetryRestore(instance_, rig_.now);
  EXPECT_EQ(rig_.state->effects().restore.size(), 1U);

  records::Manifest manifest;
  manifest.set_tick(tick);
  PlacementPlan placed;
  placed.map = instance_.map;
  for (const MapRegion& region : instance_.map.regions()) placed.regions.push_back({region.id, alpha_.record.id()});
  instance_.workers[0].report.set_tick(tick + 50);
  const records::Instance next = checkpoints_.Restored(instance_, manifest, placed, rig_.now);
  EXPECT_EQ(next.state(), v1::INSTANCE_STATE_STARTING);
  EXPECT_EQ(next.lost_ticks(), 50U);
  EXPECT_THAT(next.reason(), HasSubstr("50 ticks lost: all are dead"));
  EXPECT_GT(next.placements(0).incarnation(), instance_.record.last_incarnation());

  instance_.newest_tick = tick + 60;
  EXPECT_EQ(checkpoints_.Restored(instance_, manifest, placed, rig_.now).lost_ticks(), 60U)
      << "told by a worker whose entry begins anew";
  checkpoints_.Restarted(instance_);
  EXPECT_EQ(instance_.newest_tick, 0U);
}

}  // namespace
}  // namespace tessera::control
