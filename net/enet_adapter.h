// The ENet adapter: translates between ENet's datagrams and sealed ones, for ENet 1.3 as it comes.
//
// Receiving: ENet's `intercept` callback sees each datagram before ENet does and may replace it, so ENet is handed only
// bytes that a session's key opened. Sending: ENet calls `checksum` over `host->buffers` last before it sends them, so
// the sealed datagram is put into `host->buffers` there. Thus every byte of ENet's, its own commands included, is
// authenticated and secret, and no byte of an unproven peer reaches its parser.
//
// ENet is made to believe that it has a checksum. On the wire the field is left out. In this process it holds the
// connection's number (ENet's connectID): when sending it says which connection a datagram belongs to; when receiving
// ENet compares it with that of the peer which the datagram names, so a session can only speak to its own peer. The
// numbers are this host's own: those that the other side wrote are overwritten. Commands that our endpoints never send
// are refused, because a peer with a valid token is still not trusted.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include <enet/enet.h>

namespace tessera::net {

inline constexpr std::size_t kChecksumBytes = 4;
// A throttle that never drops: ENet's own interval, no deceleration and full acceleration.
inline constexpr enet_uint32 kThrottleInterval_ms = ENET_PEER_PACKET_THROTTLE_INTERVAL;
inline constexpr enet_uint32 kThrottleAcceleration = ENET_PEER_PACKET_THROTTLE_SCALE;
inline constexpr enet_uint32 kThrottleDeceleration = 0;

// --- Sending: from ENet's buffers ---
// The number of the connection that a datagram of ENet's belongs to.
std::uint32_t ConnectionOf(std::span<const ENetBuffer> buffers);
// Writes the datagram without its checksum field; gives its size, or 0 if there is no room.
std::size_t Gather(std::span<const ENetBuffer> buffers, std::span<std::uint8_t> out);

// --- Receiving ---
enum class Inner : std::uint8_t { kRefused, kConnect, kOther };
// Checks that the payload is well formed and such as our endpoints send, and gives its kind. `reliable`: whether the
// other side may send messages that ENet keeps until they are complete and in order.
Inner Inspect(std::span<const std::uint8_t> payload, bool dialled, bool reliable);
// Turns an inspected payload into the datagram that ENet expects, in place: kChecksumBytes of room precede `payload`.
// `connection` is this host's number for the connection.
std::span<std::uint8_t> Restore(std::span<std::uint8_t> payload, Inner kind, std::uint32_t connection);
// The checksum field of a restored datagram.
std::uint32_t FieldOf(std::span<const std::uint8_t> datagram);
// The slot of the peer that the payload names.
std::uint16_t PeerOf(std::span<const std::uint8_t> payload);

}  // namespace tessera::net
