// Checkpoints on records and entries alone.
#include "control_plane/cluster/instance_checkpoints.h"

#include <gmock/gmock.h>

#include <algorithm>

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
  // Makes one of so many bytes, and returns its tick.
  std::uint64_t Make(InstanceCheckpoints& checkpoints, std::uint64_t bytes) {
    const std::uint64_t tick = *checkpoints.Begin(instance_, rig_.now);
    EXPECT_FALSE(checkpoints.NoteUploaded(UploadOf(1, tick)));
    const auto manifest = checkpoints.NoteUploaded(UploadOf(2, tick));
    EXPECT_TRUE(manifest.has_value());
    checkpoints.NoteMade(instance_, *manifest, bytes, rig_.now);
    return tick;
  }
  std::uint64_t Make() { return Make(checkpoints_, 1000); }
  // Begins one that a worker cannot write.
  void FailOne(const std::string& why) {
    const auto tick = checkpoints_.Begin(instance_, rig_.now);
    ASSERT_TRUE(tick.ok()) << tick.status();
    WorkerEntry& worker = instance_.workers[0];
    worker.order.mutable_checkpoint()->set_tick(*tick);
    worker.report.set_order_revision(worker.order.revision());
    worker.report.set_checkpoint_failure(why);
    checkpoints_.Step(instance_, rig_.now);
    worker.report.clear_checkpoint_failure();
  }
  int EventsWith(const std::string& text) const {
    const auto& events = instance_.record.events();
    return static_cast<int>(std::count_if(events.begin(), events.end(), [&](const v1::InstanceEvent& event) {
      return event.text().find(text) != std::string::npos;
    }));
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

TEST_F(CheckpointsTest, TheOldestGoBeforeTheirNumberSaysSoWhereAllTakeMoreThanTheQuota) {
  Update([](records::Instance& record) { record.set_keep_checkpoints(5); });
  InstanceCheckpoints limited(*rig_.state, 3'000'000);
  std::vector<std::uint64_t> ticks;
  for (int i = 0; i < 5; ++i) {
    rig_.Pass(seconds(10));
    ticks.push_back(Make(limited, 1'000'000));
  }
  ASSERT_EQ(instance_.record.checkpoints_size(), 3);
  EXPECT_EQ(instance_.record.checkpoints(0).tick(), ticks[2]);
  const std::string& id = instance_.record.id();
  EXPECT_EQ(rig_.state->effects().pruned, (std::vector{std::pair(id, ticks[0]), std::pair(id, ticks[1])}));
  EXPECT_EQ(EventsWith("3 of 5 checkpoints are kept: more take over 3 MB (--checkpoint-quota-mb)"), 1) << "not twice";

  rig_.Pass(seconds(10));
  const std::uint64_t last = Make(limited, 3'000'000);
  ASSERT_EQ(instance_.record.checkpoints_size(), 1) << "the newest fits alone";
  EXPECT_EQ(instance_.record.checkpoints(0).tick(), last);
}

TEST_F(CheckpointsTest, OneOfATickThatWasTakenBackTakesThePlaceOfTheOlder) {
  Update([](records::Instance& next) { next.set_keep_checkpoints(3); });
  const std::uint64_t tick = Make();
  Update([](records::Instance& next) {
    next.mutable_checkpoints(0)->set_taken_back(true);
    next.mutable_branch()->set_number(1);
  });
  EXPECT_EQ(Make(), tick) << "the world has come there again";
  ASSERT_EQ(instance_.record.checkpoints_size(), 1);
  EXPECT_FALSE(instance_.record.checkpoints(0).taken_back());
  EXPECT_EQ(instance_.record.checkpoints(0).branch().number(), 1U);
  EXPECT_TRUE(rig_.state->effects().pruned.empty()) << "the files under that tick are the new ones";
}

TEST_F(CheckpointsTest, AWorldAllOfWhoseCheckpointsAreTakenBackFailsWithoutOne) {
  Make();
  Update([](records::Instance& next) { next.mutable_checkpoints(0)->set_taken_back(true); });
  const auto failed = checkpoints_.GiveUp(instance_, InstanceCheckpoints::Cause::kDied, "lost", rig_.now);
  ASSERT_TRUE(failed.has_value());
  EXPECT_EQ(failed->state(), v1::INSTANCE_STATE_FAILED);
}

TEST_F(CheckpointsTest, OneThatIsLargerThanTheQuotaIsNotMadeAndThatIsSaid) {
  InstanceCheckpoints limited(*rig_.state, 3'000'000);
  const std::uint64_t kept = Make(limited, 2'000'000);
  rig_.Pass(seconds(10));
  const auto upload = [&](std::uint32_t region, std::uint64_t tick) {
    v1::UploadCheckpointRequest request = UploadOf(region, tick);
    request.set_size(2'000'000);
    return request;
  };
  for (int i = 0; i < 2; ++i) {
    rig_.state->effects() = {};
    const std::uint64_t tick = *limited.Begin(instance_, rig_.now);
    ASSERT_TRUE(limited.CheckUpload(upload(1, tick), rig_.now).ok());
    ASSERT_FALSE(limited.NoteUploaded(upload(1, tick)));
    EXPECT_TRUE(limited.CheckUpload(upload(1, tick), rig_.now).ok()) << "the same file again is no more";
    const absl::Status refused = limited.CheckUpload(upload(2, tick), rig_.now);
    EXPECT_EQ(refused.code(), absl::StatusCode::kResourceExhausted);
    EXPECT_THAT(std::string(refused.message()), HasSubstr("a checkpoint of 4 MB is larger than the 3 MB"));
    EXPECT_EQ(limited.UnderWay(instance_), 0U);
    EXPECT_EQ(rig_.state->effects().abandoned, (std::vector{std::pair(instance_.record.id(), tick)}));
    const auto& log = rig_.state->effects().log;
    EXPECT_TRUE(
        std::any_of(log.begin(), log.end(), [](const auto& line) { return line.severity == Severity::kError; }));
    EXPECT_TRUE(instance_.over_checkpoint_quota);
    rig_.Pass(seconds(10));
  }
  EXPECT_EQ(EventsWith("no checkpoint: "), 1) << "not with each that is tried";
  ASSERT_EQ(instance_.record.checkpoints_size(), 1);
  EXPECT_EQ(instance_.record.checkpoints(0).tick(), kept) << "the one that it has stays";

  Make(limited, 1'000'000);
  EXPECT_FALSE(instance_.over_checkpoint_quota);
  rig_.Pass(seconds(10));
  const std::uint64_t large = Make(limited, 3'000'001);  // its scene is what is too much
  EXPECT_TRUE(instance_.over_checkpoint_quota);
  EXPECT_EQ(rig_.state->effects().pruned.back(), std::pair(instance_.record.id(), large)) << "its files go";
  EXPECT_EQ(instance_.record.checkpoints_size(), 2);
  EXPECT_EQ(EventsWith("no checkpoint: "), 2);
  EXPECT_EQ(limited.CheckQuota(3'000'000), absl::OkStatus());
  EXPECT_FALSE(limited.CheckQuota(3'000'001).ok());
  EXPECT_TRUE(checkpoints_.CheckQuota(std::uint64_t{1} << 60).ok()) << "no quota, no limit";
}

TEST_F(CheckpointsTest, OneThatIsTooLargeIsTriedAgainAfterAnInterval) {
  Update([](records::Instance& record) { record.set_checkpoint_interval_ms(60'000); });
  InstanceCheckpoints limited(*rig_.state, 1'000'000);
  const std::uint64_t tick = *limited.Begin(instance_, rig_.now);
  v1::UploadCheckpointRequest request = UploadOf(1, tick);
  request.set_size(1'000'001);
  ASSERT_FALSE(limited.CheckUpload(request, rig_.now).ok());
  limited.Step(instance_, rig_.now);
  rig_.Pass(seconds(59));
  limited.Step(instance_, rig_.now);
  EXPECT_EQ(limited.UnderWay(instance_), 0U);
  rig_.Pass(seconds(1));
  limited.Step(instance_, rig_.now);
  EXPECT_NE(limited.UnderWay(instance_), 0U);
}

TEST_F(CheckpointsTest, AFileIsTakenFromWhoIsPlacedForTheTickThatIsBeingMade) {
  const std::uint64_t tick = *checkpoints_.Begin(instance_, rig_.now);
  EXPECT_EQ(*checkpoints_.Begin(instance_, rig_.now), tick) << "one at a time";
  EXPECT_TRUE(checkpoints_.CheckUpload(UploadOf(1, tick), rig_.now).ok());
  EXPECT_EQ(checkpoints_.CheckUpload(UploadOf(1, tick + 1), rig_.now).code(), absl::StatusCode::kFailedPrecondition);
  v1::UploadCheckpointRequest wrong = UploadOf(1, tick);
  wrong.mutable_identity()->set_incarnation(99);
  EXPECT_EQ(checkpoints_.CheckUpload(wrong, rig_.now).code(), absl::StatusCode::kFailedPrecondition);
  wrong.set_host_secret("guess");
  EXPECT_EQ(checkpoints_.CheckUpload(wrong, rig_.now).code(), absl::StatusCode::kUnauthenticated);
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
  EXPECT_EQ(checkpoints_.WhyNotMade(instance_), absl::AbortedError("who runs what is being changed"));
  EXPECT_EQ(checkpoints_.Begin(instance_, rig_.now).status().code(), absl::StatusCode::kAborted);
}

TEST_F(CheckpointsTest, SaysWhyOneWasNotMade) {
  EXPECT_EQ(checkpoints_.WhyNotMade(instance_).code(), absl::StatusCode::kAborted) << "none was begun";
  ASSERT_TRUE(checkpoints_.Begin(instance_, rig_.now).ok());
  rig_.Pass(kCheckpointTimeout + seconds(1));
  checkpoints_.Step(instance_, rig_.now);
  EXPECT_EQ(checkpoints_.WhyNotMade(instance_), absl::DeadlineExceededError("timed out"));
  ASSERT_TRUE(checkpoints_.Begin(instance_, rig_.now).ok());
  checkpoints_.Restarted(instance_);
  EXPECT_EQ(checkpoints_.WhyNotMade(instance_), absl::AbortedError("the world began anew"));
}

TEST_F(CheckpointsTest, ARegionMayMissATickButNotForEver) {
  for (int failure = 1; failure <= 4; ++failure) {
    FailOne("a link is down");
    EXPECT_EQ(checkpoints_.WhyNotMade(instance_), absl::AbortedError("a link is down")) << failure;
  }
  Make();
  for (int failure = 1; failure <= 4; ++failure) FailOne("no room");
  EXPECT_EQ(checkpoints_.WhyNotMade(instance_), absl::AbortedError("no room")) << "one was made since the first";
  FailOne("no room");
  EXPECT_EQ(checkpoints_.WhyNotMade(instance_), absl::InternalError("no room"));
}

TEST_F(CheckpointsTest, AWorldThatIsLostFailsWithoutACheckpointAndIsRestoredWithOne) {
  constexpr auto kDied = InstanceCheckpoints::Cause::kDied;
  const auto failed = checkpoints_.GiveUp(instance_, kDied, "all are dead", rig_.now);
  ASSERT_TRUE(failed.has_value());
  EXPECT_EQ(failed->state(), v1::INSTANCE_STATE_FAILED);
  const std::uint64_t tick = Make();
  EXPECT_FALSE(checkpoints_.GiveUp(instance_, kDied, "all are dead", rig_.now).has_value());
  EXPECT_EQ(instance_.restore_wanted, "all are dead");
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
  EXPECT_FALSE(next.lost_ticks_at_least());
  EXPECT_EQ(FromTimestamp(next.lost_time()), rig_.now.unix_time);
  EXPECT_THAT(next.reason(), HasSubstr("50 ticks lost: all are dead"));
  EXPECT_GT(next.placements(0).incarnation(), instance_.record.last_incarnation());

  instance_.newest_tick = tick + 60;
  EXPECT_EQ(checkpoints_.Restored(instance_, manifest, placed, rig_.now).lost_ticks(), 60U)
      << "told by a worker whose entry begins anew";
  instance_.newest_tick_is_kept = true;
  EXPECT_THAT(checkpoints_.Restored(instance_, manifest, placed, rig_.now).reason(),
              HasSubstr("at least 60 ticks lost"))
      << "its agent had that, and it may have gone on";
  checkpoints_.Restarted(instance_);
  EXPECT_EQ(instance_.newest_tick, tick + 60) << "it may have failed, and be restored later";
}

TEST_F(CheckpointsTest, WhereNobodyKnowsHowFarTheWorldWasItSaysSo) {
  records::Manifest manifest;
  manifest.set_tick(Make());
  PlacementPlan placed;
  placed.map = instance_.map;
  for (const MapRegion& region : instance_.map.regions()) placed.regions.push_back({region.id, alpha_.record.id()});
  for (WorkerEntry& worker : instance_.workers) worker.report.clear_tick();
  instance_.newest_tick = 0;
  const records::Instance next = checkpoints_.Restored(instance_, manifest, placed, rig_.now);
  EXPECT_EQ(next.lost_ticks(), 0U);
  EXPECT_THAT(next.reason(), HasSubstr("nobody knows how many ticks are lost"));
  EXPECT_TRUE(next.lost_ticks_at_least());
  EXPECT_EQ(FromTimestamp(next.lost_time()), rig_.now.unix_time) << "it is a loss, of whatever extent";
}

TEST_F(CheckpointsTest, ARestoreFromTheNewestTickLosesNothing) {
  records::Manifest manifest;
  manifest.set_tick(Make());
  PlacementPlan placed;
  placed.map = instance_.map;
  for (const MapRegion& region : instance_.map.regions()) placed.regions.push_back({region.id, alpha_.record.id()});
  for (WorkerEntry& worker : instance_.workers) worker.report.set_tick(manifest.tick());
  const records::Instance next = checkpoints_.Restored(instance_, manifest, placed, rig_.now);
  EXPECT_THAT(next.reason(), HasSubstr(", 0 ticks lost"));
  EXPECT_FALSE(next.lost_ticks_at_least());
  EXPECT_FALSE(next.has_lost_time());
}

}  // namespace
}  // namespace tessera::control
