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

}  // namespace
}  // namespace tessera::client
