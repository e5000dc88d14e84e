// Instances as clients see them. Pure.
#pragma once

#include "control_plane/cluster/cluster_state.h"
#include "tessera/v1/instance.pb.h"

namespace tessera::control {

// The stored state, or DEGRADED.
v1::InstanceState StateOf(const InstanceEntry& instance);

// Whether the death of this region's worker now would cost time or bodies: its standby has no whole copy, or it has no
// standby though there are other regions.
bool IsUnprotected(const InstanceEntry& instance, const WorkerEntry& worker);

// Step time of the busiest region by the mean of all; 0: not all have reported theirs.
double ImbalanceOf(const InstanceEntry& instance);

// As in a listing: without the map, players, events, checkpoints, regions and changes.
v1::Instance SummaryOf(const InstanceEntry& instance);

// Everything.
v1::Instance ViewOf(const ClusterState& state, const InstanceEntry& instance);

}  // namespace tessera::control
