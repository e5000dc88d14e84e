// The bodies that a region's step costs by: with them, step times of regions can be compared.
#pragma once

#include <algorithm>
#include <cstdint>

#include "tessera/v1/worker_link.pb.h"

namespace tessera::control {

// Cost of a region that owns nothing that moves, in bodies: without it the price of a body in a near-empty region is
// far too high.
inline constexpr double kEmptyBodies = 50;

// Those that are awake, and kEmptyBodies.
inline double LoadedBodies(const v1::WorkerReport& report) {
  const std::uint64_t asleep = std::min(report.asleep(), report.owned());
  return static_cast<double>(report.owned() - asleep) + kEmptyBodies;
}

}  // namespace tessera::control
