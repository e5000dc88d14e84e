// Counting by real loopback sockets: what is counted is a matter of the kernel.
#include "control_plane/open_connections.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <chrono>
#include <cstdint>
#include <string>
#include <utility>

#include "control_plane/counted_address.h"

namespace tessera::control {
namespace {

using Refusal = OpenConnections::Refusal;

// A descriptor that is closed once.
class OwnedSocket {
 public:
  explicit OwnedSocket(int fd) : fd_(fd) {}
  OwnedSocket(OwnedSocket&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}
  ~OwnedSocket() { Close(); }
  int fd() const { return fd_; }
  void Close() {
    if (fd_ >= 0) close(std::exchange(fd_, -1));
  }

 private:
  int fd_;
};

class OpenConnectionsTest : public ::testing::Test {
 protected:
  struct Pair {
    OwnedSocket client, accepted;
  };

  void SetUp() override {
    sockaddr_in name = At("127.0.0.1", 0);
    socklen_t size = sizeof name;
    ASSERT_EQ(bind(listening_.fd(), reinterpret_cast<const sockaddr*>(&name), size), 0);
    ASSERT_EQ(listen(listening_.fd(), 16), 0);
    ASSERT_EQ(getsockname(listening_.fd(), reinterpret_cast<sockaddr*>(&name), &size), 0);
    port_ = ntohs(name.sin_port);
  }
  // All of 127/8 is this machine.
  Pair Connect(const std::string& from) const {
    OwnedSocket client(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0));
    const sockaddr_in source = At(from, 0), target = At("127.0.0.1", port_);
    EXPECT_EQ(bind(client.fd(), reinterpret_cast<const sockaddr*>(&source), sizeof source), 0);
    EXPECT_EQ(connect(client.fd(), reinterpret_cast<const sockaddr*>(&target), sizeof target), 0);
    OwnedSocket accepted(accept4(listening_.fd(), nullptr, nullptr, SOCK_CLOEXEC));
    EXPECT_GE(accepted.fd(), 0);
    return {std::move(client), std::move(accepted)};
  }
  static OpenConnections::Clock::time_point After(std::chrono::milliseconds span) {
    return OpenConnections::Clock::time_point{} + std::chrono::hours(1) + span;
  }

 private:
  static sockaddr_in At(const std::string& host, std::uint16_t port) {
    sockaddr_in name{};
    name.sin_family = AF_INET;
    name.sin_port = htons(port);
    inet_pton(AF_INET, host.c_str(), &name.sin_addr);
    return name;
  }
  const OwnedSocket listening_{socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)};
  std::uint16_t port_ = 0;
};

TEST_F(OpenConnectionsTest, AnAddressHasItsShareAndOthersHaveTheirs) {
  OpenConnections open({.from_address = 2, .in_all = 10});
  const Pair a = Connect("127.0.0.1"), b = Connect("127.0.0.1"), c = Connect("127.0.0.1"), d = Connect("127.0.0.2");
  EXPECT_EQ(open.Take(a.accepted.fd(), After({})), Refusal::kNone);
  EXPECT_EQ(open.Take(b.accepted.fd(), After({})), Refusal::kNone);
  EXPECT_EQ(open.Take(c.accepted.fd(), After({})), Refusal::kAddress);
  EXPECT_EQ(open.Take(d.accepted.fd(), After({})), Refusal::kNone);
  EXPECT_EQ(open.Sweep(), 3u);
}

TEST_F(OpenConnectionsTest, OneThatWasClosedMakesRoomAtOnce) {
  OpenConnections open({.from_address = 1, .in_all = 10});
  Pair first = Connect("127.0.0.1");
  ASSERT_EQ(open.Take(first.accepted.fd(), After({})), Refusal::kNone);
  const Pair second = Connect("127.0.0.1");
  first.client.Close();
  EXPECT_EQ(open.Take(second.accepted.fd(), After({})), Refusal::kAddress) << "whoever has it has not closed it";
  first.accepted.Close();
  EXPECT_EQ(open.Take(second.accepted.fd(), After({})), Refusal::kNone);
}

TEST_F(OpenConnectionsTest, ADescriptorThatIsAnotherSocketNowIsNotTheConnection) {
  OpenConnections open({.from_address = 1, .in_all = 10});
  Pair first = Connect("127.0.0.1");
  const int number = first.accepted.fd();
  ASSERT_EQ(open.Take(number, After({})), Refusal::kNone);
  const Pair second = Connect("127.0.0.1");
  const OwnedSocket other(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0));
  ASSERT_EQ(dup3(other.fd(), number, O_CLOEXEC), number) << "gRPC closed it, and somebody else opened a file";
  EXPECT_EQ(open.Take(second.accepted.fd(), After({})), Refusal::kNone);
  EXPECT_EQ(open.Sweep(), 1u);
}

TEST_F(OpenConnectionsTest, ANumberThatComesAgainCountsOnce) {
  OpenConnections open({.from_address = 5, .in_all = 10});
  for (int i = 0; i < 4; ++i) {
    const Pair pair = Connect("127.0.0.1");
    EXPECT_EQ(open.Take(pair.accepted.fd(), After({})), Refusal::kNone);
    EXPECT_EQ(open.Sweep(), 1u);
  }
}

TEST_F(OpenConnectionsTest, AFullDoorAsksForAllOnceInAWhile) {
  OpenConnections open({.from_address = 10, .in_all = 2});
  Pair a = Connect("127.0.0.1"), b = Connect("127.0.0.2");
  const Pair c = Connect("127.0.0.3");
  ASSERT_EQ(open.Take(a.accepted.fd(), After({})), Refusal::kNone);
  ASSERT_EQ(open.Take(b.accepted.fd(), After({})), Refusal::kNone);
  EXPECT_EQ(open.Take(c.accepted.fd(), After({})), Refusal::kDoor);
  a.accepted.Close();
  EXPECT_EQ(open.Take(c.accepted.fd(), After(std::chrono::milliseconds(10))), Refusal::kDoor);
  EXPECT_EQ(open.Take(c.accepted.fd(), After(std::chrono::milliseconds(60))), Refusal::kNone);
}

TEST_F(OpenConnectionsTest, WhatIsNoConnectionIsNotTaken) {
  OpenConnections open({.from_address = 1, .in_all = 1});
  const OwnedSocket unconnected(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0));
  EXPECT_EQ(open.Take(unconnected.fd(), After({})), Refusal::kDoor);
  EXPECT_EQ(open.Sweep(), 0u);
}

TEST_F(OpenConnectionsTest, Ipv4IsItselfAlsoInTheFormOfIpv6) {
  const OwnedSocket both(socket(AF_INET6, SOCK_STREAM | SOCK_CLOEXEC, 0));
  const int off = 0;
  sockaddr_in6 name{};
  name.sin6_family = AF_INET6;
  socklen_t size = sizeof name;
  if (both.fd() < 0 || setsockopt(both.fd(), IPPROTO_IPV6, IPV6_V6ONLY, &off, sizeof off) != 0 ||
      bind(both.fd(), reinterpret_cast<const sockaddr*>(&name), size) != 0) {
    GTEST_SKIP() << "this machine has no IPv6";
  }
  ASSERT_EQ(listen(both.fd(), 1), 0);
  ASSERT_EQ(getsockname(both.fd(), reinterpret_cast<sockaddr*>(&name), &size), 0);
  const OwnedSocket client(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0));
  sockaddr_in target{};
  target.sin_family = AF_INET;
  target.sin_port = name.sin6_port;
  inet_pton(AF_INET, "127.0.0.1", &target.sin_addr);
  ASSERT_EQ(connect(client.fd(), reinterpret_cast<const sockaddr*>(&target), sizeof target), 0);
  const OwnedSocket accepted(accept4(both.fd(), nullptr, nullptr, SOCK_CLOEXEC));
  const Pair plain = Connect("127.0.0.1");
  EXPECT_EQ(CountedAddress(accepted.fd()), CountedAddress(plain.accepted.fd()));
}

}  // namespace
}  // namespace tessera::control
