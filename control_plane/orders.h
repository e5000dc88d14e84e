// Orders: what a worker is to be, from what is stored and observed. Pure.
#pragma once

#include <string>

#include "control_plane/entries.h"

namespace tessera::control {

// For the worker at `index`, without its revision. `run` and `players` are as stored, so an order never tells what is
// not.
v1::WorkerOrder MakeOrder(const InstanceEntry& instance, std::size_t index);

// "worker exited with code 3: cannot bind; last log: a | b": one line, at most kMaxReasonBytes, from what an agent
// reported.
std::string DescribeExit(const v1::WorkerExited& exited, const v1::WorkerReport& last_report);

// `text` on one line: control characters become blanks, what is over `max_bytes` is cut between characters.
std::string OneLine(std::string_view text, std::size_t max_bytes);

}  // namespace tessera::control
