// Handover: which bodies should go to whom. The map says who should own a place; hysteresis keeps a body that stands on
// a border where it is.
//
// Thread rule: free functions on values.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "absl/functional/function_ref.h"
#include "core/region/bodies.h"
#include "core/region/catalog.h"
#include "core/region/neighborhood.h"
#include "core/region/region_players.h"
#include "core/region/region_state.h"
#include "core/region/settings.h"
#include "core/world/partition_map.h"

namespace tessera::region {

// The neighbour to grant an assembly with this anchor (the position of its lowest body) to; none if it stays. The
// place's owner if that is a neighbour, otherwise the neighbour nearest to it (the lowest id on a tie), which passes it
// on.
std::optional<RegionId> HandoverTarget(const PartitionMap& map, RegionId self, std::span<const RegionId> neighbors,
                                       Vec3d anchor, double hysteresis_m);

struct PlannedHandover {
  RegionId to;
  std::vector<std::size_t> assembly;  // indices as of Bodies::EntityAt, ascending
};

// A joint calls the assembly of this body to another region.
struct Summons {
  BodyId body;
  RegionId to;
};

// Assemblies that are to change hands after this step, ascending by their lowest bodies. No more than
// max_grants_per_tick bodies, but an assembly goes whole. `may_grant` says whether the next frame to a neighbour will
// be sent; a body whose target gets none stays for now. Those of `summoned`, ascending by body, go where they are
// called. Who moves another body goes with it: `driven`, ascending by the players' own bodies. `inland`: every owned
// body is in a cell of this region's.
std::vector<PlannedHandover> PlanHandovers(const Bodies& bodies, const Neighborhood& neighborhood,
                                           const RegionSettings& settings, absl::FunctionRef<bool(RegionId)> may_grant,
                                           std::span<const Summons> summoned = {}, std::span<const Driven> driven = {},
                                           bool inland = false);

// Bodies and kept copies of grants that are too far outside this region's cells to be seen by those that they could
// touch, given a settled map. A body that crosses a border fast is that far out for a tick or two in any map, and does
// not count: in a world of fast bodies there is always one.
std::size_t CountAway(const Bodies& bodies, const KeptGrants& kept, const Catalog& catalog,
                      const Neighborhood& neighborhood, const RegionSettings& settings, double tick_s);

}  // namespace tessera::region
