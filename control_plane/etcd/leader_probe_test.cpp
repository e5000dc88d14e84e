#include "control_plane/etcd/leader_probe.h"

#include <gtest/gtest.h>

#include "control_plane/testing/loopback_door.h"

namespace tessera::control {
namespace {

class LeaderProbeTest : public ::testing::Test {
 protected:
  // The leader of term 7 was reached.
  LeaderProbeTest() {
    probe_.Begin(7, door_.address());
    EXPECT_FALSE(probe_.IsGone());
    EXPECT_EQ(door_.Accept(), 1);
  }
  LoopbackDoor door_;
  LeaderProbe probe_;
};

TEST_F(LeaderProbeTest, WhoseProcessEndedIsGone) {
  EXPECT_FALSE(probe_.IsGone());
  door_.Close();
  EXPECT_FALSE(probe_.IsGone()) << "one refusal is none";
  EXPECT_TRUE(probe_.IsGone());
  EXPECT_TRUE(probe_.IsGone());
}

TEST_F(LeaderProbeTest, OneConnectionIsEnough) {
  for (int look = 0; look < 5; ++look) EXPECT_FALSE(probe_.IsGone());
  EXPECT_EQ(door_.Accept(), 0);
}

TEST_F(LeaderProbeTest, ADroppedConnectionIsMadeAnew) {
  door_.Drop();
  EXPECT_FALSE(probe_.IsGone());
  EXPECT_EQ(door_.Accept(), 1);
}

TEST_F(LeaderProbeTest, WhoListensAgainIsNotGone) {
  door_.Close();
  EXPECT_FALSE(probe_.IsGone());
  door_.Open();
  EXPECT_FALSE(probe_.IsGone());
  door_.Close();
  EXPECT_FALSE(probe_.IsGone()) << "two refusals, but not in a row";
  EXPECT_TRUE(probe_.IsGone());
}

TEST_F(LeaderProbeTest, SilenceProvesNothing) {
  door_.FallSilent();
  door_.Drop();
  for (int look = 0; look < 3; ++look) EXPECT_FALSE(probe_.IsGone());
}

TEST_F(LeaderProbeTest, TheNextLeaderHasToBeReachedToo) {
  door_.Close();
  probe_.Begin(8, door_.address());
  EXPECT_TRUE(probe_.watches(8));
  for (int look = 0; look < 3; ++look) EXPECT_FALSE(probe_.IsGone());
  door_.Open();
  EXPECT_FALSE(probe_.IsGone());
  door_.Close();
  EXPECT_FALSE(probe_.IsGone());
  EXPECT_TRUE(probe_.IsGone());
}

TEST(LeaderProbeAddressTest, AnAddressThatLeadsNowhereIsNotProbed) {
  for (const char* address : {"", "nonsense", "10.0.0.1", "no.such.host.invalid:7700"}) {
    LeaderProbe probe;
    probe.Begin(7, address);
    EXPECT_FALSE(probe.IsGone()) << address;
    EXPECT_FALSE(probe.IsGone()) << address;
  }
}

}  // namespace
}  // namespace tessera::control
