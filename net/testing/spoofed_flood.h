// SpoofedFlood: sockets on many addresses of the loopback network that send datagrams which nobody asked for, for tests
// and measurements. To a port this looks like a flood from spoofed addresses; the flood counts the bytes that come
// back.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "net/handshake.h"

namespace tessera::net {

class SpoofedFlood {
 public:
  // Each socket has an address of its own, 127.1.0.1 and up. There are fewer where the system gives no more.
  explicit SpoofedFlood(std::size_t count);
  ~SpoofedFlood();
  SpoofedFlood(const SpoofedFlood&) = delete;
  SpoofedFlood& operator=(const SpoofedFlood&) = delete;

  // Sends from the next socket to 127.0.0.1. A datagram is lost where a buffer is full, as on any network.
  void Send(std::uint16_t port, std::span<const std::uint8_t> bytes);
  // Receives all answers.
  void Drain();

  std::uint64_t datagrams() const { return datagrams_; }
  std::uint64_t bytes_sent() const { return bytes_sent_; }
  std::uint64_t bytes_received() const { return bytes_received_; }

 private:
  std::vector<int> sockets_;
  std::size_t next_ = 0;
  std::uint64_t datagrams_ = 0, bytes_sent_ = 0, bytes_received_ = 0;
};

// The datagram that opens an ENet connection of a host without an acceptor: 52 bytes with its checksum.
std::vector<std::uint8_t> BlindConnect(std::uint32_t connection);
// The first datagram of a handshake, with made-up fields; that of a stranger unless the knock is the instance's.
std::vector<std::uint8_t> BlindHello(std::uint32_t number, const Knock& knock = {});

}  // namespace tessera::net
