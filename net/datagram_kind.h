// DatagramKind: the first byte of every datagram between two ports.
#pragma once

#include <cstdint>

namespace tessera::net {

enum class DatagramKind : std::uint8_t {
  // The handshake (handshake.h). ENet's own datagrams begin with 0x0f, 0x8f and the like, or a peer's number.
  kHello = 0xd1,
  kChallenge,
  kLogin,
  kAccept,
  kRefusal,
  kSealed,  // a sealed datagram of ENet's (channel.h)
  kDirect,  // a sealed unsequenced message that bypasses ENet
};

}  // namespace tessera::net
