// CoreRig: region 1 of a small world, with the links and actions that a part of a worker's core is given. For tests of
// those parts.
//
//   CoreRig rig;                                  // alone in its world
//   part.Follow(order, rig.region, rig.actions);
//   rig.StepTo(Tick(10));
//   EXPECT_EQ(rig.Logged(Severity::kWarning), 1);
#pragma once

#include <algorithm>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "core/region/region.h"
#include "core/world/partition_map.h"
#include "region_worker/core/actions.h"
#include "region_worker/core/link_table.h"
#include "region_worker/core/time.h"
#include "region_worker/testing/small_world.h"

namespace tessera::worker {

struct CoreRig {
  static constexpr RegionId kSelf{1}, kOther{2};

  explicit CoreRig(std::uint32_t regions = 1, const std::shared_ptr<const Scene>& scene = SmallWorld())
      : region(ConfigOf(kSelf.value(), regions, scene)) {
    region.Start();
  }

  // Requires that nobody is waited for.
  region::StepResult Step() { return region.Step(); }
  void StepTo(Tick tick) {
    while (region.tick() < tick) region.Step();
  }
  void LinkUp(RegionId other) { links.Up(other, Incarnation(1), now, actions); }
  // Lines of that severity among the actions.
  std::ptrdiff_t Logged(Severity severity) const {
    return std::ranges::count(AllOf<Log>(actions), severity, &Log::severity);
  }

  region::Region region;
  LinkTable links{kSelf};
  Actions actions;
  TimePoint now{std::chrono::hours(1)};
};

// The same cells in a later map.
inline PartitionMap LaterMap(const PartitionMap& map, std::uint64_t version) {
  return *PartitionMap::Create(MapVersion(version), map.bounds(), {map.cells().begin(), map.cells().end()},
                               {map.regions().begin(), map.regions().end()});
}

// All cells are one region's.
inline PartitionMap MapOfOne(const PartitionMap& map, std::uint64_t version, RegionId owner) {
  return *PartitionMap::Create(MapVersion(version), map.bounds(), {{map.bounds(), owner, Epoch(2)}},
                               {{owner, RegionId()}});
}

// The small world with bodies for players.
inline std::shared_ptr<const Scene> WorldWithPlayers() {
  auto scene = std::make_shared<Scene>(*SmallWorld());
  PlayerRules& rules = scene->player.emplace();
  rules.body.shape = std::make_shared<const Shape>(Shape{SphereShape{0.5}});
  rules.spawn_points = {{5, 0, 8}};
  rules.max_force_n = 20;
  rules.max_speed_m_s = 5;
  return scene;
}

}  // namespace tessera::worker
