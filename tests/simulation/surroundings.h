// Surroundings: all that the processes of a Deployment share: virtual time, the network, the disks; and the checks that
// hear of what they do.
//
// Thread rule: one thread at a time.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <utility>

#include "absl/status/statusor.h"
#include "core/region/region.h"
#include "region_worker/core/order.h"
#include "tests/simulation/virtual_network.h"
#include "tests/simulation/virtual_time.h"

namespace tessera::simulation {

class SimulatedWorker;

struct Surroundings {
  Timeline timeline;
  VirtualNetwork network;
  std::shared_ptr<const Scene> scene;
  region::RegionSettings settings;
  std::map<std::string, Bytes> files;             // by path, on all hosts
  std::string game;                               // Lua, as all hosts have it; empty: the world runs none
  std::set<RegionId> damaged_games;               // regions on whose hosts it is not what it was
  std::map<std::string, std::string> next_games;  // by hash: those that are to take its place

  // The checks: a step, a resumption included; a failover that is carried out now declares those lives dead.
  std::function<void(SimulatedWorker&, const region::StepResult&)> on_step;
  std::function<void(SimulatedWorker&, const worker::OrderedFailover&)> on_takeover;
  std::function<void(SimulatedWorker&, const std::string&)> on_failure;

  Surroundings(std::uint64_t seed, std::shared_ptr<const Scene> of) : network(timeline, seed), scene(std::move(of)) {}
  worker::TimePoint Now() const { return TimePointAt(timeline.now()); }
  // NOT_FOUND: nothing was written there.
  absl::StatusOr<Bytes> FileAt(const std::string& path) const;
  // The game of that hash as the host of `region` has it.
  std::string GameOnHostOf(RegionId region, const std::string& hash) const;
};

}  // namespace tessera::simulation
