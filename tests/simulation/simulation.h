// Simulation: a whole instance in one process, from one seed, under a virtual clock and network.
//
// It holds what a real instance has: a worker for each region, a map authority that starts them and tells them of
// players, players that send inputs. Faults come from outside: kills, restarts, standstills, cuts, breaks, network
// conditions. An invariant checker checks after each step that nothing is lost or doubled.
//
//   Simulation simulation(scene, *MakeGridMap(scene->ground(), 4), {.seed = 7});
//   simulation.RunTo(Tick(100));
//   simulation.network().Cut(1, 2, true);
//   simulation.RunFor(Milliseconds(400));
//   simulation.network().Cut(1, 2, false);
//   simulation.Settle();                            // no faults any more: all must come right
//   EXPECT_THAT(simulation.problems(), IsEmpty());
//
// A kill ends a worker with all that it knew; `StartWorker` starts one, with whatever map and state the caller has for
// it. What failover does about it hangs itself in by `on_worker_started`, `on_step`, `on_message` and `on_killed`.
// Thread rule: one thread at a time.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "core/game/game_host.h"
#include "tests/simulation/invariant_checker.h"
#include "tests/simulation/simulated_region.h"

namespace tessera::simulation {

constexpr Node kAuthorityNode = 1'000'000;  // the control plane
constexpr Node ClientNode(PlayerNumber player) { return 2'000'000 + player.value(); }

class Simulation;

struct SimulationOptions {
  std::uint64_t seed = 1;
  region::RegionSettings settings = {};
  PacketConditions conditions = {};
  bool weigh = false;  // the invariant checker adds up momentum and energy
  // Makes the game of one region; bodies that it makes and removes are followed. Null: no game.
  std::function<std::shared_ptr<game::GameHost>(std::shared_ptr<const Scene>)> game = nullptr;
  // Called before the first worker starts: the place to hang something in.
  std::function<void(Simulation&)> attach = nullptr;
};

struct SimulationTotals {
  std::uint64_t steps = 0, handovers = 0, assembly_handovers = 0, corner_handovers = 0;  // bodies
  std::uint64_t kills = 0, nonfinite = 0, inputs = 0, inputs_taken = 0;
};

class Simulation {
 public:
  Simulation(std::shared_ptr<const Scene> scene, const PartitionMap& map, const SimulationOptions& options);
  ~Simulation();

  // --- Time.
  void RunFor(Micros time);
  // Until all workers have reached the tick, or one has made no step for five seconds: that is a problem.
  void RunTo(Tick tick);
  // Ends faults that the network knows of, and runs until all workers stand at one tick with all borders open.
  void Settle();
  Tick tick() const;  // that all workers have reached
  // Borders that closed, once for each side of them that gave the other one up.
  std::uint64_t Closings() const;

  // --- Faults.
  void Kill(RegionId region);
  bool Alive(RegionId region) const { return workers_.contains(region); }
  void Stall(RegionId region, Micros time);
  void CutBetween(RegionId a, RegionId b, Micros time);
  // Its last life must have ended.
  SimulatedRegion& StartWorker(region::Config config);

  // --- What hangs itself in. Called in this order: started, then steps and messages, then killed.
  std::function<void(SimulatedRegion&)> on_worker_started;
  std::function<void(SimulatedRegion&, const region::StepResult&)> on_step;
  std::function<void(SimulatedRegion&, Node from, std::uint8_t kind, std::span<const std::uint8_t>)> on_message;
  std::function<void(SimulatedRegion&, Node from, const Bytes&)> on_datagram;
  std::function<void(RegionId)> on_killed;
  // Bodies that others than owners and granters keep, e.g. standbys: asked for by the check of copies.
  std::function<void(std::vector<BodyId>&)> more_copies;

  // --- Players.
  void SpawnPlayer(PlayerNumber player, RegionId region);
  void RemovePlayer(PlayerNumber player);

  SimulatedRegion& worker(std::uint32_t region) { return *workers_.at(RegionId(region)); }
  std::map<RegionId, std::unique_ptr<SimulatedRegion>>& workers() { return workers_; }
  const std::map<RegionId, std::unique_ptr<SimulatedRegion>>& workers() const { return workers_; }
  Timeline& timeline() { return timeline_; }
  VirtualNetwork& network() { return network_; }
  Chance& chance() { return chance_; }
  InvariantChecker& invariants() { return invariants_; }
  const std::vector<std::string>& problems() const { return invariants_.problems(); }
  const SimulationTotals& totals() const { return totals_; }
  std::uint64_t hash() const { return invariants_.hash(); }
  const std::shared_ptr<const Scene>& scene() const { return scene_; }
  const SimulationOptions& options() const { return options_; }

  RegionId OwnerOf(BodyId id) const;  // RegionId() if nobody
  std::map<BodyId, BodyState> States() const;

 private:
  void Stepped(SimulatedRegion& worker, const region::StepResult& result);
  void CountHandovers(SimulatedRegion& worker, const region::StepResult& result);
  void CheckCopies();
  bool AllOpen() const;
  std::uint64_t Unrest() const;
  std::string Standstill() const;

  std::shared_ptr<const Scene> scene_;
  PartitionMap map_;
  SimulationOptions options_;
  Timeline timeline_;
  Chance chance_;
  VirtualNetwork network_;
  InvariantChecker invariants_;
  std::map<RegionId, std::unique_ptr<SimulatedRegion>> workers_;
  std::vector<Vec3d> corners_;  // where three cells or more meet
  std::vector<std::uint8_t> jointed_;
  SimulationTotals totals_;
  std::uint64_t closings_of_ended_ = 0;  // workers
};

}  // namespace tessera::simulation
