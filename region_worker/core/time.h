// The clock that a worker's decisions count by. They are given the time; only the shell reads it.
#pragma once

#include <chrono>

namespace tessera::worker {

using Clock = std::chrono::steady_clock;
using TimePoint = Clock::time_point;
using Duration = Clock::duration;

}  // namespace tessera::worker
