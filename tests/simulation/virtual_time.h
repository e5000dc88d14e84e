// Virtual time as the product counts it.
#pragma once

#include "region_worker/core/time.h"
#include "tests/simulation/timeline.h"

namespace tessera::simulation {

// Never near the clock's zero, which stands for "never".
inline worker::TimePoint TimePointAt(Micros time) {
  return worker::TimePoint(std::chrono::hours(1) + std::chrono::microseconds(time));
}
// Rounded up: never before `time`.
inline Micros MicrosAt(worker::TimePoint time) {
  const auto since_zero = std::chrono::ceil<std::chrono::microseconds>(time.time_since_epoch());
  return static_cast<Micros>((since_zero - std::chrono::hours(1)).count());
}

}  // namespace tessera::simulation
