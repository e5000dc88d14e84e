// Planned maps: an instance grows and shrinks while it runs, and nothing is lost, torn or toppled.
#include <gmock/gmock.h>

#include <cstdio>

#include "tests/simulation/instance.h"

namespace tessera::simulation {
namespace {

using ::testing::IsEmpty;

constexpr double kHalf = 20;  // half the ground's side, m

void ExpectAllAtHome(const Instance& instance) {
  for (const auto& [id, worker] : instance.simulation->workers()) EXPECT_EQ(worker->region().away_count(), 0U) << id;
}

TEST(GrowthTest, ASwarmIsKeptWholeFromTwoRegionsToFourAndBack) {
  Instance instance(Swarm(kHalf, 200), 2);
  instance.simulation->RunTo(Tick(30));
  instance.ScaleTo(4);
  ExpectAllAtHome(instance);
  instance.simulation->RunFor(Milliseconds(500));
  instance.ScaleTo(2);
  instance.simulation->RunFor(Milliseconds(500));
  instance.simulation->Settle();
  EXPECT_THAT(instance.simulation->problems(), IsEmpty());
  EXPECT_EQ(instance.simulation->States().size(), 200U);
  EXPECT_EQ(instance.control->totals().planned, 4U);
}

TEST(GrowthTest, EveryNumberOfRegionsLeadsToEveryOther) {
  Instance instance(Swarm(kHalf, 60), 1);
  instance.simulation->RunTo(Tick(10));
  for (const std::uint32_t regions : {3U, 7U, 2U, 5U, 6U, 1U}) instance.ScaleTo(regions);
  instance.simulation->Settle();
  EXPECT_THAT(instance.simulation->problems(), IsEmpty());
  EXPECT_EQ(instance.simulation->States().size(), 60U);
}

TEST(GrowthTest, StacksStandAndJointsHoldWhileTheirRegionsChange) {
  SceneBuilder builder(kHalf);
  builder.Gravity().Floor(0.6);
  for (int stack = 0; stack < 12; ++stack) {
    const double x = -15.0 + stack % 4 * 10, z = -12.0 + stack / 4 * 12;
    for (int i = 0; i < 5; ++i) builder.Add(Box(0.5), {x, 0.5 + i, z});
  }
  const std::uint64_t first_link = builder.scene().bodies.size() + 1;
  for (int i = 0; i < 12; ++i) builder.Add(Ball(0.3), {-8.0 + i, 0.3, 3});
  for (std::uint64_t i = 0; i < 11; ++i) {
    builder.Tie(BodyId(first_link + i), BodyId(first_link + i + 1), {0.5, 0, 0}, {-0.5, 0, 0});
  }
  Instance instance(builder, 2);
  instance.simulation->RunTo(Tick(120));
  const std::map<BodyId, BodyState> before = instance.simulation->States();
  instance.ScaleTo(4);
  instance.ScaleTo(3);
  instance.ScaleTo(2);
  instance.simulation->RunFor(Milliseconds(1000));
  instance.simulation->Settle();
  EXPECT_THAT(instance.simulation->problems(), IsEmpty());
  double furthest = 0;
  for (const auto& [id, state] : instance.simulation->States()) {
    furthest = std::max(furthest, Length(state.position - before.at(id).position));
  }
  std::printf("stacks and a chain through three changes: furthest moved %.2e m\n", furthest);
  EXPECT_LT(furthest, 0.05);
  for (std::uint64_t i = 0; i < 11; ++i) {
    EXPECT_EQ(instance.simulation->OwnerOf(BodyId(first_link)), instance.simulation->OwnerOf(BodyId(first_link + i)));
  }
}

TEST(GrowthTest, ChangesUnderLossAndDelayComeRight) {
  for (const std::uint64_t seed : {1U, 2U, 3U}) {
    Instance instance(Swarm(kHalf, 80), 2, {.seed = seed, .conditions = {.loss = 0.05, .jitter = 6000}});
    instance.simulation->RunTo(Tick(30));
    instance.ScaleTo(4);
    instance.ScaleTo(2);
    instance.simulation->Settle();
    EXPECT_THAT(instance.simulation->problems(), IsEmpty());
    EXPECT_EQ(instance.simulation->States().size(), 80U);
  }
}

TEST(GrowthTest, AMapThatNotEveryoneCouldHearOfInTimeComesIntoForceNowhere) {
  const SceneBuilder builder = Swarm(kHalf, 20);
  const std::shared_ptr<const Scene> scene = builder.Build();
  const PartitionMap map = *MakeGridMap(scene->ground(), 4);
  std::unique_ptr<ControlModel> control;
  Simulation simulation(scene, map, {.attach = [&](Simulation& s) {
                          control = std::make_unique<ControlModel>(s, map, ControlOptions{.lead_ticks = 2});
                        }});
  simulation.RunTo(Tick(10));
  control->Plan(*MakeGridMap(scene->ground(), 2));
  simulation.RunFor(Milliseconds(1500));
  EXPECT_GT(control->totals().refused, 0U);
  for (const auto& [id, worker] : simulation.workers()) EXPECT_EQ(worker->region().map().version(), MapVersion(1));
  EXPECT_THAT(simulation.problems(), IsEmpty());
}

}  // namespace
}  // namespace tessera::simulation
