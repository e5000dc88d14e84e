// Failover: what becomes of an instance when workers die while it runs. Pure: records and facts in, the next record
// out.
//
//   deaths -> BeginFailover: the failover map, stored before anybody hears of it
//          -> all the living have answered with their inventories, and every dead worker is known to stand still
//          -> FinishInventory: the resolution, stored before anybody hears of it
//          -> all the living run by the new map -> EndFailover
//
// A death on the way begins anew with a higher version and the dead of both. Each step is found again from the stored
// record, so a control plane may end between any two. Only the living of the record are ordered: a worker that was cut
// off is in no desired set when it is heard of again, and ends.
#pragma once

#include <map>
#include <set>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "control_plane/control_records.pb.h"
#include "control_plane/heirs.h"
#include "control_plane/moment.h"
#include "core/world/partition_map.h"

namespace tessera::control {

struct Death {
  std::uint32_t region = 0;
  std::uint64_t incarnation = 0;
  bool exit_seen = false;
};

// What a failover under way has come to know. Not stored: the living tell it again.
struct FailoverWatch {
  std::uint64_t version = 0;  // of the failover that the rest is about
  Steady since{0};            // stored or loaded at
  std::map<std::uint32_t, v1::Inventory> inventories;
  std::map<std::uint64_t, Steady>
      stands_still_at;             // by incarnation of the dead: when its lease has run out for certain
  std::set<std::uint64_t> exited;  // incarnations of the dead whose end was seen
};

// Regions that died together with their heir, and so with all that was known of their bodies; empty if all can be
// carried on. `deaths` beside those of a failover that is not resolved yet.
std::vector<std::uint32_t> BeyondFailover(const records::Instance& record, const std::vector<Death>& deaths);

// INVALID_ARGUMENT if none is left.
absl::StatusOr<records::Instance> BeginFailover(const records::Instance& record, const std::vector<Death>& deaths,
                                                const HostOfRegion& host_of, const CutBetween& cut, Moment now);

// What it waits for, for a person: "2 inventories", "region 3 to stand still"; empty when it can be resolved.
std::string WaitsFor(const records::Instance& record, const FailoverWatch& watch, Moment now);

// Takes an inventory in. An error names the field. False if it is of another failover, or there is none.
absl::StatusOr<bool> TakeInventory(const records::Instance& record, std::uint32_t region,
                                   const v1::Inventory& inventory, Moment now, FailoverWatch& watch);

// With the resolution. DATA_LOSS names the regions of which no copy was found; a newcomer that died before its heir had
// one is none of them, unless a body is missing.
absl::StatusOr<records::Instance> ResolveFailover(const records::Instance& record, const FailoverWatch& watch);

// The region that has the player's spawn point. Requires a spawn point.
std::uint32_t SpawnRegionOf(std::uint32_t player, const records::Instance& record, const PartitionMap& map);

// All have resumed.
records::Instance EndFailover(const records::Instance& record);

// "region 3 to region 4"
std::string DescribeFailover(const records::Failover& failover);

// Appends an event; the oldest go.
void AddEvent(records::Instance& record, Moment now, std::string text);

}  // namespace tessera::control
