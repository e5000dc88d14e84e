// DeployedWorld: a Deployment of one world that runs, and what must be so of it after faults that may cost no body. For
// tests: it expects.
//
//   class CutLinkTest : public QuietTest {};
//   TEST_F(CutLinkTest, ...) {
//     DeployedWorld run({.seed = seed, .hosts = 3, .regions = 2}, MomentOf(seed));
//     run.deployment.Kill(RegionId(2));
//     run.ExpectWhole();
//   }
//
// Thread rule: one thread at a time.
#pragma once

#include <gmock/gmock.h>

#include <cstddef>
#include <cstdint>

#include "spdlog/spdlog.h"
#include "tests/simulation/deployment.h"
#include "tests/simulation/instance.h"

namespace tessera::simulation {

// Workers, agents and control planes say what they do, in virtual time: nothing for a test's output.
class QuietTest : public testing::Test {
 protected:
  QuietTest() { spdlog::set_level(spdlog::level::off); }
};

constexpr double kDeployedHalf_m = 20;  // half the ground's side

// Each seed is struck at another moment.
constexpr Micros MomentOf(std::uint64_t seed) { return Milliseconds(300 + 170 * seed); }

struct DeployedWorld {
  // A swarm that flies across all borders. It has been calm for `calm_for`.
  explicit DeployedWorld(const DeploymentOptions& options, Micros calm_for = MomentOf(0), std::size_t balls = 60)
      : DeployedWorld(Swarm(kDeployedHalf_m, static_cast<int>(balls)), balls, options, calm_for) {}
  // `count`: dynamic bodies of the scene.
  DeployedWorld(const SceneBuilder& scene, std::size_t count, const DeploymentOptions& options, Micros calm_for)
      : bodies(count), deployment(scene.Build(), options) {
    EXPECT_TRUE(deployment.AwaitCalm()) << deployment.Standing();
    deployment.RunFor(calm_for);
  }

  void ExpectWhole() {
    deployment.Settle();
    EXPECT_THAT(deployment.problems(), testing::IsEmpty());
    EXPECT_EQ(deployment.bodies(), bodies);
    EXPECT_EQ(deployment.instance().lost_bodies(), 0U);
  }

  std::size_t bodies;
  Deployment deployment;
};

}  // namespace tessera::simulation
