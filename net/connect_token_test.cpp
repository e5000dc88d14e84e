#include "net/connect_token.h"

#include <gtest/gtest.h>

namespace tessera::net {
namespace {

constexpr std::uint64_t kNow = 1'700'000'000;

ConnectToken ATokenFor(std::string instance) {
  return {.instance_id = std::move(instance), .player = PlayerNumber(7), .expires_unix_s = kNow + 60};
}

TEST(ConnectTokenTest, OpensToWhatWasSealed) {
  const InstanceKey key = MakeInstanceKey();
  const auto opened = Open(Seal(ATokenFor("plaza-1"), key), "plaza-1", key, kNow);
  ASSERT_TRUE(opened.ok()) << opened.status();
  EXPECT_EQ(opened->instance_id, "plaza-1");
  EXPECT_EQ(opened->player, PlayerNumber(7));
  EXPECT_EQ(opened->expires_unix_s, kNow + 60);
}

TEST(ConnectTokenTest, TwoSealsOfOneTokenDiffer) {
  const InstanceKey key = MakeInstanceKey();
  EXPECT_NE(Seal(ATokenFor("plaza-1"), key), Seal(ATokenFor("plaza-1"), key));
}

TEST(ConnectTokenTest, AnyChangedBitIsRefused) {
  const InstanceKey key = MakeInstanceKey();
  const std::vector<std::uint8_t> sealed = Seal(ATokenFor("plaza-1"), key);
  for (std::size_t bit = 0; bit < sealed.size() * 8; ++bit) {
    std::vector<std::uint8_t> damaged = sealed;
    damaged[bit / 8] = static_cast<std::uint8_t>(damaged[bit / 8] ^ (1u << (bit % 8)));
    EXPECT_FALSE(Open(damaged, "plaza-1", key, kNow).ok()) << "bit " << bit;
  }
}

TEST(ConnectTokenTest, AnyOtherLengthIsRefused) {
  const InstanceKey key = MakeInstanceKey();
  std::vector<std::uint8_t> sealed = Seal(ATokenFor("plaza-1"), key);
  for (std::size_t length = 0; length < sealed.size(); ++length) {
    const auto opened = Open(std::span(sealed).first(length), "plaza-1", key, kNow);
    EXPECT_EQ(opened.status().code(), absl::StatusCode::kUnauthenticated) << length;
  }
  sealed.push_back(0);
  EXPECT_EQ(Open(sealed, "plaza-1", key, kNow).status().code(), absl::StatusCode::kUnauthenticated);
}

TEST(ConnectTokenTest, AnotherKeyIsRefused) {
  const auto opened = Open(Seal(ATokenFor("plaza-1"), MakeInstanceKey()), "plaza-1", MakeInstanceKey(), kNow);
  EXPECT_EQ(opened.status().code(), absl::StatusCode::kUnauthenticated);
}

TEST(ConnectTokenTest, AnotherInstanceIsRefusedAndBothAreNamed) {
  const InstanceKey key = MakeInstanceKey();
  const auto opened = Open(Seal(ATokenFor("plaza-1"), key), "plaza-2", key, kNow);
  EXPECT_EQ(opened.status().code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(opened.status().message(), "connect token is for instance plaza-1, this is plaza-2");
}

TEST(ConnectTokenTest, HoldsUntilItsSecondAndNoLonger) {
  const InstanceKey key = MakeInstanceKey();
  const std::vector<std::uint8_t> sealed = Seal(ATokenFor("plaza-1"), key);
  EXPECT_TRUE(Open(sealed, "plaza-1", key, kNow + 59).ok());
  EXPECT_EQ(Open(sealed, "plaza-1", key, kNow + 60).status().code(), absl::StatusCode::kDeadlineExceeded);
}

TEST(InstanceKeyTest, NeedsExactly32Bytes) {
  EXPECT_TRUE(InstanceKeyFrom(std::string(32, 'k')).ok());
  EXPECT_EQ(InstanceKeyFrom(std::string(31, 'k')).status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(InstanceKeyFrom("").status().message(), "instance_key has 0 bytes; it needs 32");
}

TEST(LinkProofTest, DependsOnEveryField) {
  const InstanceKey key = MakeInstanceKey();
  const auto proof = LinkProof(key, "plaza-1", RegionId(1), Incarnation(2), MapVersion(3));
  EXPECT_EQ(proof.size(), 32u);
  EXPECT_EQ(proof, LinkProof(key, "plaza-1", RegionId(1), Incarnation(2), MapVersion(3)));
  EXPECT_NE(proof, LinkProof(MakeInstanceKey(), "plaza-1", RegionId(1), Incarnation(2), MapVersion(3)));
  EXPECT_NE(proof, LinkProof(key, "plaza-2", RegionId(1), Incarnation(2), MapVersion(3)));
  EXPECT_NE(proof, LinkProof(key, "plaza-1", RegionId(2), Incarnation(2), MapVersion(3)));
  EXPECT_NE(proof, LinkProof(key, "plaza-1", RegionId(1), Incarnation(3), MapVersion(3)));
  EXPECT_NE(proof, LinkProof(key, "plaza-1", RegionId(1), Incarnation(2), MapVersion(4)));
}

}  // namespace
}  // namespace tessera::net
