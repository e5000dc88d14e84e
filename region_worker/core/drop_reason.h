// Why a message of another region was not used.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

#include "absl/status/status.h"

namespace tessera::worker {

enum class DropReason : std::uint8_t {
  kMalformed,    // truncated, or not a frame
  kBadBody,      // names a body that it may not, or a state that cannot be
  kNotNeighbor,  // from a region that sends none here, or under another's name
  kMapVersion,   // made under another map
  kOldTick,      // sent again after a link broke; harmless
  kOutOfOrder,   // one before it is missing
  kOther,
};

inline constexpr std::array<std::string_view, 7> kDropReasonNames = {
    "malformed", "bad_body", "not_neighbor", "map_version", "old_tick", "out_of_order", "other"};

// From the status of Region::Receive.
DropReason ReasonOf(const absl::Status& status);

using DropCounts = std::array<std::uint64_t, kDropReasonNames.size()>;

}  // namespace tessera::worker
