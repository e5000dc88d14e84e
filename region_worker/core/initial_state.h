// The state that a region begins with, from a checkpoint's file.
//
// Thread rule: a free function on values.
#pragma once

#include <cstdint>
#include <span>

#include "absl/status/statusor.h"
#include "core/region/catalog.h"
#include "core/region/log.h"
#include "region_worker/core/order.h"

namespace tessera::worker {

// `bytes`: the content of `file`. DATA_LOSS and INVALID_ARGUMENT name the file: its hash is not the order's (an empty
// one is not compared), it is damaged, or it is of another tick.
absl::StatusOr<region::RegionState> ReadInitialState(const StateFile& file, std::span<const std::uint8_t> bytes,
                                                     const region::Catalog& catalog);

}  // namespace tessera::worker
