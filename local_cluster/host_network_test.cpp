#include "local_cluster/host_network.h"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <thread>

#include "host/child_process.h"
#include "host/temporary_folder.h"

namespace tessera::local {
namespace {

using std::chrono::seconds;

// A socket that listens on the switch's address; its port.
class Listener {
 public:
  explicit Listener(const std::string& address) : fd_(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    sockaddr_in name{};
    name.sin_family = AF_INET;
    inet_pton(AF_INET, address.c_str(), &name.sin_addr);
    socklen_t size = sizeof name;
    EXPECT_EQ(bind(fd_, reinterpret_cast<const sockaddr*>(&name), size), 0);
    EXPECT_EQ(listen(fd_, 8), 0);
    getsockname(fd_, reinterpret_cast<sockaddr*>(&name), &size);
    port_ = ntohs(name.sin_port);
  }
  ~Listener() { close(fd_); }
  int port() const { return port_; }

 private:
  int fd_, port_ = 0;
};

TEST(HostNetworkTest, HostsReachTheSwitchUnlessTheirLinkIsCut) {
  if (absl::Status own = EnterOwnNetwork(); !own.ok()) GTEST_SKIP() << own;
  const auto network = HostNetwork::Create(2);
  ASSERT_TRUE(network.ok()) << network.status();
  const Listener listener((*network)->switch_address());
  const host::TemporaryFolder folder;
  const auto reaches = [&](std::uint32_t host, const char* patience_s = "20") {
    std::vector<std::string> argv = (*network)->Enter(host);
    const std::string dial = "exec 3<>/dev/tcp/" + (*network)->switch_address() + "/" + std::to_string(listener.port());
    argv.insert(argv.end(), {"/usr/bin/timeout", patience_s, "/bin/bash", "-c", dial});
    auto process = host::ChildProcess::Start({.argv = argv, .log_path = folder.path() + "/log"});
    const auto ended = process.ok() ? process->Wait(seconds(30)) : std::nullopt;
    return ended && ended->Clean();
  };
  EXPECT_NE((*network)->address(0), (*network)->address(1));
  EXPECT_TRUE(reaches(0));
  EXPECT_TRUE(reaches(1));
  ASSERT_TRUE((*network)->Cut(1).ok());
  EXPECT_TRUE(reaches(0));
  EXPECT_FALSE(reaches(1, "1"));
  ASSERT_TRUE((*network)->Mend(1).ok());
  EXPECT_TRUE(reaches(1));
}

// One datagram from one host to the other; what came.
class Datagrams {
 public:
  explicit Datagrams(const HostNetwork& network) : network_(network) {}

  bool Arrive(std::uint32_t from, std::uint32_t to) {
    bool arrived = false;
    // Each in a thread of its own, which enters the host's network.
    std::thread([&] {
      ASSERT_TRUE(network_.EnterThread(to).ok());
      const int receiver = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
      sockaddr_in name{};
      name.sin_family = AF_INET;
      name.sin_port = htons(9);
      inet_pton(AF_INET, network_.address(to).c_str(), &name.sin_addr);
      ASSERT_EQ(bind(receiver, reinterpret_cast<const sockaddr*>(&name), sizeof name), 0);
      // Sent again and again: the first one may be lost while the wire's address is looked for.
      for (int i = 0; i < 20 && !arrived; ++i) {
        std::thread([&] {
          ASSERT_TRUE(network_.EnterThread(from).ok());
          const int sender = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
          EXPECT_EQ(sendto(sender, "x", 1, 0, reinterpret_cast<const sockaddr*>(&name), sizeof name), 1);
          close(sender);
        }).join();
        pollfd wait{.fd = receiver, .events = POLLIN, .revents = 0};
        arrived = poll(&wait, 1, 100) == 1;
      }
      close(receiver);
    }).join();
    return arrived;
  }

 private:
  const HostNetwork& network_;
};

TEST(HostNetworkTest, WhatOneHostSendsToAnotherIsLostOneWay) {
  if (absl::Status own = EnterOwnNetwork(); !own.ok()) GTEST_SKIP() << own;
  const auto network = HostNetwork::Create(3);
  ASSERT_TRUE(network.ok()) << network.status();
  Datagrams datagrams(**network);
  EXPECT_TRUE(datagrams.Arrive(0, 1));
  ASSERT_TRUE((*network)->Lose(0, 1).ok());
  EXPECT_FALSE(datagrams.Arrive(0, 1));
  EXPECT_TRUE(datagrams.Arrive(1, 0));
  EXPECT_TRUE(datagrams.Arrive(0, 2));
  ASSERT_TRUE((*network)->Find(0, 1).ok());
  EXPECT_TRUE(datagrams.Arrive(0, 1));
}

}  // namespace
}  // namespace tessera::local
