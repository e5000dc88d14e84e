// Whole instances in virtual time: what the network and the hosts do to them changes nothing that counts.
#include "tests/simulation/simulation.h"

#include <gmock/gmock.h>

#include "tests/simulation/instance.h"

namespace tessera::simulation {
namespace {

using ::testing::IsEmpty;

constexpr double kHalf = 12;  // half the ground's side, m

Simulation Make(const SceneBuilder& builder, std::uint32_t regions, const SimulationOptions& options) {
  const std::shared_ptr<const Scene> scene = builder.Build();
  return Simulation(scene, *MakeGridMap(scene->ground(), regions), options);
}

TEST(SimulationTest, TheSameSeedGivesTheSameBits) {
  const auto run = [](std::uint64_t seed) {
    Simulation simulation = Make(Swarm(kHalf, 40), 4, {.seed = seed, .conditions = {.loss = 0.05, .jitter = 4000}});
    simulation.RunTo(Tick(120));
    EXPECT_THAT(simulation.problems(), IsEmpty());
    EXPECT_GT(simulation.totals().handovers, 10U);
    return std::pair(simulation.hash(), simulation.network().totals().packets);
  };
  EXPECT_EQ(run(3), run(3));
  EXPECT_NE(run(3).second, run(4).second);
}

TEST(SimulationTest, NoWeatherChangesTheWorld) {
  const auto run = [](const PacketConditions& conditions) {
    Simulation simulation = Make(Swarm(kHalf, 40), 4, {.conditions = conditions});
    for (auto& [id, worker] : simulation.workers()) worker->set_target(Tick(200));
    simulation.RunTo(Tick(200));
    EXPECT_THAT(simulation.problems(), IsEmpty());
    return simulation.hash();
  };
  const std::uint64_t fine = run({});
  EXPECT_EQ(run({.loss = 0.1}), fine);
  EXPECT_EQ(run({.delay = 20'000, .jitter = 30'000}), fine);
  EXPECT_EQ(run({.reorder = 0.5, .duplicate = 0.5}), fine);
}

TEST(SimulationTest, ABrokenConnectionIsDialledAgainAndNothingIsMissing) {
  Simulation simulation = Make(Swarm(kHalf, 40), 4, {.conditions = {.delay = 3000}});
  for (int i = 0; i < 40; ++i) {
    simulation.RunFor(Milliseconds(70));
    simulation.network().Break(1 + i % 2, 3 + i % 2);
  }
  simulation.Settle();
  EXPECT_THAT(simulation.problems(), IsEmpty());
  EXPECT_GT(simulation.tick(), Tick(120));
}

TEST(SimulationTest, AKilledWorkerIsGoneAndAnotherLifeMayStart) {
  Simulation simulation = Make(Swarm(kHalf, 10), 2, {});
  simulation.RunTo(Tick(10));
  simulation.Kill(RegionId(2));
  EXPECT_FALSE(simulation.Alive(RegionId(2)));
  EXPECT_EQ(simulation.OwnerOf(simulation.scene()->bodies[4].id), RegionId(1));  // the first ball
  simulation.RunFor(Milliseconds(100));
  SimulatedRegion& next =
      simulation.StartWorker({RegionId(2), Incarnation(2), simulation.scene(),
                              *MakeGridMap(simulation.scene()->ground(), 2), region::RegionSettings()});
  EXPECT_EQ(next.region().tick(), Tick());
  EXPECT_EQ(simulation.totals().kills, 1U);
}

}  // namespace
}  // namespace tessera::simulation
