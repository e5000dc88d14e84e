// DesiredSets: what each agent is to run: the orders of all workers that are placed on its host, as one set.
//
// The first set on a stream is whole. In later ones an order's players are those that changed since the order before,
// for agents that take it so: a join into a world of ten thousand players names one.
//
// A set is made when the agent's stream is free for it, so changes between two sets collapse. A set that follows from a
// stored record is made only after the write.
//
// Thread rule: as Cluster.
#pragma once

#include <functional>
#include <optional>

#include "control_plane/cluster/cluster_state.h"
#include "control_plane/cluster/orders.h"
#include "control_plane/cluster/revocations.h"

namespace tessera::control {

class DesiredSets {
 public:
  using RequestsOf = std::function<Requests(const InstanceEntry&)>;

  DesiredSets(ClusterState& state, const Revocations& revocations, RequestsOf requests_of)
      : state_(state), revocations_(revocations), requests_of_(std::move(requests_of)) {}

  // The host's whole desired set, if it may have changed since it was last taken.
  std::optional<v1::DesiredSet> Take(StreamId stream);

 private:
  ClusterState& state_;
  const Revocations& revocations_;
  RequestsOf requests_of_;
};

}  // namespace tessera::control
