// Strangers: sockets on many addresses of the loopback net that send what nobody asked for. For tests and measurements:
// what a flood from spoofed addresses looks like to a port, and what it sends back to them.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace tessera::net {

class Strangers {
 public:
  // Each on an address of its own, 127.1.0.1 and up. Fewer where the system gives no more.
  explicit Strangers(std::size_t count);
  ~Strangers();
  Strangers(const Strangers&) = delete;
  Strangers& operator=(const Strangers&) = delete;

  // From the next of them, to 127.0.0.1. Lost where a buffer is full, as on any net.
  void Send(std::uint16_t port, std::span<const std::uint8_t> bytes);
  // Takes what has been sent back to any of them.
  void Drain();

  std::uint64_t datagrams() const { return datagrams_; }
  std::uint64_t bytes_sent() const { return bytes_sent_; }
  std::uint64_t bytes_received() const { return bytes_received_; }

 private:
  std::vector<int> sockets_;
  std::size_t next_ = 0;
  std::uint64_t datagrams_ = 0, bytes_sent_ = 0, bytes_received_ = 0;
};

// What opens an ENet connection where nothing stands before ENet: 52 bytes with its checksum.
std::vector<std::uint8_t> BlindConnect(std::uint32_t connection);
// The first datagram of a handshake, of somebody who made up all of it.
std::vector<std::uint8_t> BlindHello(std::uint32_t number);

}  // namespace tessera::net
