// DatagramKind: the first byte of every datagram between two ports, and what follows it.
#pragma once

#include <cstdint>

namespace tessera::net {

enum class DatagramKind : std::uint8_t {
  kHello = 0xd1,  // the handshake: handshake.h
  kChallenge,
  kLogin,
  kAccept,
  kRefusal,
  kSealed,  // channel.h; a datagram of ENet's is inside
  kDirect,  // the same; one unsequenced message is inside, which ENet has no part in
};

}  // namespace tessera::net
