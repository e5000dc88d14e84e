// Players on records and entries alone.
#include "control_plane/cluster/instance_players.h"

#include <gmock/gmock.h>

#include "control_plane/retry_after.h"
#include "control_plane/testing/state_rig.h"

namespace tessera::control {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

class PlayersTest : public ::testing::Test {
 protected:
  v1::JoinInstanceResponse Join() {
    v1::JoinInstanceRequest request;
    request.set_instance_id(instance_.record.id());
    const auto joined = players_.Join(request, nullptr, rig_.now);
    EXPECT_TRUE(joined.ok()) << joined.status();
    return joined->response;
  }
  absl::Status Leave(const v1::JoinInstanceResponse& joined) {
    v1::LeaveInstanceRequest request;
    request.set_instance_id(instance_.record.id());
    request.set_credential(joined.credential());
    request.set_credential_key(joined.credential_key());
    return players_.Leave(request, rig_.now);
  }
  void SetPolicy(v1::LeaverPolicy policy) {
    records::Instance next = instance_.record;
    next.set_leaver_policy(policy);
    next.set_leaver_grace_ms(10'000);
    ASSERT_TRUE(rig_.state->StoreInstance(instance_, next).ok());
  }
  bool TakeVanished() {
    const auto next = players_.NextVanished(instance_, rig_.now);
    return next && rig_.state->StoreWithPlayers(instance_, instance_.record, *next).ok();
  }
  void Connect(std::uint32_t number) {
    instance_.workers[1].report.add_connected_players(number);
    ++instance_.connections;
  }
  const v1::Player& PlayerAt(std::uint32_t number) const { return instance_.players.Find(number)->player(); }

  StateRig rig_;
  HostEntry& alpha_ = rig_.AddHost("alpha");
  InstanceEntry& instance_ = rig_.AddRunning({&alpha_, &alpha_});
  InstancePlayers players_{*rig_.state, rig_.settings};
};

TEST_F(PlayersTest, AJoinIsStoredBeforeAnyOrderNamesThePlayer) {
  rig_.store.FailNext(1);
  v1::JoinInstanceRequest request;
  request.set_instance_id(instance_.record.id());
  EXPECT_EQ(players_.Join(request, nullptr, rig_.now).status().code(), absl::StatusCode::kUnavailable);
  EXPECT_EQ(instance_.players.size(), 0U);
  EXPECT_FALSE(alpha_.desired_changed);
  EXPECT_EQ(Join().player(), 1U);
  EXPECT_EQ(Join().player(), 2U);
  EXPECT_TRUE(alpha_.desired_changed);
  EXPECT_EQ(instance_.players.size(), 2U);
}

TEST_F(PlayersTest, AJoinWritesABucketAndTheRecordOnceInManyNumbers) {
  EXPECT_EQ(Join().player(), 1U);
  const Revision record = instance_.revision;
  for (std::uint32_t number = 2; number <= kNumbersAtOnce; ++number) EXPECT_EQ(Join().player(), number);
  EXPECT_EQ(instance_.revision, record);
  EXPECT_EQ(Join().player(), kNumbersAtOnce + 1);
  EXPECT_GT(instance_.revision, record);
  // A life of the control plane that knows the store alone gives none of them again.
  const auto next_life = ClusterState::Load(rig_.store);
  ASSERT_TRUE(next_life.ok());
  const InstanceEntry* known = (*next_life)->FindInstance(instance_.record.id());
  EXPECT_EQ(known->players.size(), kNumbersAtOnce + 1);
  EXPECT_GT(known->last_player, kNumbersAtOnce);
}

TEST_F(PlayersTest, ABadNameIsRefusedByItsField) {
  v1::JoinInstanceRequest request;
  request.set_instance_id(instance_.record.id());
  const auto why_not = [&](const std::string& name) {
    request.set_player_name(name);
    return std::string(players_.BeginWait(request).status().message());
  };
  EXPECT_EQ(why_not(std::string(33, 'x')), "player_name: 33 bytes are more than 32");
  EXPECT_EQ(why_not("a\nb"), "player_name: has a control character");
  EXPECT_EQ(why_not("\xff"), "player_name: is not UTF-8");
}

TEST_F(PlayersTest, WhoIsSentAwayByTheGameHasLeftAndReadsWhy) {
  const v1::JoinInstanceResponse joined = Join();
  Join();
  v1::WorkerReport report;
  const auto ended = [&](std::uint32_t player, const std::string& why) {
    v1::EndedPlayer& out = *report.add_ended_players();
    out.set_player(player);
    out.set_reason(why);
  };
  ended(1, "you were idle");
  ended(99, "nobody");
  rig_.store.FailNext(1);
  players_.TakeEnded(instance_, report, rig_.now);
  EXPECT_FALSE(PlayerAt(1).left()) << "the next report says it again";
  players_.TakeEnded(instance_, report, rig_.now);
  players_.TakeEnded(instance_, report, rig_.now);
  EXPECT_TRUE(PlayerAt(1).left());
  EXPECT_EQ(PlayerAt(1).ended_because(), "you were idle");
  EXPECT_FALSE(PlayerAt(2).left());
  v1::JoinInstanceRequest back;
  back.set_instance_id(instance_.record.id());
  back.set_credential(joined.credential());
  back.set_credential_key(joined.credential_key());
  EXPECT_EQ(players_.Join(back, nullptr, rig_.now).status(), absl::AbortedError("you were idle"));
}

TEST_F(PlayersTest, WhoHasLeftIsKeptUntilAllWorkersKnowAndThenForgotten) {
  const auto joined = Join();
  ASSERT_TRUE(Leave(joined).ok());
  EXPECT_TRUE(Leave(joined).ok()) << "again";
  EXPECT_TRUE(PlayerAt(1).left());
  rig_.Pass(rig_.settings.keep_left_players + milliseconds(1));
  players_.Prune(instance_, rig_.now);
  EXPECT_EQ(instance_.players.size(), 1U) << "no worker has heard";
  for (WorkerEntry& worker : instance_.workers) worker.report.set_order_revision(rig_.state->NextRevision());
  players_.Prune(instance_, rig_.now);
  EXPECT_EQ(instance_.players.size(), 0U);
  EXPECT_EQ(Join().player(), 2U) << "a number is not given twice";
}

TEST_F(PlayersTest, WhoVanishesIsParkedAfterTheGraceAndBackWithAConnection) {
  SetPolicy(v1::LEAVER_POLICY_PARK);
  Join();
  EXPECT_FALSE(TakeVanished());
  rig_.Pass(seconds(10));
  ASSERT_TRUE(TakeVanished());
  EXPECT_TRUE(PlayerAt(1).parked());
  EXPECT_FALSE(TakeVanished());
  Connect(1);
  ASSERT_TRUE(TakeVanished());
  EXPECT_FALSE(PlayerAt(1).parked());
}

TEST_F(PlayersTest, AllPlayersAreLookedAtOnceAnIntervalHoweverManyJoin) {
  SetPolicy(v1::LEAVER_POLICY_PARK);
  Join();
  rig_.Pass(seconds(10) - milliseconds(1));
  EXPECT_FALSE(TakeVanished());
  rig_.Pass(milliseconds(1));
  Join();
  EXPECT_FALSE(TakeVanished()) << "it was just looked";
  rig_.Pass(kVanishedInterval);
  ASSERT_TRUE(TakeVanished());
  EXPECT_TRUE(PlayerAt(1).parked());
  EXPECT_FALSE(PlayerAt(2).parked());
  rig_.Pass(seconds(10) - kVanishedInterval);
  ASSERT_TRUE(TakeVanished()) << "its time began when it joined";
  EXPECT_TRUE(PlayerAt(2).parked());
}

TEST_F(PlayersTest, WhoVanishesIsRemovedOrStaysByTheInstancesPolicy) {
  SetPolicy(v1::LEAVER_POLICY_STAY);
  Join();
  Connect(1);
  ASSERT_TRUE(TakeVanished()) << "it has come";
  instance_.workers[1].report.clear_connected_players();
  ++instance_.connections;
  rig_.Pass(seconds(100));
  EXPECT_FALSE(TakeVanished());
  SetPolicy(v1::LEAVER_POLICY_REMOVE);
  rig_.Pass(kVanishedInterval);
  EXPECT_FALSE(TakeVanished());
  rig_.Pass(seconds(10));
  ASSERT_TRUE(TakeVanished());
  EXPECT_TRUE(PlayerAt(1).left());
}

TEST_F(PlayersTest, WhileTheWorldWaitsForASilentHostNobodyHasVanished) {
  SetPolicy(v1::LEAVER_POLICY_REMOVE);
  Join();
  EXPECT_FALSE(TakeVanished());
  instance_.awaits = "waits for host beta";
  rig_.Pass(seconds(100));
  EXPECT_FALSE(TakeVanished());
  instance_.awaits.clear();
  EXPECT_FALSE(TakeVanished()) << "the time of the wait does not count";
  rig_.Pass(seconds(10));
  EXPECT_TRUE(TakeVanished());
}

TEST_F(PlayersTest, ManyWhoVanishAtOnceAreOneLineOfTheLog) {
  SetPolicy(v1::LEAVER_POLICY_REMOVE);
  for (int i = 0; i < 20; ++i) Join();
  EXPECT_FALSE(TakeVanished());
  rig_.Pass(seconds(10));
  rig_.state->effects().log.clear();
  ASSERT_TRUE(TakeVanished());
  ASSERT_EQ(rig_.state->effects().log.size(), 1U);
  EXPECT_THAT(rig_.state->effects().log[0].text, ::testing::HasSubstr("count=20"));
}

TEST_F(PlayersTest, AViewerIsNeitherStoredNorCountedNorOrdered) {
  v1::JoinInstanceRequest request;
  request.set_instance_id(instance_.record.id());
  request.set_viewer(true);
  EXPECT_TRUE(players_.BeginWait(request).ok());
  EXPECT_EQ(players_.Waiting(instance_), 0) << "a lazy world does not start for it";
  const auto first = players_.Join(request, nullptr, rig_.now), second = players_.Join(request, nullptr, rig_.now);
  ASSERT_TRUE(first.ok() && second.ok()) << first.status() << second.status();
  EXPECT_GE(first->response.player(), std::uint32_t{1} << 31);
  EXPECT_NE(first->response.player(), second->response.player());
  EXPECT_FALSE(first->response.credential().empty());
  EXPECT_EQ(instance_.players.size(), 0U);
  EXPECT_FALSE(alpha_.desired_changed);
  EXPECT_TRUE(Leave(first->response).ok()) << "it is no more than not there";
  EXPECT_EQ(Join().player(), 1U);
  request.set_credential(first->response.credential());
  EXPECT_EQ(players_.BeginWait(request).status().code(), absl::StatusCode::kInvalidArgument);
}

// Each time costs a write, and orders to all of its hosts.
TEST_F(PlayersTest, WhoComesBackAgainAndAgainHasToWait) {
  v1::JoinInstanceResponse newest = Join();
  const v1::JoinInstanceResponse other = Join();
  const auto back = [&](const v1::JoinInstanceResponse& as) {
    v1::JoinInstanceRequest request;
    request.set_instance_id(instance_.record.id());
    request.set_credential(as.credential());
    request.set_credential_key(as.credential_key());
    auto joined = players_.Join(request, nullptr, rig_.now);
    if (joined.ok()) newest = joined->response;
    return joined.status();
  };
  for (int time = 0; time < 5; ++time) ASSERT_TRUE(back(newest).ok()) << time;
  const std::uint32_t generation = PlayerAt(1).generation();
  const absl::Status refused = back(newest);
  EXPECT_EQ(refused.code(), absl::StatusCode::kResourceExhausted);
  EXPECT_THAT(std::string(refused.message()),
              ::testing::HasSubstr("credential: player 1 comes back too often: ask again in 1 s"));
  EXPECT_TRUE(RetryAfterOf(refused).has_value());
  EXPECT_EQ(PlayerAt(1).generation(), generation) << "nothing was done";
  const v1::JoinInstanceResponse kept = newest;
  EXPECT_TRUE(back(other).ok()) << "others come back as they did";
  rig_.Pass(milliseconds(1001));
  EXPECT_TRUE(back(kept).ok());
  EXPECT_FALSE(back(newest).ok());
}

TEST_F(PlayersTest, AWorldWithoutPlayersCanBeWatched) {
  records::Instance next = instance_.record;
  next.clear_spawn_points();
  ASSERT_TRUE(rig_.state->StoreInstance(instance_, next).ok());
  v1::JoinInstanceRequest request;
  request.set_instance_id(instance_.record.id());
  EXPECT_EQ(players_.Join(request, nullptr, rig_.now).status().code(), absl::StatusCode::kFailedPrecondition);
  request.set_viewer(true);
  EXPECT_TRUE(players_.Join(request, nullptr, rig_.now).ok());
}

TEST_F(PlayersTest, WaitingJoinsAreCountedByInstance) {
  v1::JoinInstanceRequest request;
  request.set_instance_id(instance_.record.id());
  EXPECT_EQ(*players_.BeginWait(request), &instance_);
  EXPECT_EQ(*players_.BeginWait(request), &instance_);
  EXPECT_EQ(players_.EndWait(instance_.record.id()), &instance_);
  EXPECT_EQ(players_.Waiting(instance_), 1);
  EXPECT_EQ(players_.EndWait("inst-9"), nullptr);
}

}  // namespace
}  // namespace tessera::control
