#include "tests/support/recording_relay.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <chrono>
#include <optional>
#include <utility>

#include "local_cluster/command_error.h"
#include "net/datagram_kind.h"

namespace tessera::support {
namespace {

constexpr std::size_t kLargestDatagram = 1 << 16;
constexpr int kPassPatience_ms = 20;
constexpr std::chrono::seconds kReplayPatience{20};

int UdpSocket() {
  const int fd = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  if (fd < 0) throw local::CommandError("relay: no socket is to be had");
  return fd;
}

sockaddr_in Loopback(std::uint16_t port) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  address.sin_port = htons(port);
  return address;
}

// The next one that is there already; empty: none.
std::vector<std::uint8_t> TakeDatagram(int fd, sockaddr_in* from = nullptr) {
  std::vector<std::uint8_t> datagram(kLargestDatagram);
  socklen_t size = sizeof(sockaddr_in);
  const ssize_t got = recvfrom(fd, datagram.data(), datagram.size(), MSG_DONTWAIT, reinterpret_cast<sockaddr*>(from),
                               from == nullptr ? nullptr : &size);
  datagram.resize(got > 0 ? static_cast<std::size_t>(got) : 0);
  return datagram;
}

net::DatagramKind KindOfDatagram(const std::vector<std::uint8_t>& datagram) {
  return static_cast<net::DatagramKind>(datagram.front());
}

}  // namespace

RecordingRelay::RecordingRelay(std::uint16_t to) : front_(UdpSocket()), back_(UdpSocket()) {
  const sockaddr_in any = Loopback(0), there = Loopback(to);
  sockaddr_in bound{};
  socklen_t size = sizeof bound;
  const bool ready = bind(front_, reinterpret_cast<const sockaddr*>(&any), sizeof any) == 0 &&
                     getsockname(front_, reinterpret_cast<sockaddr*>(&bound), &size) == 0 &&
                     connect(back_, reinterpret_cast<const sockaddr*>(&there), sizeof there) == 0;
  if (!ready) {
    close(front_);
    close(back_);
    throw local::CommandError("relay: no port of the loopback interface is to be had");
  }
  port_ = ntohs(bound.sin_port);
  thread_ = std::thread([this] { Pass(); });
}

RecordingRelay::~RecordingRelay() {
  Stop();
  close(front_);
  close(back_);
}

void RecordingRelay::Stop() {
  stopped_ = true;
  if (thread_.joinable()) thread_.join();
}

void RecordingRelay::Pass() {
  std::optional<sockaddr_in> dialler;
  while (!stopped_) {
    pollfd watched[] = {{.fd = front_, .events = POLLIN, .revents = 0}, {.fd = back_, .events = POLLIN, .revents = 0}};
    if (poll(watched, 2, kPassPatience_ms) <= 0) continue;
    sockaddr_in from{};
    if (Datagram up = TakeDatagram(front_, &from); !up.empty()) {
      dialler = from;
      send(back_, up.data(), up.size(), 0);
      recorded_.push_back(std::move(up));
    }
    if (const Datagram down = TakeDatagram(back_); !down.empty() && dialler) {
      sendto(front_, down.data(), down.size(), 0, reinterpret_cast<const sockaddr*>(&*dialler), sizeof *dialler);
    }
  }
}

RecordingRelay::Replayed RecordingRelay::Replay() const {
  Replayed replayed;
  while (!TakeDatagram(back_).empty()) {  // came after Stop
  }
  const Datagram* hello = nullptr;
  for (const Datagram& datagram : recorded_) {
    const net::DatagramKind kind = KindOfDatagram(datagram);
    if (kind == net::DatagramKind::kHello) {
      hello = &datagram;
      continue;
    }
    (kind == net::DatagramKind::kLogin ? replayed.logins : replayed.sealed) += 1;
    send(back_, datagram.data(), datagram.size(), 0);
  }
  if (hello == nullptr) return replayed;
  // Datagrams are looked at in turn, so all others have been once this one is answered.
  send(back_, hello->data(), hello->size(), 0);
  const auto over = std::chrono::steady_clock::now() + kReplayPatience;
  while (!replayed.answered && std::chrono::steady_clock::now() < over) {
    pollfd watched{.fd = back_, .events = POLLIN, .revents = 0};
    if (poll(&watched, 1, kPassPatience_ms) <= 0) continue;
    const Datagram answer = TakeDatagram(back_);
    if (answer.empty()) continue;
    const net::DatagramKind kind = KindOfDatagram(answer);
    if (kind == net::DatagramKind::kChallenge) replayed.answered = true;
    if (kind == net::DatagramKind::kSealed || kind == net::DatagramKind::kDirect) replayed.opened = true;
  }
  return replayed;
}

}  // namespace tessera::support
