// Failover: the steps of an instance's record when workers die while it runs. Pure: records and facts in, the next
// record out. Failovers (cluster/failovers.h) takes them:
//
//   deaths -> BeginFailover: the dead leave the map, and this failover map is stored before anybody hears of it
//          -> the living answer with inventories, and every dead worker stands still (failover_watch.h)
//          -> ResolveFailover: who promotes which bodies; the living learn it, and then WithResolution is stored
//          -> the living run by the new map -> EndFailover
//
// A death on the way begins anew with a higher version and the dead of both. Each step is found again from the stored
// record, so a control plane may end between any two. One that finds a failover without a resolution cannot know
// whether some of the living were sent one and have resumed: it begins anew with MaybeResolved, and the inventories of
// that map show who owns what (docs/decisions/0081-one-write-a-failover.md). Only the living of the record get orders:
// a worker that was cut off is in no desired set when it is heard of again, and ends.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "control_plane/control_records.pb.h"
#include "control_plane/now.h"
#include "control_plane/players.h"
#include "control_plane/standbys.h"
#include "core/region/resolve.h"

namespace tessera::control {

struct Death {
  std::uint32_t region = 0;
  std::uint64_t incarnation = 0;
  bool exit_seen = false;
};

using Inventories = std::map<std::uint32_t, v1::Inventory>;  // by region of the living

// Regions that died together with their standby, and so with all that was known of their bodies; empty if all can be
// carried on. `deaths` come on top of those of a failover that is not resolved yet.
std::vector<std::uint32_t> BeyondFailover(const records::Instance& record, const std::vector<Death>& deaths);

// Declares the workers dead: they lose their placements, and if they had a part in the world, the failover map and the
// failover are set. Without such a part only a plan that needed them is dropped, and the map stays. Without deaths the
// failover under way begins anew. INVALID_ARGUMENT if no region is left.
absl::StatusOr<records::Instance> BeginFailover(const records::Instance& record, const std::vector<Death>& deaths,
                                                const CutBetween& cut, Now now);

// Decides who promotes which bodies. DATA_LOSS names the regions that nobody has a copy of; a newcomer that died before
// its standby had one does not count, unless a body is missing.
absl::StatusOr<region::Resolution> ResolveFailover(const records::Instance& record, const Inventories& living);

// Sets what ResolveFailover gave for the failover of `record`, and counts what it lost.
records::Instance WithResolution(const records::Instance& record, const region::Resolution& resolution, Now now);
// With it, the players: bodies that a dead region was to make, and had not made as far as anybody knows, are made by
// the region that has the place now.
Players WithNewSpawns(const Players& players, const records::Instance& record, const region::Resolution& resolution);

// The failover of `record`, whose dead may or may not have been carried on by now.
records::Instance MaybeResolved(const records::Instance& record);

// All have resumed.
records::Instance EndFailover(const records::Instance& record);

// "region 3 to region 4"
std::string DescribeFailover(const records::Failover& failover);

}  // namespace tessera::control
