// A plan of an instance, for tests.
#pragma once

#include "control_plane/instance_plan.h"

namespace tessera::control {

// `regions` regions on 100 m x 100 m whose scene lets players in.
inline InstancePlan TestPlan(std::uint32_t regions, std::uint32_t expected_players = 0) {
  InstancePlan plan;
  plan.scene_name = "test";
  plan.scene_hash = "0123";
  plan.contents.scene = "scene";
  plan.tick_rate_hz = 60;
  plan.snapshot_rate_hz = 30;
  plan.expected_players = expected_players;
  plan.start_deadline = std::chrono::seconds(30);
  plan.map = *MakeGridMap({0, 0, 100, 100}, regions);
  plan.spawn_points = {{10, 0, 10}, {90, 0, 90}};
  return plan;
}

}  // namespace tessera::control
