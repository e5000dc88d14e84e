// Conclusions about running workers from what is known of them. Pure.
#pragma once

#include <cstdint>

#include "control_plane/cluster/cluster_state.h"

namespace tessera::control {

// When the worker's agent was last heard, or its standby last gave a sign of it; 0: its host was removed.
Steady LastSignOf(const ClusterState& state, const InstanceEntry& instance, std::size_t index);

// True if neither the worker's agent nor its standby has given a sign of it for `after`.
bool Silent(const ClusterState& state, const InstanceEntry& instance, std::size_t index, Steady after, Now now);

// True if every worker runs by the map in force.
bool AllRunByMap(const InstanceEntry& instance);

// The worker's tick by now, reckoned from its last report; 0 before it has reported one.
std::uint64_t TickOf(const InstanceEntry& instance, const WorkerEntry& worker, Now now);

// True if `worker` has reported a whole copy of the region of this incarnation.
bool HoldsCopyOf(const WorkerEntry& worker, std::uint64_t incarnation);

}  // namespace tessera::control
