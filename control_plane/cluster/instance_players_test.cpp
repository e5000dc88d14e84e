// Players on records and entries alone.
#include "control_plane/cluster/instance_players.h"

#include <gmock/gmock.h>

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
    const auto joined = players_.Join(request, rig_.now);
    EXPECT_TRUE(joined.ok()) << joined.status();
    return joined->response;
  }
  absl::Status Leave(const v1::JoinInstanceResponse& joined) {
    v1::LeaveInstanceRequest request;
    request.set_instance_id(instance_.record.id());
    request.set_connect_token(joined.connect_token());
    request.set_session_key(joined.session_key());
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
    return next && rig_.state->StoreInstance(instance_, *next).ok();
  }

  StateRig rig_;
  HostEntry& alpha_ = rig_.AddHost("alpha");
  InstanceEntry& instance_ = rig_.AddRunning({&alpha_, &alpha_});
  InstancePlayers players_{*rig_.state, rig_.settings};
};

TEST_F(PlayersTest, AJoinIsStoredBeforeAnyOrderNamesThePlayer) {
  rig_.store.FailNext(1);
  v1::JoinInstanceRequest request;
  request.set_instance_id(instance_.record.id());
  EXPECT_EQ(players_.Join(request, rig_.now).status().code(), absl::StatusCode::kUnavailable);
  EXPECT_EQ(instance_.record.players_size(), 0);
  EXPECT_FALSE(alpha_.desired_changed);
  EXPECT_EQ(Join().player(), 1U);
  EXPECT_EQ(Join().player(), 2U);
  EXPECT_TRUE(alpha_.desired_changed);
  EXPECT_EQ(instance_.record.players_size(), 2);
}

TEST_F(PlayersTest, WhoHasLeftIsKeptUntilAllWorkersKnowAndThenForgotten) {
  const auto joined = Join();
  ASSERT_TRUE(Leave(joined).ok());
  EXPECT_TRUE(Leave(joined).ok()) << "again";
  EXPECT_TRUE(instance_.record.players(0).left());
  rig_.Pass(rig_.settings.keep_left_players + milliseconds(1));
  players_.Prune(instance_, rig_.now);
  EXPECT_EQ(instance_.record.players_size(), 1) << "no worker has heard";
  for (WorkerEntry& worker : instance_.workers) worker.report.set_order_revision(rig_.state->NextRevision());
  players_.Prune(instance_, rig_.now);
  EXPECT_EQ(instance_.record.players_size(), 0);
  EXPECT_EQ(Join().player(), 2U) << "a number is not given twice";
}

TEST_F(PlayersTest, WhoVanishesIsParkedAfterTheGraceAndBackWithAConnection) {
  SetPolicy(v1::LEAVER_POLICY_PARK);
  Join();
  EXPECT_FALSE(TakeVanished());
  rig_.Pass(seconds(10));
  ASSERT_TRUE(TakeVanished());
  EXPECT_TRUE(instance_.record.players(0).parked());
  EXPECT_FALSE(TakeVanished());
  instance_.workers[1].report.add_connected_players(1);
  ASSERT_TRUE(TakeVanished());
  EXPECT_FALSE(instance_.record.players(0).parked());
}

TEST_F(PlayersTest, WhoVanishesIsRemovedOrStaysByTheInstancesPolicy) {
  SetPolicy(v1::LEAVER_POLICY_STAY);
  Join();
  rig_.Pass(seconds(100));
  EXPECT_FALSE(TakeVanished());
  SetPolicy(v1::LEAVER_POLICY_REMOVE);
  EXPECT_FALSE(TakeVanished());
  rig_.Pass(seconds(10));
  ASSERT_TRUE(TakeVanished());
  EXPECT_TRUE(instance_.record.players(0).left());
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
