// Outbox: datagrams that wait for the next system call, so that many leave by one.
//
//   std::span<std::uint8_t> room = outbox.Room();      // sends the waiting datagrams first where it is full
//   outbox.Add(to, bytes);                             // the first `bytes` of the room
//   outbox.Send();
//
// Datagrams that the socket does not take are lost, as on any network. Thread rule: one thread.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "net/address.h"
#include "net/sockets.h"

namespace tessera::net {

class Outbox {
 public:
  explicit Outbox(SystemSocket socket) : socket_(socket) {}

  std::span<std::uint8_t> Room() {
    if (count_ == datagrams_.size()) Send();
    return datagrams_[count_].bytes;
  }
  bool empty() const { return count_ == 0; }
  void Add(const Address& to, std::size_t bytes);
  void Send();

 private:
  SystemSocket socket_;
  std::size_t count_ = 0;
  std::array<OutgoingDatagram, kMaxSentAtOnce> datagrams_;
};

}  // namespace tessera::net
