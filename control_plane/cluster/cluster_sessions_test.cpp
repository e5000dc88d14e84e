// Players who join, leave and come back, under a virtual clock.
#include <gmock/gmock.h>

#include "control_plane/testing/cluster_harness.h"
#include "net/credential.h"

namespace tessera::control {
namespace {

using std::chrono::seconds;

TEST(SessionTest, GivesNumbersCredentialsAndSpawnRegions) {
  ClusterHarness harness;
  harness.AddHost("alpha", 4);
  const std::string id = Create(harness, TestPlan(4));
  harness.Pump();
  const auto first = *harness.cluster().Join(harness.now, JoinRequest(id, "ann"));
  const auto second = *harness.cluster().Join(harness.now, JoinRequest(id, "bob"));
  EXPECT_EQ(first.response.player(), 1u);
  EXPECT_EQ(second.response.player(), 2u);
  EXPECT_NE(first.response.credential(), second.response.credential());
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

TEST(SessionTest, OnlyTheOwnCredentialLeaves) {
  ClusterHarness harness;
  auto& agent = harness.AddHost("alpha", 8);
  const std::string id = Create(harness, TestPlan(1)), other = Create(harness, TestPlan(1));
  harness.Pump();
  const auto joined = *harness.cluster().Join(harness.now, JoinRequest(id));
  v1::LeaveInstanceRequest leave;
  leave.set_credential(joined.response.credential());
  leave.set_credential_key(joined.response.credential_key());
  leave.set_instance_id(other);
  EXPECT_EQ(harness.cluster().Leave(harness.now, leave).code(), absl::StatusCode::kUnauthenticated);
  leave.set_instance_id(id);
  leave.set_credential("forged");
  EXPECT_EQ(harness.cluster().Leave(harness.now, leave).code(), absl::StatusCode::kUnauthenticated);
  leave.set_credential(joined.response.credential());
  for (const std::string& key : {std::string(), std::string("short"), std::string(32, 'x')}) {
    leave.set_credential_key(key);  // those who have seen the credential go by have no more
    EXPECT_EQ(harness.cluster().Leave(harness.now, leave).code(), absl::StatusCode::kUnauthenticated);
  }
  EXPECT_EQ(harness.Get(id).players(), 1u);
  leave.set_credential_key(joined.response.credential_key());
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

TEST(SessionTest, WithACredentialOfItsOwnAPlayerComesBackAsTheSame) {
  ClusterHarness harness;
  harness.AddHost("alpha", 8);
  const std::string id = Create(harness, TestPlan(2)), other = Create(harness, TestPlan(1));
  harness.Pump();
  const auto first = *harness.cluster().Join(harness.now, JoinRequest(id, "ann"));
  v1::JoinInstanceRequest back = JoinRequest(id, "not ann");
  back.set_credential(first.response.credential());
  harness.Restart();
  harness.Pump();
  EXPECT_EQ(harness.cluster().Join(harness.now, back).status().code(), absl::StatusCode::kUnauthenticated);
  back.set_credential_key(first.response.credential_key());
  const auto second = harness.cluster().Join(harness.now, back);
  ASSERT_TRUE(second.ok()) << second.status();
  EXPECT_EQ(second->response.player(), 1u);
  EXPECT_TRUE(AllKnow(harness.cluster().state(), id, second->mark)) << "nobody has to hear anything first";
  ASSERT_EQ(harness.Get(id).player_list_size(), 1);
  EXPECT_EQ(harness.Get(id).player_list(0).name(), "ann");

  back.set_instance_id(other);
  EXPECT_EQ(harness.cluster().Join(harness.now, back).status().code(), absl::StatusCode::kUnauthenticated);
  back.set_instance_id(id);
  harness.now.unix_time += seconds(400 * 24 * 3600);
  EXPECT_TRUE(harness.cluster().Join(harness.now, back).ok()) << "no clock counts";
  EXPECT_EQ(harness.Get(id).player_list_size(), 1);
}

// So the regions know which of two processes is the newer one.
TEST(SessionTest, EachReturnRaisesThePlayersGeneration) {
  ClusterHarness harness;
  auto& agent = harness.AddHost("alpha", 8);
  const std::string id = Create(harness, TestPlan(1));
  harness.Pump();
  const v1::JoinInstanceResponse first = harness.cluster().Join(harness.now, JoinRequest(id))->response;
  v1::JoinInstanceRequest back = JoinRequest(id);
  back.set_credential(first.credential());
  back.set_credential_key(first.credential_key());
  const net::VerificationKey key = *net::VerificationKeyFrom(first.instance_key(), "instance_key");
  const auto generation = [&](const v1::JoinInstanceResponse& joined) {
    const std::string& bytes = joined.credential();
    const auto read =
        net::ReadPlayerCredential({reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()}, id, key);
    EXPECT_TRUE(read.ok()) << read.status();
    EXPECT_EQ(read->player, PlayerNumber(1));
    return read->generation.value();
  };
  EXPECT_EQ(generation(first), 1u);
  EXPECT_EQ(generation(harness.cluster().Join(harness.now, back)->response), 2u);
  harness.Restart();
  harness.Pump();
  const auto third = harness.cluster().Join(harness.now, back);
  ASSERT_TRUE(third.ok()) << "with the first credential still: an answer may have been lost";
  EXPECT_EQ(generation(third->response), 3u) << "it is stored";
  EXPECT_EQ(third->response.instance_key(), first.instance_key());
  harness.Pump();
  EXPECT_EQ(agent.fake.workers.at({id, 1}).order.players(0).generation(), 3u);
}

// Collects all that an agent and a worker are given, from which a host could put a key together.
TEST(SessionTest, OrdersVerifyAndCannotSign) {
  ClusterHarness harness;
  auto& agent = harness.AddHost("alpha", 8);
  const std::string id = Create(harness, TestPlan(2));
  harness.Pump();
  const v1::WorkerOrder& order = agent.fake.workers.at({id, 1}).order;
  const InstanceEntry& instance = *harness.cluster().state().FindInstance(id);
  ASSERT_EQ(instance.record.signing_seed().size(), net::kKeyBytes);
  EXPECT_EQ(order.SerializeAsString().find(instance.record.signing_seed()), std::string::npos);
  const net::VerificationKey key = *net::VerificationKeyFrom(order.instance_key(), "instance_key");
  EXPECT_EQ(key, instance.key.verification_key());
  const std::string& bytes = order.certificate();
  const auto certificate =
      net::ReadWorkerCertificate({reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()}, id, key);
  ASSERT_TRUE(certificate.ok()) << certificate.status();
  EXPECT_EQ(certificate->region, RegionId(1));
  EXPECT_EQ(certificate->incarnation.value(), order.incarnation());
  EXPECT_EQ(std::string(certificate->key.begin(), certificate->key.end()),
            agent.fake.workers.at({id, 1}).report.public_key());
}

TEST(SessionTest, AnInstanceOfAnEarlierVersionIsGivenAKey) {
  ClusterHarness harness;
  harness.AddHost("alpha", 8);
  const std::string id = Create(harness, TestPlan(1));
  harness.Pump();
  const InstanceEntry& instance = *harness.cluster().state().FindInstance(id);
  records::Instance old = instance.record;
  old.clear_signing_seed();
  ASSERT_TRUE(harness.store.Put(InstanceKey(instance.number), old.SerializeAsString(), instance.revision).ok());
  harness.Restart();
  EXPECT_EQ(harness.cluster().state().FindInstance(id)->record.signing_seed().size(), net::kKeyBytes);
}

TEST(SessionTest, WhoHasLeftForGoodDoesNotComeBack) {
  ClusterHarness harness;
  harness.AddHost("alpha", 8);
  const std::string id = Create(harness, TestPlan(1));
  harness.Pump();
  v1::JoinInstanceRequest back = JoinRequest(id);
  const auto joined = harness.cluster().Join(harness.now, back);
  back.set_credential(joined->response.credential());
  back.set_credential_key(joined->response.credential_key());
  v1::LeaveInstanceRequest leave;
  leave.set_instance_id(id);
  leave.set_credential(back.credential());
  leave.set_credential_key(back.credential_key());
  ASSERT_TRUE(harness.cluster().Leave(harness.now, leave).ok());
  EXPECT_EQ(harness.cluster().Join(harness.now, back).status().code(), absl::StatusCode::kFailedPrecondition);
}

}  // namespace
}  // namespace tessera::control
