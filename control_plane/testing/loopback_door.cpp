#include "control_plane/testing/loopback_door.h"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <utility>

#include "control_plane/testing/free_address.h"
#include "host/socket_address.h"

namespace tessera::control {
namespace {

constexpr int kDoorBacklog = 8;

sockaddr_in OnLoopback(const std::string& address) {
  sockaddr_in at{};
  at.sin_family = AF_INET;
  at.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  at.sin_port = htons(host::ParseSocketAddress(address, host::PortRule::kFrom1)->port);
  return at;
}

}  // namespace

LoopbackDoor::LoopbackDoor() : address_(FreeLoopbackAddress()) { Open(); }

int LoopbackDoor::Accept() {
  int accepted = 0;
  for (int fd; (fd = accept4(listening_, nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK)) >= 0; ++accepted) {
    taken_.push_back(fd);
  }
  return accepted;
}

void LoopbackDoor::Drop() {
  for (const int fd : std::exchange(taken_, {})) close(fd);
}

void LoopbackDoor::Close() {
  Drop();
  if (const int fd = std::exchange(listening_, -1); fd >= 0) close(fd);
}

void LoopbackDoor::Open() {
  listening_ = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  const int reuse = 1;
  setsockopt(listening_, SOL_SOCKET, SO_REUSEADDR, &reuse, sizeof reuse);
  const sockaddr_in at = OnLoopback(address_);
  EXPECT_EQ(bind(listening_, reinterpret_cast<const sockaddr*>(&at), sizeof at), 0);
  EXPECT_EQ(listen(listening_, kDoorBacklog), 0);
}

// The kernel answers no more than wait to be taken, which nobody does.
void LoopbackDoor::FallSilent() {
  const sockaddr_in at = OnLoopback(address_);
  for (bool answered = true; answered;) {
    const int fd = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
    (void)connect(fd, reinterpret_cast<const sockaddr*>(&at), sizeof at);
    pollfd waited{.fd = fd, .events = POLLOUT, .revents = 0};
    answered = poll(&waited, 1, 50) > 0;
    taken_.push_back(fd);
  }
}

}  // namespace tessera::control
