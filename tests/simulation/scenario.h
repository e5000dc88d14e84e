// Scenario: a world, a map and a list of faults, all drawn from one seed, and what came of running it.
//
//   const Scenario scenario = DrawScenario(17);
//   const ScenarioOutcome outcome = Run(scenario);
//   for (const std::string& problem : outcome.problems) ...
//
// The same seed gives the same scenario and the same outcome, on every host. Thread rule: free functions on values;
// several scenarios may run at once in threads of their own.
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tests/simulation/control_model.h"

namespace tessera::simulation {

// A fault that strikes an instance. The first five are network conditions, which hold everywhere while they last.
enum class FaultKind : std::uint8_t {
  kLoss,
  kDelay,
  kJitter,
  kReorder,
  kDuplicate,
  kBreak,      // a connection ends; what was on its way is lost
  kPartition,  // two groups of regions do not hear each other
  kStall,      // a worker stands still
  kSlow,       // each tick of a worker takes longer than a tick
  kKill,       // a worker dies, as soon as its standby has a copy; lasts until its area moves again
  kRestart,    // a new worker takes the place of the dead by a planned map; lasts until that is settled
};
inline constexpr std::size_t kFaultKinds = 11;
inline constexpr std::array<const char*, kFaultKinds> kFaultNames = {
    "loss", "delay", "jitter", "reorder", "duplicate", "break", "partition", "stall", "slow", "kill", "restart"};

struct ScheduledFault {
  FaultKind kind = FaultKind::kLoss;
  Micros from = 0, until = 0;
  RegionId a, b;        // regions that it strikes; for a partition: the regions up to `a` and those beyond
  double strength = 0;  // a share, or microseconds
};

// The kind of world that a scenario plays in.
enum class WorldKind : std::uint8_t {
  kSwarm,
  kCloud,
  kChains,
  kStacks,
  kCrowd,
  kGiant,
  kVortex,
  kPlayers,
  kMill,
  kStream
};
inline constexpr std::size_t kWorlds = 10;
inline constexpr std::array<const char*, kWorlds> kWorldNames = {"swarm", "cloud",  "chains",  "stacks", "crowd",
                                                                 "giant", "vortex", "players", "mill",   "stream"};

struct Scenario {
  std::uint64_t seed = 0;
  WorldKind world = WorldKind::kSwarm;
  std::shared_ptr<const Scene> scene;
  PartitionMap map;
  region::RegionSettings settings;
  std::uint64_t ticks = 0;
  bool closed = false;  // nothing acts on the bodies from outside: momentum is kept
  std::uint32_t players = 0;
  std::vector<ScheduledFault> faults;
};

struct DrawOptions {
  std::optional<WorldKind> world;
  bool faults = true;
};

Scenario DrawScenario(std::uint64_t seed, const DrawOptions& options = {});
// "cloud of 32 on 4 regions, 300 ticks, faults: loss, stall".
std::string Describe(const Scenario& scenario);

struct ScenarioOutcome {
  std::vector<std::string> problems;
  SimulationTotals totals;
  NetworkTotals network;
  std::array<std::uint64_t, kFaultKinds> handovers_under{};  // while a fault of the kind held the two regions up
  std::uint64_t cut_short = 0;  // handovers whose granter or new owner died between grant and acknowledgement
  ControlTotals control;
  std::size_t lost = 0, doubled = 0;
  std::uint64_t closings = 0, openings = 0;
  std::uint64_t hash = 0;
  double momentum_drift = 0;  // share of the sum of all momenta; of closed scenes
};

// `network_seed` draws what the network does; the world must not depend on it while no border closes.
ScenarioOutcome Run(const Scenario& scenario, std::optional<std::uint64_t> network_seed = {});

}  // namespace tessera::simulation
