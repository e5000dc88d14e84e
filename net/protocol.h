// Protocol: numbers that both ends of a connection must agree on, and limits on received messages.
#pragma once

#include <cstddef>
#include <cstdint>

namespace tessera::net {

// Version of all UDP traffic and of what instances' keys sign. A hello with another version is refused, naming both.
inline constexpr std::uint32_t kProtocolVersion = 7;

// Largest UDP payload: ENet's MTU and the bytes that sealing adds. With headers 1232 bytes over IPv4 and 1252 over
// IPv6, it passes every path that carries 1280 bytes of IP, the least IPv6 allows; some paths silently drop larger
// datagrams.
inline constexpr std::size_t kMaxUdpBytes = 1204;
// Bytes that ENet may fill. It does not count its checksum field (4), which the adapter leaves out on the wire.
inline constexpr std::size_t kMtuBytes = kMaxUdpBytes - 24;
// Largest unsequenced message. 32 bytes more would fit; ENet's own headers need them, so that a datagram may go either
// way.
inline constexpr std::size_t kMaxDatagramBytes = kMtuBytes - 32;
static_assert(kMaxDatagramBytes == 1148, "snapshots fill it");
// Largest reliable message unless an endpoint says otherwise: a map of 4096 cells has about 200 KB.
inline constexpr std::size_t kMaxMessageBytes = 256 * 1024;
// Largest frame between two regions, of both ends of every link: some 160 000 awake bodies at one border. A region that
// would have to send a larger one ends, so it must be beyond what a border can have while its world still steps. The
// memory that a neighbour may make a link port buffer grows with it.
inline constexpr std::size_t kMaxFrameBytes = 16 * 1024 * 1024;

}  // namespace tessera::net
