// How the state of an instance is named and waited for.
#pragma once

#include <chrono>
#include <string>
#include <vector>

#include "tessera/v1/instance.pb.h"

namespace tessera::local {

class Connection;

std::string InstanceStateName(const v1::Instance& instance);

// All of them, page by page, without map and figures of regions.
std::vector<v1::Instance> ListInstances(Connection& connection);

// Watches until RUNNING, WAITING_FOR_PLAYERS, FAILED or ENDED. CommandError with the state it is in when the time is
// over.
v1::Instance WaitUntilSettled(Connection& connection, const std::string& id, std::chrono::milliseconds timeout);
// Watches until it is in `state` or has ended or failed.
v1::Instance WaitFor(Connection& connection, const std::string& id, v1::InstanceState state,
                     std::chrono::milliseconds timeout);
// Watches until ENDED or FAILED.
v1::Instance WaitUntilEnded(Connection& connection, const std::string& id, std::chrono::milliseconds timeout);

}  // namespace tessera::local
