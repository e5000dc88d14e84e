// Figures of a region: what its work costs it, sent to each of its clients once a second, for a profiler on screen.
//
// They are the worker's own metrics (docs/metrics.md): sums since its process began, so a lost message costs nothing,
// and the difference of two messages is what went on between them.
//
// Layout, little-endian: kind (1) | format (1) | tick | owned | ghosts | asleep | clients | per kind of work: count,
// nanoseconds | memory in KiB; numbers as varints. Thread rule: free functions; any thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "absl/status/statusor.h"
#include "core/world/ids.h"

namespace tessera::replication {

inline constexpr std::uint8_t kRegionFiguresFormat = 1;
// Two bytes and 21 varints of up to ten: what a reader looks at, at most.
inline constexpr std::size_t kMaxRegionFiguresBytes = 2 + 21 * 10;

struct WorkFigures {
  std::uint64_t count = 0;     // how often it was done
  std::uint64_t total_ns = 0;  // how long that took together
  friend bool operator==(const WorkFigures&, const WorkFigures&) = default;
};

// Bytes on this machine are whole KiB; others are rounded down.
struct MemoryFigures {
  std::uint64_t process_virtual_bytes = 0, process_physical_bytes = 0;
  std::uint64_t host_virtual_usable_bytes = 0, host_virtual_total_bytes = 0;
  std::uint64_t host_physical_usable_bytes = 0, host_physical_total_bytes = 0;
  friend bool operator==(const MemoryFigures&, const MemoryFigures&) = default;
};

struct RegionFigures {
  Tick tick;
  std::uint64_t owned = 0, ghosts = 0, asleep = 0, clients = 0;
  // A whole tick without waiting; its physics update and its prediction; snapshots, where some client got bodies
  // without a baseline and where all got changes.
  WorkFigures step, physics, prediction, snapshot_full, snapshot_delta;
  MemoryFigures memory;
  friend bool operator==(const RegionFigures&, const RegionFigures&) = default;
};

std::vector<std::uint8_t> EncodeRegionFigures(const RegionFigures& figures);
// Errors: INVALID_ARGUMENT "figures: format 2, expected 1", "figures.tick: truncated", "figures: trailing bytes", ...
absl::StatusOr<RegionFigures> DecodeRegionFigures(std::span<const std::uint8_t> datagram);

}  // namespace tessera::replication
