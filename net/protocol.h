// Protocol: numbers that both ends of a connection must agree on, and the limits that what comes off a wire is held to.
#pragma once

#include <cstddef>
#include <cstdint>

namespace tessera::net {

// Of all that is said over ENet and of the connect token. A hello with another version is refused, naming both.
inline constexpr std::uint32_t kProtocolVersion = 2;

// Largest UDP payload that ENet makes. Passes every path that carries 1280 bytes of IP, the least IPv6 allows, with
// room for tunnels; larger datagrams are dropped by some of them without a word.
inline constexpr std::size_t kMtuBytes = 1200;
// Largest unsequenced message: the MTU less ENet's header (4), its fragment command (24) and checksum (4), and 20 kept
// for an authentication tag and key id. A larger one would silently become reliable fragments.
inline constexpr std::size_t kMaxDatagramBytes = 1148;
// Largest reliable message unless an endpoint says otherwise: a map of 4096 cells has about 200 KB.
inline constexpr std::size_t kMaxMessageBytes = 256 * 1024;
// Largest frame between two regions: some 40 000 awake bodies at one border. What a stranger may make a link port
// buffer grows with it.
inline constexpr std::size_t kMaxFrameBytes = 4 * 1024 * 1024;

}  // namespace tessera::net
