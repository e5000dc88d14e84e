// DeploymentScenario: a deployment and what goes wrong with it, drawn from one seed, and what came of running it.
//
//   const DeploymentScenario scenario = DrawDeployment(17);
//   const ScenarioOutcome outcome = Run(scenario);
//
// None of these faults may cost a body: those that take a region from the world come one at a time, when its standby is
// elsewhere and has a copy; the others come at any time. Thread rule: free functions on values.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "tests/simulation/drawn_fault.h"
#include "tests/simulation/scenario.h"

namespace tessera::simulation {

enum class DeploymentFaultKind : std::uint8_t {
  kAgentDies,          // and comes back
  kControlDies,        // and comes back
  kControlDiesStored,  // right after something that it stores, before anybody is told; or right before
  kControlStandsStill,
  kWeather,  // everywhere
  kPlayer,   // comes, or leaves
  kScale,
  kProperty,       // changes a body's property
  kStandbyCutOff,  // a region and its standby do not hear each other, all others do
  // Those that take regions from the world.
  kWorkerDies,
  kHostCrashes,  // and comes back empty
  kHostCutOff,
  kHostStandsStill,
  kNewcomerDies,  // the world is scaled up for that
};
inline constexpr std::size_t kDeploymentFaultKinds = 14;
inline constexpr std::array<const char*, kDeploymentFaultKinds> kDeploymentFaultNames = {
    "agent dies",
    "control plane dies",
    "control plane dies after storing",
    "control plane stands still",
    "network",
    "player",
    "scale",
    "property",
    "standby cut off",
    "worker dies",
    "host crashes",
    "host cut off",
    "host stands still",
    "newcomer dies"};

using DeploymentFault = DrawnFault<DeploymentFaultKind>;

struct DeploymentScenario {
  std::uint64_t seed = 0;
  std::shared_ptr<const Scene> scene;
  DeploymentOptions options;
  std::vector<DeploymentFault> faults;
};

DeploymentScenario DrawDeployment(std::uint64_t seed);
std::string Describe(const DeploymentScenario& scenario);
ScenarioOutcome Run(const DeploymentScenario& scenario);

}  // namespace tessera::simulation
