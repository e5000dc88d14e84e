#include "control_plane/counted_address.h"

#include <gtest/gtest.h>

#include <string>

namespace tessera::control {
namespace {

TEST(CountedAddressTest, AnIpv4AddressIsItselfWhateverItsPortAndForm) {
  const std::string plain = CountedPeer("ipv4:192.0.2.7:5000");
  EXPECT_EQ(plain, std::string("\xC0\x00\x02\x07", 4));
  EXPECT_EQ(CountedPeer("ipv4:192.0.2.7:6000"), plain);
  EXPECT_EQ(CountedPeer("ipv6:%5B::ffff:192.0.2.7%5D:5000"), plain);
  EXPECT_NE(CountedPeer("ipv4:192.0.2.8:5000"), plain);
}

TEST(CountedAddressTest, AnIpv6AddressIsItsNetwork) {
  const std::string network = CountedPeer("ipv6:%5B2001:db8:0:7::1%5D:5000");
  EXPECT_EQ(network.size(), 8u);
  EXPECT_EQ(CountedPeer("ipv6:[2001:db8:0:7:ffff::2]:9"), network);
  EXPECT_NE(CountedPeer("ipv6:%5B2001:db8:0:8::1%5D:5000"), network);
  EXPECT_EQ(CountedPeer("ipv6:%5Bfe80::1%25eth0%5D:5000"), CountedPeer("ipv6:%5Bfe80::2%5D:5000"));
}

TEST(CountedAddressTest, WhatHasNoAddressCountsByItsName) {
  EXPECT_EQ(CountedPeer("unix:/run/a:1"), "unix:/run/a");
  EXPECT_EQ(CountedPeer("ipv6:rubbish:1"), "ipv6:rubbish");
  EXPECT_EQ(CountedPeer(""), "");
  EXPECT_EQ(CountedAddress(-1), "");
}

}  // namespace
}  // namespace tessera::control
