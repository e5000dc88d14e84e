// GameLogs: the newest lines that the games of instances wrote, as workers report them, for whoever runs the cluster.
//
//   logs.Take(instance, report, now);                 // each report repeats its newest lines
//   logs.After(instance, cursor);                     // those that a reader does not have yet
//
// They are kept in memory, at most kMaxGameLines an instance: a control plane that starts anew hears the newest again.
// A line for an operator to act on becomes an event of the instance too, which is stored: a callback that is off, and
// the first error after a silence of kGameErrorSilence. Thread rule: as the cluster.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "control_plane/cluster/cluster_state.h"
#include "control_plane/now.h"

namespace tessera::control {

class GameLogs {
 public:
  // `state` outlives it.
  explicit GameLogs(ClusterState& state) : state_(state) {}

  void Take(InstanceEntry& instance, const v1::WorkerReport& report, Now now);
  // Oldest first.
  std::vector<v1::GameLogLine> After(const InstanceEntry& instance, std::uint64_t number) const;
  void Forget(std::uint64_t instance) { logs_.erase(instance); }

 private:
  struct Log {
    std::deque<v1::GameLogLine> lines;
    std::map<std::uint32_t, std::pair<std::uint64_t, std::uint64_t>> heard;  // incarnation and last line, by region
    std::optional<Steady> last_error;
    int callbacks_off = 0;
  };
  // Whether the line is to be an event.
  static bool Matters(const v1::GameLine& line, Log& log, Now now);

  ClusterState& state_;
  std::map<std::uint64_t, Log> logs_;  // by the instance's number
};

}  // namespace tessera::control
