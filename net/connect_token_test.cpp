#include "net/connect_token.h"

#include <gtest/gtest.h>

#include <sstream>

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
  EXPECT_EQ(opened->region, RegionId());
}

TEST(ConnectTokenTest, ARegionsTokenNamesItAndItsLife) {
  const InstanceKey key = MakeInstanceKey();
  const ConnectToken token = {.instance_id = "plaza-1",
                              .expires_unix_s = kNow + 1,
                              .region = RegionId(3),
                              .incarnation = Incarnation(1ull << 40)};
  const auto opened = Open(Seal(token, key), "plaza-1", key, kNow);
  ASSERT_TRUE(opened.ok()) << opened.status();
  EXPECT_EQ(opened->region, RegionId(3));
  EXPECT_EQ(opened->incarnation, Incarnation(1ull << 40));
  EXPECT_EQ(opened->player, PlayerNumber());
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

TEST(SessionKeyTest, IsKnownToWhoHasTheInstanceKeyAndNobodyElse) {
  const InstanceKey key = MakeInstanceKey();
  const Credentials one = Issue(ATokenFor("plaza-1"), key), two = Issue(ATokenFor("plaza-1"), key);
  EXPECT_EQ(SessionKeyOf(one.token, key), one.key);
  EXPECT_FALSE(one.key == two.key);  // each token has a key of its own
  EXPECT_FALSE(SessionKeyOf(one.token, MakeInstanceKey()) == one.key);
}

TEST(SessionKeyTest, NeedsExactly32Bytes) {
  EXPECT_TRUE(SessionKeyFrom(std::string(32, 'k')).ok());
  EXPECT_EQ(SessionKeyFrom("k").status().message(), "session_key has 1 bytes; it needs 32");
}

TEST(SecretTest, IsNotPrinted) {
  std::ostringstream out;
  out << *InstanceKeyFrom(std::string(32, 'k'));
  EXPECT_EQ(out.str(), "(secret)");
}

}  // namespace
}  // namespace tessera::net
