#include "host/socket_address.h"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include "absl/strings/str_cat.h"

namespace tessera::host {
namespace {

// A socket on a port of 127.0.0.1 that the system chose.
class TakenPort {
 public:
  explicit TakenPort(int type) : fd_(socket(AF_INET, type | SOCK_CLOEXEC, 0)) {
    sockaddr_in name{};
    name.sin_family = AF_INET;
    name.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    EXPECT_EQ(bind(fd_, reinterpret_cast<const sockaddr*>(&name), sizeof name), 0);
    if (type == SOCK_STREAM) {
      EXPECT_EQ(listen(fd_, 1), 0);
    }
    socklen_t size = sizeof name;
    getsockname(fd_, reinterpret_cast<sockaddr*>(&name), &size);
    port_ = ntohs(name.sin_port);
  }
  ~TakenPort() { close(fd_); }
  std::uint16_t port() const { return port_; }

 private:
  int fd_;
  std::uint16_t port_ = 0;
};

TEST(SocketAddressTest, IsHostAndPort) {
  EXPECT_EQ(ParseSocketAddress("[::1]:7700", PortRule::kFrom1)->host, "::1");
  EXPECT_EQ(ParseSocketAddress("control.example:1", PortRule::kFrom1)->port, 1);
  EXPECT_EQ(ParseSocketAddress("a:0", PortRule::kFrom0)->port, 0);
  for (const char* bad : {"", "7700", "host", "host:", ":7700", "host:0", "host:65536", "host:-1", "host:7x",
                          "::1:7700", "ho st:1", "http://host:1", "host:1:2", "[host]:1"}) {
    EXPECT_EQ(std::string(ParseSocketAddress(bad, PortRule::kFrom1).status().message()),
              absl::StrCat("\"", bad, "\" is not of the form HOST:PORT"));
  }
}

TEST(SocketAddressTest, AFaultOfAnAddressToListenAtIsWorded) {
  EXPECT_EQ(ListenAddressFault("0.0.0.0:0"), "");
  EXPECT_EQ(ListenAddressFault("nowhere"), "\"nowhere\" is not of the form HOST:PORT");
}

TEST(SocketAddressTest, IsWrittenAsItIsRead) {
  for (const char* text : {"127.0.0.1:7700", "[::1]:80"}) {
    EXPECT_EQ(ToString(*ParseSocketAddress(text, PortRule::kFrom1)), text);
  }
}

TEST(SocketAddressTest, AnAddressThatCannotBeBoundIsAnErrorThatSaysWhy) {
  EXPECT_TRUE(CheckBindable({"127.0.0.1", 0}, "grpc").ok());
  const TakenPort taken(SOCK_STREAM);
  EXPECT_EQ(std::string(CheckBindable({"127.0.0.1", taken.port()}, "grpc").message()),
            "address 127.0.0.1:" + std::to_string(taken.port()) + " is in use (grpc)");
  EXPECT_EQ(std::string(CheckBindable({"203.0.113.7", 1}, "http").message()),
            "address 203.0.113.7:1 cannot be bound: Cannot assign requested address (http)");
}

TEST(PortsFreeTest, SeesWhichPortsAreTaken) {
  const TakenPort taken(SOCK_DGRAM);
  EXPECT_FALSE(PortsFree("127.0.0.1", "127.0.0.1", taken.port()));
  EXPECT_FALSE(PortsFree("0.0.0.0", "127.0.0.1", static_cast<std::uint16_t>(taken.port() - 1)));  // the second
}

TEST(PortsFreeTest, TheMetricsPortIsLookedForWhereMetricsAreServed) {
  const TakenPort taken(SOCK_STREAM);
  const auto first = static_cast<std::uint16_t>(taken.port() - 2);
  EXPECT_FALSE(PortsFree("127.0.0.2", "127.0.0.1", first));
  EXPECT_TRUE(PortsFree("127.0.0.1", "127.0.0.2", first));
}

}  // namespace
}  // namespace tessera::host
