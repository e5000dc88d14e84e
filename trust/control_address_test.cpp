#include "trust/control_address.h"

#include <gtest/gtest.h>

#include <cstdlib>

namespace tessera::trust {
namespace {

const std::string kFingerprint(64, 'a');

TEST(ControlAddressTest, ReadsItsThreeForms) {
  const auto socket = ParseControlAddress("unix:/run/tessera/control.sock", host::PortRule::kFrom1);
  ASSERT_TRUE(socket.ok()) << socket.status();
  EXPECT_TRUE(socket->is_socket());
  EXPECT_EQ(socket->target(), "unix:/run/tessera/control.sock");
  const auto pinned = ParseControlAddress("[::1]:7700#" + kFingerprint, host::PortRule::kFrom1);
  ASSERT_TRUE(pinned.ok()) << pinned.status();
  EXPECT_FALSE(pinned->is_socket());
  EXPECT_EQ(pinned->target(), "[::1]:7700");
  EXPECT_EQ(pinned->fingerprint, kFingerprint);
  const auto plain = ParseControlAddress("play.example:7700", host::PortRule::kFrom1);
  ASSERT_TRUE(plain.ok()) << plain.status();
  EXPECT_EQ(plain->fingerprint, "");
}

TEST(ControlAddressTest, RefusesWhatIsNone) {
  for (const std::string& bad :
       {std::string(), std::string("nowhere"), std::string("unix:"), std::string("unix:relative.sock"),
        "unix:/" + std::string(kMaxSocketPathBytes, 'x'), std::string("10.0.0.1:0"), std::string("10.0.0.1:7700#"),
        "10.0.0.1:7700#" + std::string(64, 'A'), "10.0.0.1:7700#" + std::string(63, 'a'), "#" + kFingerprint,
        "10.0.0.1:7700#" + kFingerprint + "#" + kFingerprint}) {
    EXPECT_EQ(ParseControlAddress(bad, host::PortRule::kFrom1).status().code(), absl::StatusCode::kInvalidArgument)
        << bad;
  }
}

TEST(ControlAddressTest, SeveralControlPlanesAreAList) {
  const auto list = ParseControlAddresses("10.0.0.1:7700#" + kFingerprint + ",[::1]:7701", host::PortRule::kFrom1);
  ASSERT_TRUE(list.ok()) << list.status();
  ASSERT_EQ(list->size(), 2u);
  EXPECT_EQ(list->at(0).text(), "10.0.0.1:7700#" + kFingerprint);
  EXPECT_EQ(list->at(1).text(), "[::1]:7701");
  EXPECT_EQ(ParseControlAddresses("unix:/a,b/control.sock", host::PortRule::kFrom1)->front().text(),
            "unix:/a,b/control.sock");
  std::string many = "a:1";
  for (std::size_t i = 0; i < kMaxControlAddresses; ++i) many += ",a:1";
  for (const std::string& bad :
       {std::string("a:1,"), std::string("a:1,unix:/control.sock"), std::string(",a:1"), many}) {
    EXPECT_EQ(ParseControlAddresses(bad, host::PortRule::kFrom1).status().code(), absl::StatusCode::kInvalidArgument)
        << bad;
  }
}

TEST(ControlAddressTest, TheDefaultSocketIsTheUsersOwn) {
  setenv("XDG_RUNTIME_DIR", "/run/user/7", 1);
  EXPECT_EQ(DefaultControlSocket(), "/run/user/7/tessera/control.sock");
  unsetenv("XDG_RUNTIME_DIR");
  EXPECT_TRUE(DefaultControlSocket().starts_with("/tmp/tessera-"));
}

}  // namespace
}  // namespace tessera::trust
