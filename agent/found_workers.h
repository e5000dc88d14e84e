// FoundWorkers: this host's workers as their processes show them, for an agent whose workers.json does not say.
//
// A worker is started with its identity, its ports and its agent's socket as arguments, which anybody on the machine
// may read in /proc. The process itself shows them, so a worker that was taken over can claim to be another one. Where
// two claim one identity, the one that began first counts; and a process gets orders only over its own connection
// (Supervisor::Attached).
//
//   for (const WorkerRecord& record : FindWorkers(state.SocketPath())) ...
//
// Thread rule: free functions on values.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "agent/agent_state.pb.h"

namespace tessera::agent {

// The worker whose command line this is, if it was started for the agent at this socket; without pid, start time and
// path of its log, of which it is not believed.
std::optional<WorkerRecord> WorkerOf(const std::vector<std::string>& arguments, const std::string& socket_path);

// All live ones of this user, each identity once, in the order of their pids. `proc`: where the kernel shows processes.
std::vector<WorkerRecord> FindWorkers(const std::string& socket_path, const std::string& proc = "/proc");

}  // namespace tessera::agent
