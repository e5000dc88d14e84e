// Effects: what a call to Cluster set off outside. ControlPlane carries it out after the call.
#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "tessera/v1/agent_link.pb.h"

namespace tessera::control {

// One attached stream of an agent, counted from 1 and never used twice in a process. 0: none.
using StreamId = std::uint64_t;

// A line of the log. An error is what an operator has to act on; a warning is a fault that the cluster deals with.
enum class Severity { kInfo, kWarning, kError };
struct LogLine {
  std::string text;
  Severity severity = Severity::kInfo;
};

struct Effects {
  std::set<StreamId> desired;                                 // TakeDesired has something for these
  std::map<StreamId, absl::Status> closed;                    // streams that are over, and why
  std::set<std::string> instances;                            // instances that changed, or whose workers reported
  std::vector<std::pair<StreamId, v1::LeaseRenewal>> leases;  // to be sent at once
  std::vector<LogLine> log;
  std::set<std::string> restore;  // instances that need `Restore` or `CannotRestore`
  std::vector<std::pair<std::string, std::uint64_t>> pruned, abandoned;  // checkpoints, and drafts of them, by tick
  std::vector<std::string> forgotten;                                    // instances
  std::set<std::string> visuals;                                         // files whose pieces are to be removed
  std::vector<std::string> scene_pieces;                                 // keys in the store, likewise
  std::vector<std::chrono::nanoseconds> failovers;                       // durations of those that ended
};

}  // namespace tessera::control
