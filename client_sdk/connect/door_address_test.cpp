#include "client_sdk/connect/door_address.h"

#include <gtest/gtest.h>

#include "host/json_socket.h"
#include "trust/control_address.h"

namespace tessera::client {
namespace {

std::string AddressFault(const std::string& text) { return std::string(ParseDoorAddress(text).status().message()); }

TEST(DoorAddressTest, ASocketIsTheOneBesideTheControlPlanes) {
  const auto address = ParseDoorAddress("unix:/run/tessera/control.sock");
  ASSERT_TRUE(address.ok()) << address.status();
  EXPECT_EQ(address->socket, "/run/tessera/control.sock.json");
  EXPECT_EQ(address->text, "unix:/run/tessera/control.sock");
  EXPECT_TRUE(address->is_socket());
  const auto own = ParseDoorAddress("");
  ASSERT_TRUE(own.ok()) << own.status();
  EXPECT_EQ(own->socket, host::JsonSocket(trust::DefaultControlSocket()));
}

TEST(DoorAddressTest, OverTcpItHasAHostAPortAndAFingerprint) {
  const std::string fingerprint(64, 'a');
  const auto address = ParseDoorAddress("play.example:7704#" + fingerprint);
  ASSERT_TRUE(address.ok()) << address.status();
  EXPECT_EQ(address->host, "play.example");
  EXPECT_EQ(address->port, 7704);
  EXPECT_EQ(address->fingerprint, fingerprint);
  EXPECT_FALSE(address->is_socket());
  EXPECT_EQ(ParseDoorAddress("[::1]:80")->host, "::1");
  EXPECT_EQ(ParseDoorAddress("10.0.0.1:80")->fingerprint, "");
}

TEST(DoorAddressTest, WhatIsNoneIsRefusedWithItsText) {
  for (const std::string text : {"nowhere", "host:", ":7704", "host:0", "host:65536", "host:77x", "a b:1", "a/b:1",
                                 "::1:80", "[host]:80", "user@host:80", "host:80?x"}) {
    EXPECT_EQ(AddressFault(text), "\"" + text + "\" is not of the form HOST:PORT");
  }
  EXPECT_EQ(AddressFault("host:80#ab"),
            "\"host:80#ab\": after # comes a fingerprint of 64 hexadecimal digits in lower case");
  EXPECT_EQ(
      AddressFault("host:80#" + std::string(64, 'A')),
      "\"host:80#" + std::string(64, 'A') + "\": after # comes a fingerprint of 64 hexadecimal digits in lower case");
  EXPECT_EQ(AddressFault("unix:control.sock"), "\"unix:control.sock\": the path of a socket begins with /");
  EXPECT_NE(AddressFault("unix:/" + std::string(102, 'x')).find("the path has 108 bytes with .json"),
            std::string::npos);
}

std::string ListFault(const std::string& text) { return std::string(ParseDoorAddresses(text).status().message()); }

TEST(DoorAddressTest, SeveralArePartedByCommas) {
  const std::string fingerprint = "#" + std::string(64, 'a');
  const auto two = ParseDoorAddresses("one.example:7704" + fingerprint + ",[::1]:7704" + fingerprint);
  ASSERT_TRUE(two.ok()) << two.status();
  ASSERT_EQ(two->size(), 2U);
  EXPECT_EQ((*two)[0].host, "one.example");
  EXPECT_EQ((*two)[1].host, "::1");
  EXPECT_EQ((*two)[1].fingerprint, std::string(64, 'a'));
  EXPECT_EQ(ParseDoorAddresses("host:80")->size(), 1U);
  EXPECT_EQ(ParseDoorAddresses("")->front().socket, host::JsonSocket(trust::DefaultControlSocket()));
  // A path may hold commas.
  EXPECT_EQ(ParseDoorAddresses("unix:/a,b:1")->front().socket, "/a,b:1.json");
}

TEST(DoorAddressTest, AListThatIsNoneIsRefusedWithItsText) {
  for (const std::string empty : {",", "host:80,", ",host:80", "host:80,,host:81"}) {
    EXPECT_EQ(ListFault(empty), "\"\" is not of the form HOST:PORT") << empty;
  }
  EXPECT_EQ(ListFault(" "), "\" \" is not of the form HOST:PORT");
  EXPECT_EQ(ListFault("host:80, host:81"), "\" host:81\" is not of the form HOST:PORT");
  EXPECT_EQ(ListFault("host:80,unix:/a"), "\"unix:/a\": a socket stands alone, in no list");
  const std::string two = "a:1#" + std::string(64, 'a') + ",b:1#" + std::string(64, 'b');
  EXPECT_EQ(ListFault(two),
            "\"" + two + "\": control planes of one cluster have one authority; name the same fingerprint for each");
  static_assert(kMostDoorAddresses == trust::kMaxControlAddresses);
  std::string many = "host:1";
  for (int i = 2; i <= 16; ++i) many += ",host:" + std::to_string(i);
  EXPECT_EQ(ParseDoorAddresses(many)->size(), 16U);
  EXPECT_EQ(ListFault(many + ",host:17"), "names 17 control planes, at most 16 are taken");
}

}  // namespace
}  // namespace tessera::client
