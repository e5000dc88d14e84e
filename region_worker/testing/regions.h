// The regions and the start of time in tests of a worker's core.
#pragma once

#include <chrono>

#include "core/world/ids.h"
#include "region_worker/core/time.h"

namespace tessera::worker {

constexpr RegionId kSelf{1}, kSecond{2};
constexpr TimePoint kStart{std::chrono::hours(1)};

}  // namespace tessera::worker
