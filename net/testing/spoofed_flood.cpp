#include "net/testing/spoofed_flood.h"

#include <arpa/inet.h>
#include <enet/enet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstring>

#include "net/handshake.h"
#include "net/protocol.h"

namespace tessera::net {
namespace {

constexpr std::uint32_t kFirstAddress = 0x7f010001;  // 127.1.0.1

sockaddr_in Loopback(std::uint32_t address, std::uint16_t port) {
  sockaddr_in result{};
  result.sin_family = AF_INET;
  result.sin_addr.s_addr = htonl(address);
  result.sin_port = htons(port);
  return result;
}

}  // namespace

SpoofedFlood::SpoofedFlood(std::size_t count) {
  for (std::size_t i = 0; i < count; ++i) {
    const int fd = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
    if (fd < 0) return;
    const sockaddr_in self = Loopback(kFirstAddress + static_cast<std::uint32_t>(i), 0);
    if (bind(fd, reinterpret_cast<const sockaddr*>(&self), sizeof self) != 0) {
      close(fd);
      return;
    }
    sockets_.push_back(fd);
  }
}

SpoofedFlood::~SpoofedFlood() {
  for (const int fd : sockets_) close(fd);
}

void SpoofedFlood::Send(std::uint16_t port, std::span<const std::uint8_t> bytes) {
  if (sockets_.empty()) return;
  const sockaddr_in to = Loopback(INADDR_LOOPBACK, port);
  const ssize_t sent =
      sendto(sockets_[next_], bytes.data(), bytes.size(), 0, reinterpret_cast<const sockaddr*>(&to), sizeof to);
  next_ = (next_ + 1) % sockets_.size();
  if (sent < 0) return;
  ++datagrams_;
  bytes_sent_ += static_cast<std::uint64_t>(sent);
}

void SpoofedFlood::Drain() {
  std::array<std::uint8_t, 2048> bytes;
  for (const int fd : sockets_) {
    for (ssize_t got = 0; (got = recv(fd, bytes.data(), bytes.size(), MSG_TRUNC)) >= 0;) {
      bytes_received_ += static_cast<std::uint64_t>(got);
    }
  }
}

std::vector<std::uint8_t> BlindConnect(std::uint32_t connection) {
  constexpr std::size_t kHeader = sizeof(ENetProtocolHeader) + sizeof(enet_uint32);
  std::vector<std::uint8_t> bytes(kHeader + sizeof(ENetProtocolConnect));
  const std::uint16_t peer = htons(ENET_PROTOCOL_MAXIMUM_PEER_ID | int{ENET_PROTOCOL_HEADER_FLAG_SENT_TIME});
  std::memcpy(bytes.data(), &peer, sizeof peer);
  ENetProtocolConnect connect{};
  connect.header.command = ENET_PROTOCOL_COMMAND_CONNECT | int{ENET_PROTOCOL_COMMAND_FLAG_ACKNOWLEDGE};
  connect.header.channelID = 0xff;
  connect.header.reliableSequenceNumber = htons(1);
  connect.incomingSessionID = connect.outgoingSessionID = 0xff;
  connect.mtu = htonl(1200);
  connect.windowSize = htonl(65536);
  connect.channelCount = htonl(2);
  connect.connectID = connection;
  std::memcpy(bytes.data() + kHeader, &connect, sizeof connect);
  ENetBuffer buffer{.data = bytes.data(), .dataLength = bytes.size()};
  const enet_uint32 checksum = enet_crc32(&buffer, 1);
  std::memcpy(bytes.data() + sizeof(ENetProtocolHeader), &checksum, sizeof checksum);
  return bytes;
}

std::vector<std::uint8_t> BlindHello(std::uint32_t number, const Knock& knock) {
  Nonce nonce{};
  std::copy(knock.begin(), knock.end(), nonce.begin());
  std::memcpy(nonce.data() + knock.size(), &number, sizeof number);
  return Write(Hello{.protocol = kProtocolVersion, .session = number & kMaxSessionNumber, .nonce = nonce});
}

}  // namespace tessera::net
