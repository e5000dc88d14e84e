// Players who join, leave and come back, under a virtual clock.
#include <gmock/gmock.h>

#include "control_plane/testing/cluster_harness.h"

namespace tessera::control {
namespace {

using std::chrono::seconds;

TEST(SessionTest, GivesNumbersTokensAndSpawnRegions) {
  ClusterHarness harness;
  harness.AddHost("alpha", 4);
  const std::string id = Create(harness, TestPlan(4));
  harness.Pump();
  const auto first = *harness.cluster().Join(harness.now, JoinRequest(id, "ann"));
  const auto second = *harness.cluster().Join(harness.now, JoinRequest(id, "bob"));
  EXPECT_EQ(first.response.player(), 1u);
  EXPECT_EQ(second.response.player(), 2u);
  EXPECT_NE(first.response.connect_token(), second.response.connect_token());
  ASSERT_EQ(first.response.regions_size(), 4);
  EXPECT_NE(first.response.regions(0).game_port(), 0u);
  EXPECT_EQ(first.response.regions(0).link_port(), 0u);
  EXPECT_FALSE(AllKnow(harness.cluster().state(), id, second.mark));
  harness.Pump();
  EXPECT_TRUE(AllKnow(harness.cluster().state(), id, second.mark));
  const v1::Instance instance = harness.Get(id);
  ASSERT_EQ(instance.player_list_size(), 2);
  // (10, 10) lies in the first cell of four, (90, 90) in the last.
  EXPECT_EQ(instance.player_list(0).spawn_region(), 1u);
  EXPECT_EQ(instance.player_list(1).spawn_region(), 4u);
}

TEST(SessionTest, RefusesWithAReason) {
  ClusterHarness harness;
  harness.AddHost("alpha", 8);
  const auto refused = [&](const v1::JoinInstanceRequest& request) {
    return harness.cluster().BeginWait(harness.now, request);
  };
  EXPECT_EQ(refused(JoinRequest("inst-7")), absl::NotFoundError("instance_id: no instance inst-7"));
  EXPECT_EQ(refused(JoinRequest("inst-1", std::string(64, 'x'))).code(), absl::StatusCode::kInvalidArgument);
  InstancePlan nobody = TestPlan(1);
  nobody.spawn_points.clear();
  EXPECT_EQ(refused(JoinRequest(Create(harness, nobody))).code(), absl::StatusCode::kFailedPrecondition);
  const std::string id = Create(harness, TestPlan(1));
  harness.Pump();
  v1::DeleteInstanceRequest request;
  request.set_id(id);
  ASSERT_TRUE(harness.cluster().DeleteInstance(harness.now, request).ok());
  harness.Pump();
  EXPECT_EQ(refused(JoinRequest(id)), absl::FailedPreconditionError("instance_id: inst-2 has ended"));
}

TEST(SessionTest, OnlyTheOwnTokenLeaves) {
  ClusterHarness harness;
  auto& agent = harness.AddHost("alpha", 8);
  const std::string id = Create(harness, TestPlan(1)), other = Create(harness, TestPlan(1));
  harness.Pump();
  const auto joined = *harness.cluster().Join(harness.now, JoinRequest(id));
  v1::LeaveInstanceRequest leave;
  leave.set_connect_token(joined.response.connect_token());
  leave.set_session_key(joined.response.session_key());
  leave.set_instance_id(other);
  EXPECT_EQ(harness.cluster().Leave(harness.now, leave).code(), absl::StatusCode::kUnauthenticated);
  leave.set_instance_id(id);
  leave.set_connect_token("forged");
  EXPECT_EQ(harness.cluster().Leave(harness.now, leave).code(), absl::StatusCode::kUnauthenticated);
  leave.set_connect_token(joined.response.connect_token());
  for (const std::string& key : {std::string(), std::string("short"), std::string(32, 'x')}) {
    leave.set_session_key(key);  // who has seen the token go by has no more
    EXPECT_EQ(harness.cluster().Leave(harness.now, leave).code(), absl::StatusCode::kUnauthenticated);
  }
  EXPECT_EQ(harness.Get(id).players(), 1u);
  leave.set_session_key(joined.response.session_key());
  EXPECT_TRUE(harness.cluster().Leave(harness.now, leave).ok());
  EXPECT_TRUE(harness.cluster().Leave(harness.now, leave).ok());
  EXPECT_EQ(harness.Get(id).players(), 0u);
  harness.Pump();
  EXPECT_TRUE(agent.fake.workers.at({id, 1}).order.players(0).left());
  // The player is in the orders for a while, then forgotten; the number is not given again.
  harness.Run(seconds(62));
  EXPECT_EQ(harness.Get(id).player_list_size(), 0);
  EXPECT_EQ(harness.cluster().Join(harness.now, JoinRequest(id))->response.player(), 2u);
}

TEST(SessionTest, WithATokenOfItsOwnAPlayerComesBackAsTheSame) {
  ClusterHarness harness;
  harness.AddHost("alpha", 8);
  const std::string id = Create(harness, TestPlan(2)), other = Create(harness, TestPlan(1));
  harness.Pump();
  const auto first = *harness.cluster().Join(harness.now, JoinRequest(id, "ann"));
  v1::JoinInstanceRequest back = JoinRequest(id, "not ann");
  back.set_connect_token(first.response.connect_token());
  harness.Restart();
  harness.Pump();
  EXPECT_EQ(harness.cluster().Join(harness.now, back).status().code(), absl::StatusCode::kUnauthenticated);
  back.set_session_key(first.response.session_key());
  const auto second = harness.cluster().Join(harness.now, back);
  ASSERT_TRUE(second.ok()) << second.status();
  EXPECT_EQ(second->response.player(), 1u);
  EXPECT_NE(second->response.connect_token(), first.response.connect_token()) << "good for another day";
  EXPECT_TRUE(AllKnow(harness.cluster().state(), id, second->mark)) << "nobody has to hear anything";
  ASSERT_EQ(harness.Get(id).player_list_size(), 1);
  EXPECT_EQ(harness.Get(id).player_list(0).name(), "ann");

  back.set_instance_id(other);
  EXPECT_EQ(harness.cluster().Join(harness.now, back).status().code(), absl::StatusCode::kUnauthenticated);
  back.set_instance_id(id);
  harness.now.unix_time += seconds(24 * 3600 + 1);
  EXPECT_EQ(harness.cluster().Join(harness.now, back).status().code(), absl::StatusCode::kUnauthenticated);
  EXPECT_EQ(harness.Get(id).player_list_size(), 1);
}

TEST(SessionTest, WhoHasLeftForGoodDoesNotComeBack) {
  ClusterHarness harness;
  harness.AddHost("alpha", 8);
  const std::string id = Create(harness, TestPlan(1));
  harness.Pump();
  v1::JoinInstanceRequest back = JoinRequest(id);
  const auto joined = harness.cluster().Join(harness.now, back);
  back.set_connect_token(joined->response.connect_token());
  back.set_session_key(joined->response.session_key());
  v1::LeaveInstanceRequest leave;
  leave.set_instance_id(id);
  leave.set_connect_token(back.connect_token());
  leave.set_session_key(back.session_key());
  ASSERT_TRUE(harness.cluster().Leave(harness.now, leave).ok());
  EXPECT_EQ(harness.cluster().Join(harness.now, back).status().code(), absl::StatusCode::kFailedPrecondition);
}

}  // namespace
}  // namespace tessera::control
