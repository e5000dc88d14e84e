#include "net/enet_adapter.h"

#include <algorithm>
#include <cstring>

namespace tessera::net {
namespace {

static_assert(ENET_VERSION_MAJOR == 1 && ENET_VERSION_MINOR == 3, "the adapter depends on the inside of ENet 1.3");

constexpr std::size_t kShortHeader = 2, kLongHeader = 4;

std::uint16_t ReadBig16(const std::uint8_t* from) { return static_cast<std::uint16_t>(from[0] << 8 | from[1]); }

std::uint32_t ReadBig32(const std::uint8_t* from) { return std::uint32_t{ReadBig16(from)} << 16 | ReadBig16(from + 2); }

// Each fragment of a message has at least so many bytes, because ENet cuts by the MTU. ENet allocates memory by the
// number of fragments that a peer announces, whatever their size.
constexpr std::uint32_t kLeastFragmentBytes = 512;

// Size of ENet's header, which is longer where it has a time.
std::size_t HeaderBytes(std::span<const std::uint8_t> datagram) {
  return (ReadBig16(datagram.data()) & ENET_PROTOCOL_HEADER_FLAG_SENT_TIME) != 0 ? kLongHeader : kShortHeader;
}

// Size of a command with its data; 0 if our endpoints never send it, or if it is cut off.
std::size_t CommandBytes(std::span<const std::uint8_t> rest, std::uint8_t command) {
  switch (command) {
    case ENET_PROTOCOL_COMMAND_ACKNOWLEDGE:
      return sizeof(ENetProtocolAcknowledge);
    case ENET_PROTOCOL_COMMAND_CONNECT:
      return sizeof(ENetProtocolConnect);
    case ENET_PROTOCOL_COMMAND_VERIFY_CONNECT:
      return sizeof(ENetProtocolVerifyConnect);
    case ENET_PROTOCOL_COMMAND_DISCONNECT:
      return sizeof(ENetProtocolDisconnect);
    case ENET_PROTOCOL_COMMAND_PING:
      return sizeof(ENetProtocolPing);
    case ENET_PROTOCOL_COMMAND_BANDWIDTH_LIMIT:
      return sizeof(ENetProtocolBandwidthLimit);
    case ENET_PROTOCOL_COMMAND_SEND_RELIABLE:
      if (rest.size() < sizeof(ENetProtocolSendReliable)) return 0;
      return sizeof(ENetProtocolSendReliable) + ReadBig16(rest.data() + offsetof(ENetProtocolSendReliable, dataLength));
    case ENET_PROTOCOL_COMMAND_SEND_FRAGMENT:
      if (rest.size() < sizeof(ENetProtocolSendFragment)) return 0;
      if (ReadBig32(rest.data() + offsetof(ENetProtocolSendFragment, fragmentCount)) >
          ReadBig32(rest.data() + offsetof(ENetProtocolSendFragment, totalLength)) / kLeastFragmentBytes + 1) {
        return 0;
      }
      return sizeof(ENetProtocolSendFragment) + ReadBig16(rest.data() + offsetof(ENetProtocolSendFragment, dataLength));
    default:
      return 0;
  }
}

void Put32(std::span<std::uint8_t> command, std::size_t offset, std::uint32_t value) {
  for (std::size_t i = 0; i < sizeof value; ++i) {
    command[offset + i] = static_cast<std::uint8_t>(value >> (8 * (sizeof value - 1 - i)));
  }
}

// Replaces the parameters that the other side proposes for the connection by those that our endpoints always use.
void RestoreConnect(std::span<std::uint8_t> command, std::uint32_t connection) {
  Put32(command, offsetof(ENetProtocolConnect, incomingBandwidth), 0);
  Put32(command, offsetof(ENetProtocolConnect, outgoingBandwidth), 0);
  Put32(command, offsetof(ENetProtocolConnect, packetThrottleInterval), kThrottleInterval_ms);
  Put32(command, offsetof(ENetProtocolConnect, packetThrottleAcceleration), kThrottleAcceleration);
  Put32(command, offsetof(ENetProtocolConnect, packetThrottleDeceleration), kThrottleDeceleration);
  std::memcpy(command.data() + offsetof(ENetProtocolConnect, connectID), &connection, sizeof connection);
}

}  // namespace

std::uint32_t ConnectionOf(std::span<const ENetBuffer> buffers) {
  const auto* header = static_cast<const std::uint8_t*>(buffers[0].data);
  std::uint32_t connection = 0;
  std::memcpy(&connection, header + buffers[0].dataLength - kChecksumBytes, sizeof connection);
  if (connection != 0 || buffers.size() < 2) return connection;
  // Not yet answered: ENet leaves the field empty, but the command says it.
  const auto* command = static_cast<const std::uint8_t*>(buffers[1].data);
  if (buffers[1].dataLength == sizeof(ENetProtocolConnect) &&
      (command[0] & ENET_PROTOCOL_COMMAND_MASK) == ENET_PROTOCOL_COMMAND_CONNECT) {
    std::memcpy(&connection, command + offsetof(ENetProtocolConnect, connectID), sizeof connection);
  }
  return connection;
}

std::size_t Gather(std::span<const ENetBuffer> buffers, std::span<std::uint8_t> out) {
  std::size_t size = 0;
  for (std::size_t i = 0; i < buffers.size(); ++i) {
    const std::size_t bytes = buffers[i].dataLength - (i == 0 ? kChecksumBytes : 0);
    if (bytes > out.size() - size) return 0;
    if (bytes > 0) std::memcpy(out.data() + size, buffers[i].data, bytes);
    size += bytes;
  }
  return size;
}

std::uint16_t PeerOf(std::span<const std::uint8_t> payload) {
  return ReadBig16(payload.data()) & ENET_PROTOCOL_MAXIMUM_PEER_ID;
}

Inner Inspect(std::span<const std::uint8_t> payload, bool dialled, bool reliable) {
  if (payload.size() < kShortHeader) return Inner::kRefused;
  const std::size_t header = HeaderBytes(payload);
  if (payload.size() <= header) return Inner::kRefused;
  if ((ReadBig16(payload.data()) & ENET_PROTOCOL_HEADER_FLAG_COMPRESSED) != 0) return Inner::kRefused;
  const bool to_nobody = PeerOf(payload) == ENET_PROTOCOL_MAXIMUM_PEER_ID;
  std::span<const std::uint8_t> rest = payload.subspan(header);
  for (bool first = true; !rest.empty(); first = false) {
    const std::uint8_t command = rest[0] & ENET_PROTOCOL_COMMAND_MASK;
    const std::size_t bytes = CommandBytes(rest, command);
    if (bytes == 0 || bytes > rest.size()) return Inner::kRefused;
    const bool kept = command == ENET_PROTOCOL_COMMAND_SEND_RELIABLE || command == ENET_PROTOCOL_COMMAND_SEND_FRAGMENT;
    if (kept && !reliable) return Inner::kRefused;
    if (command == ENET_PROTOCOL_COMMAND_CONNECT) {
      // Alone, to nobody yet, and only from the one that dialled.
      return to_nobody && !dialled && first && bytes == rest.size() ? Inner::kConnect : Inner::kRefused;
    }
    if (command == ENET_PROTOCOL_COMMAND_VERIFY_CONNECT && !dialled) return Inner::kRefused;
    rest = rest.subspan(bytes);
  }
  return to_nobody ? Inner::kRefused : Inner::kOther;
}

std::span<std::uint8_t> Restore(std::span<std::uint8_t> payload, Inner kind, std::uint32_t connection) {
  const std::size_t header = HeaderBytes(payload);
  std::uint8_t* begin = payload.data() - kChecksumBytes;
  std::memmove(begin, payload.data(), header);
  const std::span<std::uint8_t> datagram(begin, payload.size() + kChecksumBytes);
  const std::uint32_t field = kind == Inner::kConnect ? 0 : connection;
  std::memcpy(begin + header, &field, sizeof field);
  std::span<std::uint8_t> rest = datagram.subspan(header + kChecksumBytes);
  if (kind == Inner::kConnect) {
    RestoreConnect(rest, connection);
    return datagram;
  }
  while (!rest.empty()) {
    const std::uint8_t command = rest[0] & ENET_PROTOCOL_COMMAND_MASK;
    if (command == ENET_PROTOCOL_COMMAND_VERIFY_CONNECT) {
      std::memcpy(rest.data() + offsetof(ENetProtocolVerifyConnect, connectID), &connection, sizeof connection);
    }
    if (command == ENET_PROTOCOL_COMMAND_BANDWIDTH_LIMIT) {
      Put32(rest, offsetof(ENetProtocolBandwidthLimit, incomingBandwidth), 0);
      Put32(rest, offsetof(ENetProtocolBandwidthLimit, outgoingBandwidth), 0);
    }
    rest = rest.subspan(CommandBytes(rest, command));
  }
  return datagram;
}

std::uint32_t FieldOf(std::span<const std::uint8_t> datagram) {
  std::uint32_t field = 0;
  std::memcpy(&field, datagram.data() + HeaderBytes(datagram), sizeof field);
  return field;
}

}  // namespace tessera::net
