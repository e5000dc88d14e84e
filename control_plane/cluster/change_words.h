// Planned changes of who runs what, in words for an operator. Pure.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>

#include "control_plane/change.h"
#include "control_plane/cluster/cluster_state.h"

namespace tessera::control {

// Regions with the names of their hosts, and their cells.
struct Layout {
  std::map<std::uint32_t, std::string> hosts;
  v1::PartitionMap map;
};
// As the record's map in force has it.
Layout LayoutOf(const ClusterState& state, const records::Instance& record);

// How a change that is done has changed the world: "region 5 on beta has begun, region 2 on alpha has left: 4 regions
// run". `before`: when it began; none: nobody knows any more.
std::string DescribeDone(const std::optional<Layout>& before, const Layout& after);

// Which change has no room: "waits for room: host beta is to be emptied, and region 5 needs a place; ...". `why`: as
// PlanChange says it.
std::string DescribeNoRoom(const ClusterState& state, const records::Instance& record,
                           std::span<const RegionFacts> facts, const std::string& why);

}  // namespace tessera::control
