// Order: the state that a worker is to be in, checked. The plain form of tessera.v1.WorkerOrder.
//
// An order is a whole state, not a command: the worker compares it with what it is and does the difference. A field
// that is not known yet is empty and comes with a later revision.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "core/region/resolve.h"
#include "core/region/settings.h"
#include "core/world/partition_map.h"
#include "net/credential.h"
#include "region_worker/core/backend_orders.h"
#include "region_worker/core/identity.h"
#include "region_worker/core/peer_address.h"
#include "region_worker/core/property_orders.h"
#include "tessera/v1/worker_link.pb.h"

namespace tessera::worker {

struct OrderedPlayer {
  PlayerNumber number;
  net::Generation generation{};  // connections of a lower one are another process's
  RegionId spawn_region{};       // makes its body; RegionId(): the scene has none
  bool left = false;
  bool parked = false;
  std::string name{};
  std::string ended_because{};              // the game's reason, or an operator's; of one that has left
  std::vector<NamedProperty> properties{};  // that its body begins with
};

// A life of a region that has ended.
struct DeadRegion {
  RegionId region;
  Incarnation incarnation;
  friend bool operator==(const DeadRegion&, const DeadRegion&) = default;
};

// A failover that is under way: `Order::map` is its map.
struct OrderedFailover {
  MapVersion version;
  std::vector<DeadRegion> dead;
};

struct OrderedMap {
  PartitionMap map;
  Tick effective;
  bool committed = false;
};

// A state in a file of this host.
struct StateFile {
  Tick tick;
  std::string path;
  std::string hash;  // SHA-256, hexadecimal, of a state that is to be read
};

// A game in a file of this host.
struct OrderedGame {
  std::string path;          // empty: it is not here yet; of a native one a shared library
  std::string hash;          // SHA-256, hexadecimal; empty: any
  std::string name;          // as its errors name it
  std::uint32_t number = 0;  // counts games; set for one that is to take the place of another
  std::string failure;       // why it will not come; empty: it is here or on its way
  bool native = false;       // a shared library, and `name` is the library's
  friend bool operator==(const OrderedGame&, const OrderedGame&) = default;
};

// By what this life of the region is known, and by what it knows others. Both are checked.
struct Certified {
  net::VerificationKey instance_key{};
  std::vector<std::uint8_t> certificate;
  net::VerificationKey worker_key{};  // that the certificate is for
};

struct Order {
  std::uint64_t revision = 0;
  std::string operation;  // as logs name it; empty: none, or not one
  std::string scene_path, scene_hash;
  std::optional<OrderedGame> game, next_game;
  std::optional<OrderedGame> movement;  // a shared library with one, beside a game in Lua
  std::optional<PartitionMap> map;
  std::optional<Certified> certified;  // nothing: not yet
  std::vector<PeerAddress> peers;
  std::vector<DeadRegion> revoked;     // lives that evicted hosts ran: no link to them is let in
  std::vector<OrderedPlayer> players;  // ascending by number
  // Not 0: those alone that are new or differ from those of the order of this revision, and who is named no more.
  std::uint64_t players_since = 0;
  std::vector<PlayerNumber> players_forgotten;  // ascending
  bool run = false, stop = false;
  bool goes_on = false;  // with `stop`: the instance need not end
  std::uint32_t snapshot_rate_hz = 30;
  region::RegionSettings borders;
  std::optional<OrderedFailover> failover;
  std::optional<region::Resolution> resolution;
  std::optional<OrderedMap> planned;
  MapVersion resumed{};  // a pause by a map of this version, or an older one, is over
  RegionId standby{};    // RegionId(): none
  std::vector<RegionId> primaries;
  std::optional<StateFile> checkpoint, initial_state;
  bool joins_running = false;
  std::vector<PropertyOrder> properties;  // ascending by number
  BackendOrderList backend;
};

// The one with this number among players that ascend; null: there is none.
const OrderedPlayer* FindPlayer(std::span<const OrderedPlayer> players, PlayerNumber number);

// Names the players of `order` all, which are changes of those in `before`, the order of the revision that it says.
void CompletePlayers(std::vector<OrderedPlayer> before, Order& order);

// `borders`: the settings that the message leaves open. Errors: FAILED_PRECONDITION if it is not meant for `self`,
// INVALID_ARGUMENT naming the field.
absl::StatusOr<Order> CheckOrder(const v1::WorkerOrder& message, const Identity& self,
                                 const region::RegionSettings& borders = {});

}  // namespace tessera::worker
