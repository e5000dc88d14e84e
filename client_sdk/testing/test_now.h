// kTestNow: the moment at which tests begin whose time is their own.
#pragma once

#include <chrono>

namespace tessera::client {

inline constexpr std::chrono::steady_clock::time_point kTestNow{std::chrono::hours(1)};

}  // namespace tessera::client
