// The seam between ENet's datagrams and sealed ones, for ENet 1.3 as it comes.
//
// Inwards: ENet's `intercept` sees each datagram before ENet does and may put another in its place, so ENet is handed
// only what a session's key opened. Outwards: ENet calls `checksum` last before it sends, over `host->buffers`; what it
// then sends is what stands in `host->buffers`, so the sealed datagram is put there. Thus every byte of ENet's, its own
// commands included, is authenticated and secret, and a stranger's never reaches its parser.
//
// ENet must think that it has a checksum. On the wire the field is left out. Inside it holds the connection's number
// (ENet's connectID): outwards it tells which connection a datagram is of; inwards ENet compares it with the peer's
// that the datagram names, so a session can only speak to its own peer. The numbers are this host's own: those the
// other side wrote are overwritten. Commands that our endpoints never send are refused, because one with a valid token
// is still not trusted.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include <enet/enet.h>

namespace tessera::net {

inline constexpr std::size_t kChecksumBytes = 4;
// ENet's own, in a throttle that never drops: no deceleration, and full acceleration.
inline constexpr enet_uint32 kThrottleInterval_ms = ENET_PEER_PACKET_THROTTLE_INTERVAL;
inline constexpr enet_uint32 kThrottleAcceleration = ENET_PEER_PACKET_THROTTLE_SCALE;
inline constexpr enet_uint32 kThrottleDeceleration = 0;

// --- Outwards: from ENet's buffers ---
// The number of the connection that a datagram of ENet's is of.
std::uint32_t ConnectionOf(std::span<const ENetBuffer> buffers);
// Writes what goes on the wire, the checksum field left out; its size, or 0 if there is no room.
std::size_t Gather(std::span<const ENetBuffer> buffers, std::span<std::uint8_t> out);

// --- Inwards ---
enum class Inner : std::uint8_t { kRefused, kConnect, kOther };
// Whether it is well formed, of one of our endpoints, and what it is. `reliable`: whether the other side may send
// messages that ENet keeps until they are whole and in order.
Inner Inspect(std::span<const std::uint8_t> payload, bool dialled, bool reliable);
// Makes of a payload that was inspected what ENet expects, in place: `payload` is preceded by kChecksumBytes of room.
// `connection` is this host's number for it.
std::span<std::uint8_t> Restore(std::span<std::uint8_t> payload, Inner kind, std::uint32_t connection);
// The checksum field of a restored datagram.
std::uint32_t FieldOf(std::span<const std::uint8_t> datagram);
// Whose it is to be: the peer's slot that it names.
std::uint16_t PeerOf(std::span<const std::uint8_t> payload);

}  // namespace tessera::net
