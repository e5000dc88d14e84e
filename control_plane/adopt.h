// Adopt: the record of a world as its hosts know it, where the one that is stored may be old.
//
// After a restore from a backup the orders that hosts hold are the truth: they name the map in force, who runs which
// region, and the players. What no order says stays as the old record has it. Pure.
//
// Thread rule: free functions on values.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <span>
#include <string>

#include "control_plane/control_records.pb.h"
#include "control_plane/players.h"
#include "tessera/v1/worker_link.pb.h"

namespace tessera::control {

struct HeldOrder {
  std::string host_id;
  v1::WorkerOrder order;
};

// The host that advertises an address; empty: none does.
using HostOfAddress = std::function<std::string(const std::string& address)>;
// By region, the newest incarnation that a standby has a copy of.
using CopiesHeld = std::map<std::uint32_t, std::uint64_t>;

// `orders` are all of this instance, at least one. Regions that no order runs are placed where the orders say that they
// run, by their addresses; those of which no order knows more on their old host, as the incarnation that somebody has a
// copy of, else as that of the old record: the caller has them carried on. Numbers of the old record never go down. The
// world is to have as many regions as it has, with those of a plan under way and the dead of a failover: how many an
// operator asked for since is in no order.
records::Instance AdoptOrders(const records::Instance& old, std::span<const HeldOrder> orders, const CopiesHeld& copies,
                              const HostOfAddress& host_at);
// The players that the newest of the orders names. What no order says is as before, who they are by their tickets;
// their names and properties are in the orders of the regions that make their bodies.
Players AdoptPlayers(const Players& old, std::span<const HeldOrder> orders);

}  // namespace tessera::control
