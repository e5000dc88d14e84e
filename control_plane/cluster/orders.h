// Orders: what a worker is to be, from what is stored and observed. Pure.
#pragma once

#include <cstdint>
#include <vector>

#include "control_plane/cluster/cluster_state.h"

namespace tessera::control {

// Requests to all workers of an instance that are not in its record.
struct Requests {
  std::uint64_t checkpoint_tick = 0;  // 0: no checkpoint is being made
  std::vector<v1::PropertyChange> property_changes;
  std::vector<v1::BackendMessage> backend_messages;
  std::uint64_t published_up_to = 0;
};

// The order for the worker at `index`, without its revision and the players. It holds nothing that is not stored, but
// for `requests`, the addresses of the other workers, and a failover's resolution that is being stored.
v1::WorkerOrder MakeOrder(const InstanceEntry& instance, std::size_t index, const Requests& requests);
// The players that go with it.
const Players& PlayersOf(const InstanceEntry& instance);
// Names them in the order of a region, ascending. Only the one that makes a player's body learns its name and
// properties, and none who it is: a world of ten thousand players has as many in each order.
void AddPlayers(const Players& players, v1::WorkerOrder& order);
// Names those alone that changed since the order of this revision.
void AddPlayerChanges(const Players::Changes& changes, std::uint64_t since, v1::WorkerOrder& order);

}  // namespace tessera::control
