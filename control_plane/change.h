// Changes of who runs what while a world runs: scaling, draining, replacing, balancing, new standbys. All are one
// thing: a planned map. Pure: a record and facts in, the next record out.
//
//   PlanChange: the greatest difference from what is wanted -> a planned map, and places for newcomers, which start
//   StepPlan:   newcomers are bound -> a tick for it, sent to all -> all know it, and newcomers are linked -> committed
//               -> in force
//               -> nobody holds bodies in another's cells -> the settled map, by the same steps -> done
//
// There is one plan at a time, and none during a failover. In a paused world there is none but a step by so many ticks,
// whose commitment ends the pause. A plan that comes too late for its tick is put off under a
// new version. Each step is found again from the stored record.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "control_plane/control_records.pb.h"
#include "control_plane/placement.h"
#include "control_plane/region_tree.h"

namespace tessera::control {

// The facts about one placed region.
struct RegionFacts {
  std::uint32_t region = 0;
  std::uint64_t incarnation = 0;
  std::string host_id;
  bool host_draining = false;
  bool leaves_host = false;  // by its host the world is slow, or its link cut; another runs it if one has room
  bool newcomer = false;     // begins with the plan under way
  bool bound = false, running = false;
  std::uint64_t tick = 0;  // by now, reckoned from its last report
  std::uint64_t map_version = 0, planned_version = 0, refused_version = 0;
  std::uint64_t bodies_outside = 0;
  std::vector<std::uint32_t> cut_from;  // regions with which it cannot keep up a link, ascending
  // Neighbours, by the announced map, without a link to this newcomer, ascending; none of others. A neighbour with a
  // cut link of its own is not waited for: the change may be the way around it.
  std::vector<std::uint32_t> unlinked;
  double step_s = 0;    // how long a step takes
  RegionSpread spread;  // where its awake bodies lie; empty: not known
};

// One step of the change under way; nothing while it has to wait, or if there is none.
std::optional<records::Instance> StepPlan(const records::Instance& record, std::span<const RegionFacts> facts);

// The record without the change under way, which is not committed: its newcomers end, and all others go on as they
// were.
records::Instance TakenBack(const records::Instance& record);

// True if nothing is under way: no failover, no plan, nobody with bodies in another's cells.
bool AtRest(const records::Instance& record);

// The next change towards what is wanted, for a world at rest whose regions all run; nothing if it is as wanted.
// RESOURCE_EXHAUSTED when a place is needed and there is none. `hosts`: those that take regions, with what is free.
absl::StatusOr<std::optional<records::Instance>> PlanChange(const records::Instance& record,
                                                            std::span<const RegionFacts> facts,
                                                            std::span<const FreeHost> hosts);

// The change under way, for a person: "map 7 at tick 1200: being announced"; empty at rest.
std::string DescribePlan(const records::Instance& record);

}  // namespace tessera::control
