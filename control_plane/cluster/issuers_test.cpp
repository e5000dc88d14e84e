#include "control_plane/cluster/issuers.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "control_plane/testing/fake_backend.h"
#include "control_plane/testing/state_rig.h"

namespace tessera::control {
namespace {

using ::testing::HasSubstr;

class IssuersTest : public ::testing::Test {
 protected:
  std::string WhyNot(const v1::AddIssuerRequest& request) {
    return std::string(issuers_.Add(request, rig_.now).status().message());
  }

  StateRig rig_;
  Issuers issuers_{*rig_.state, SystemRandomBytes};
  const FakeBackend game_{1}, other_{2};
};

TEST_F(IssuersTest, AnIssuerIsFoundByItsKeyUntilItIsRemovedAndInTheNextLife) {
  const auto added = issuers_.Add(game_.Registration("game", "inst-7"), rig_.now);
  ASSERT_TRUE(added.ok()) << added.status();
  EXPECT_EQ(added->cluster_id().size(), 16U);
  const trust::TicketKeyId id = trust::KeyIdOf(trust::PublicKeyOf(game_.seed));
  Issuers next{*rig_.state, SystemRandomBytes};
  ASSERT_TRUE(next.Load().ok());
  ASSERT_NE(next.Find(id), nullptr);
  EXPECT_EQ(next.Find(id)->name(), "game");
  EXPECT_EQ(next.Find(id)->instances(), "inst-7");
  EXPECT_EQ(next.Find(trust::KeyIdOf(trust::PublicKeyOf(other_.seed))), nullptr);
  EXPECT_EQ(next.cluster_id(), added->cluster_id());
  v1::RemoveIssuerRequest remove;
  remove.set_name("game");
  EXPECT_TRUE(next.Remove(remove).ok());
  EXPECT_EQ(next.Find(id), nullptr);
  EXPECT_EQ(next.Remove(remove).code(), absl::StatusCode::kNotFound);
  const auto again = next.Add(game_.Registration("game"), rig_.now);
  ASSERT_TRUE(again.ok()) << again.status();
  EXPECT_EQ(again->cluster_id(), added->cluster_id()) << "the cluster is the one that it was";
}

TEST_F(IssuersTest, WhatCannotBeStoredIsNotThere) {
  rig_.store.FailNext(1);
  EXPECT_EQ(issuers_.Add(game_.Registration("game"), rig_.now).status().code(), absl::StatusCode::kUnavailable);
  EXPECT_EQ(issuers_.List().issuers_size(), 0);
  EXPECT_TRUE(issuers_.cluster_id().empty());
}

TEST_F(IssuersTest, BadRequestsNameTheField) {
  EXPECT_THAT(WhyNot(game_.Registration("Game")), HasSubstr("name: "));
  EXPECT_THAT(WhyNot(game_.Registration("game", "inst 7")), HasSubstr("instances: "));
  v1::AddIssuerRequest request = game_.Registration("game");
  request.set_public_key(std::string(31, 'x'));
  EXPECT_THAT(WhyNot(request), HasSubstr("public_key: 31 bytes"));
  ASSERT_TRUE(issuers_.Add(game_.Registration("game"), rig_.now).ok());
  EXPECT_THAT(WhyNot(other_.Registration("game")), HasSubstr("name: there is an issuer game already"));
  EXPECT_THAT(WhyNot(game_.Registration("other")), HasSubstr("public_key: it is issuer game's already"));
}

TEST_F(IssuersTest, ThereIsAMost) {
  for (int i = 0; i < 100; ++i) {
    const FakeBackend one(static_cast<std::uint8_t>(i + 3));
    ASSERT_TRUE(issuers_.Add(one.Registration("issuer-" + std::to_string(i)), rig_.now).ok());
  }
  EXPECT_EQ(issuers_.Add(game_.Registration("game"), rig_.now).status().code(), absl::StatusCode::kResourceExhausted);
}

}  // namespace
}  // namespace tessera::control
