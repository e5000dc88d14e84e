// Outbox: datagrams that wait for the next system call, so that many leave by one.
//
//   std::span<std::uint8_t> room = outbox.Room();      // sends the waiting datagrams first where it is full
//   outbox.Add(to, bytes);                             // the first `bytes` of the room
//   outbox.Send();
//
// Datagrams that the socket does not take are lost, as on any network. Thread rule: one thread.
#pragma once

#include <netinet/in.h>
#include <sys/socket.h>

#include <array>
#include <cstdint>
#include <span>

#include "net/address.h"
#include "net/protocol.h"

namespace tessera::net {

class Outbox {
 public:
  explicit Outbox(int socket);

  std::span<std::uint8_t> Room() {
    if (count_ == kDatagrams) Send();
    return datagrams_[count_].bytes;
  }
  bool empty() const { return count_ == 0; }
  void Add(const Address& to, std::size_t bytes);
  void Send();

 private:
  // More datagrams would not stay in the nearest cache from sealing until sending.
  static constexpr unsigned kDatagrams = 16;

  struct Datagram {
    sockaddr_in to{};
    iovec part{};
    std::array<std::uint8_t, kMaxUdpBytes> bytes;
  };

  int socket_;
  unsigned count_ = 0;
  std::array<Datagram, kDatagrams> datagrams_;
  std::array<mmsghdr, kDatagrams> headers_{};
};

}  // namespace tessera::net
