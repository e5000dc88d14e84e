// Kinds of datagrams on the unsequenced channel between a client and a region: the first byte of each.
#pragma once

#include <cstdint>
#include <span>

namespace tessera::replication {

enum class DatagramKind : std::uint8_t {
  kUnknown = 0,        // never sent: the datagram is empty, or this version does not know its kind
  kSnapshot = 1,       // region -> client: core/replication/snapshot.h
  kInput = 2,          // client -> region: core/replication/input.h
  kCommands = 3,       // client -> region: core/replication/command.h
  kRegionFigures = 4,  // region -> client: core/replication/region_figures.h
  kSceneRequest = 5,   // client -> region: core/replication/scene_transfer.h
  kMovement = 6,       // region -> client: core/replication/movement_news.h
  kTileRequest = 7,    // client -> region: core/replication/scene_transfer.h
};

// An acknowledgement names the newest datagram that came, and has a bit for each of so many before it.
inline constexpr std::uint32_t kAckMaskBits = 64;

// A tick beyond this is a lie: two million years at 60 Hz. The limit keeps tick arithmetic far from 64 bits.
inline constexpr std::uint64_t kMaxTick = std::uint64_t{1} << 52;

inline DatagramKind KindOf(std::span<const std::uint8_t> datagram) {
  if (datagram.empty() || datagram[0] > static_cast<std::uint8_t>(DatagramKind::kTileRequest)) {
    return DatagramKind::kUnknown;
  }
  return static_cast<DatagramKind>(datagram[0]);
}

}  // namespace tessera::replication
