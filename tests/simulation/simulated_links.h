// SimulatedLinks: a worker's links to other regions over the virtual network, in place of region_worker's RegionLinks.
//
// Dials whom the worker's LinkTable says, lets in whom it admits, and keeps one link to a region: a later one takes the
// place of an earlier.
//
//   SimulatedLinks links(network, NodeOf(region, life), place);
//   links.Open(core.links(), {.up = ..., .down = ..., .message = ...});
//   links.Dial(core.links());          // each round
//   links.Send(region, message);
//
// Thread rule: one thread at a time.
#pragma once

#include <functional>
#include <map>

#include "region_worker/core/link_table.h"
#include "tests/simulation/virtual_network.h"

namespace tessera::simulation {

// The node of a life of a region: several lives of one may be there at once.
constexpr Node NodeOf(RegionId region, Incarnation life) {
  return static_cast<Node>(life.value()) * kNodesOfALife + region.value();
}

class SimulatedLinks {
 public:
  struct Events {
    std::function<void(RegionId region, Incarnation life)> up;
    std::function<void(RegionId region)> down;
    std::function<void(RegionId from, const Bytes& message)> message;
  };

  // `place`: the machine's number.
  SimulatedLinks(VirtualNetwork& network, Node self, std::uint32_t place);
  ~SimulatedLinks() { network_.Leave(self_); }
  SimulatedLinks(const SimulatedLinks&) = delete;
  SimulatedLinks& operator=(const SimulatedLinks&) = delete;

  // From now on regions are let in. `table` must outlive this.
  void Open(const worker::LinkTable& table, Events events);
  // Lets nobody in any more.
  void Close() { table_ = nullptr; }
  void Dial(const worker::LinkTable& table);
  void Send(RegionId to, const Bytes& message);  // lost when there is no link
  void Cut(RegionId region);
  // Runs `action` in the process: later if it stands still, and never if it has ended.
  void InProcess(const std::function<void()>& action);

 private:
  void OnConnected(Node peer);
  void OnDisconnected(Node peer);

  VirtualNetwork& network_;
  Node self_;
  const worker::LinkTable* table_ = nullptr;  // null: closed
  Events events_;
  std::map<RegionId, Node> linked_;
};

}  // namespace tessera::simulation
