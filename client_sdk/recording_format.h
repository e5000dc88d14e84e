// Numbers of a recording's file format (docs/protocol.md). Not for others.
#pragma once

#include <cstddef>
#include <cstdint>

namespace tessera::client {

inline constexpr std::uint32_t kRecordingMagic = 0x43525354;  // "TSRC", low byte first
inline constexpr std::uint32_t kRecordingFormat = 4;
// Files of this format are read too: they are the same, but know nothing of the world's properties. Those before it
// hold scene and maps as protobuf.
inline constexpr std::uint32_t kOldestRecordingFormat = 3;
constexpr bool IsRead(std::uint32_t format) { return format >= kOldestRecordingFormat && format <= kRecordingFormat; }

enum class EntryKind : std::uint8_t {
  kEnd = 0,
  kHeader = 1,
  kFrame = 2,
  kRegion = 3,
  kMap = 4,
  kEvent = 5,
  kKey = 6,
  kKeyFrame = 7,
  kNote = 8,
  kWorld = 9,
};

// Length and checksum before each payload.
inline constexpr std::size_t kSealBytes = 8;
// A packed scene may have 512 MB, a usual large one a tenth. A frame of a million bodies takes about 40.
inline constexpr std::size_t kMaxHeaderBytes = std::size_t{320} << 20, kMaxEntryBytes = std::size_t{64} << 20;
inline constexpr std::size_t kMaxNoteBytes = std::size_t{1} << 20;
// Thirty years.
inline constexpr std::uint64_t kMaxTime_us = 1'000'000'000'000'000;

}  // namespace tessera::client
