// How an instance is waited for and shown; shared by the instance commands, the demo and the benchmarks.
#pragma once

#include <chrono>
#include <string>

#include "local_cluster/connection.h"
#include "local_cluster/instance_state.h"
#include "tessera/v1/instance.pb.h"

namespace tessera::cli {

inline std::chrono::milliseconds Seconds(double seconds) {
  return std::chrono::milliseconds(static_cast<std::int64_t>(seconds * 1e3));
}

// Its errors name `command`.
v1::Instance GetInstance(local::Connection& connection, const std::string& command, const std::string& id);
// "game.lua (0123456789ab)", by name and the beginning of its hash; "-" without a game.
std::string GameOf(const v1::Instance& instance);
// "inst-3 RUNNING tick 1200, 4 of 4 regions, 2 players\n"
std::string SummaryLine(const v1::Instance& instance);
// One table row a region: rate, step times, owned, ghosts, asleep, handovers.
std::string RegionTable(const v1::Instance& instance);
std::string DescribeInstance(const v1::Instance& instance);

}  // namespace tessera::cli
