// How an instance is waited for and shown; shared by the instance commands, the demo and the benchmarks.
#pragma once

#include <chrono>
#include <string>

#include "cli/connection.h"
#include "tessera/v1/instance.pb.h"

namespace tessera::cli {

inline std::chrono::milliseconds Seconds(double seconds) {
  return std::chrono::milliseconds(static_cast<std::int64_t>(seconds * 1e3));
}

std::string InstanceStateName(const v1::Instance& instance);

// Watches until RUNNING, WAITING_FOR_PLAYERS, FAILED or ENDED. CommandError with the state it is in when the time is
// over.
v1::Instance WaitUntilSettled(Connection& connection, const std::string& id, std::chrono::milliseconds timeout);
// Watches until it is in `state` or has ended or failed.
v1::Instance WaitFor(Connection& connection, const std::string& id, v1::InstanceState state,
                     std::chrono::milliseconds timeout);
// Watches until ENDED or FAILED.
v1::Instance WaitUntilEnded(Connection& connection, const std::string& id, std::chrono::milliseconds timeout);

// "inst-3 RUNNING tick 1200, 4 of 4 regions, 2 players\n"
std::string SummaryLine(const v1::Instance& instance);
// One table row a region: rate, step times, owned, ghosts, asleep, handovers.
std::string RegionTable(const v1::Instance& instance);
std::string DescribeInstance(const v1::Instance& instance);

}  // namespace tessera::cli
