// Planned maps: an instance grows and shrinks while it runs, and nothing is lost, torn or toppled.
#include <gmock/gmock.h>

#include <cstdio>

#include "tests/simulation/control.h"
#include "tests/simulation/scene_builder.h"

namespace tessera::simulation {
namespace {

using ::testing::IsEmpty;

constexpr double kHalf = 20;

struct Instance {
  Instance(const SceneBuilder& builder, std::uint32_t regions, SimulationOptions options = {}) {
    scene = builder.Build();
    const PartitionMap map = *MakeGridMap(scene->ground(), regions);
    options.attach = [this, map](Simulation& s) { control = std::make_unique<Control>(s, map); };
    simulation = std::make_unique<Simulation>(scene, map, options);
  }
  void ScaleTo(std::uint32_t regions) {
    control->Plan(*MakeGridMap(scene->ground(), regions));
    for (int i = 0; i < 200 && !control->idle(); ++i) simulation->RunFor(Milliseconds(50));
    EXPECT_TRUE(control->idle()) << "to " << regions;
    if (!control->idle()) Describe();
    EXPECT_EQ(simulation->workers().size(), regions);
  }
  void Describe() {
    for (const auto& [id, worker] : simulation->workers()) {
      const region::Region& region = worker->region();
      std::string waits;
      for (const RegionId other : region.WaitingFor()) waits += " " + std::to_string(other.value());
      for (const auto& [what, count] : worker->totals().refused) waits += "; " + what + " x" + std::to_string(count);
      std::printf("region %u: tick %lu, map %lu, announced %lu%s, %zu away, waits for%s\n", id.value(),
                  static_cast<unsigned long>(region.tick().value()),
                  static_cast<unsigned long>(region.map().version().value()),
                  static_cast<unsigned long>(region.announced().value()), region.committed() ? " (committed)" : "",
                  region.away_count(), waits.c_str());
    }
  }
  void ExpectAllAtHome() {
    for (const auto& [id, worker] : simulation->workers()) EXPECT_EQ(worker->region().away_count(), 0U) << id;
  }

  std::shared_ptr<const Scene> scene;
  std::unique_ptr<Control> control;
  std::unique_ptr<Simulation> simulation;
};

// Balls that fly about between walls.
SceneBuilder Swarm(int balls) {
  SceneBuilder builder(kHalf);
  for (const double side : {-1.0, 1.0}) {
    for (const bool along : {false, true}) {
      BodyDef& wall = builder.Add(MakeShape(BoxShape{along ? Vec3d{1, 3, kHalf} : Vec3d{kHalf, 3, 1}}),
                                  along ? Vec3d{side * kHalf, 0, 0} : Vec3d{0, 0, side * kHalf});
      wall.motion = Motion::kStatic;
      wall.mass_kg = 0;
    }
  }
  for (int i = 0; i < balls; ++i) {
    BodyDef& ball = builder.Add(Ball(0.3), {-17.0 + i % 18 * 2, 0, -17.0 + i / 18 * 2},
                                {static_cast<float>(5 - i % 11), 0, static_cast<float>(i % 7 - 3)});
    ball.material.restitution = 1;
    ball.material.friction = 0;
    ball.may_sleep = false;
  }
  return builder;
}

TEST(GrowthTest, ASwarmIsKeptWholeFromTwoRegionsToFourAndBack) {
  Instance instance(Swarm(200), 2);
  instance.simulation->RunTo(Tick(30));
  instance.ScaleTo(4);
  instance.ExpectAllAtHome();
  instance.simulation->RunFor(Milliseconds(500));
  instance.ScaleTo(2);
  instance.simulation->RunFor(Milliseconds(500));
  instance.simulation->Settle();
  EXPECT_THAT(instance.simulation->problems(), IsEmpty());
  EXPECT_EQ(instance.simulation->States().size(), 200U);
  EXPECT_EQ(instance.control->totals().planned, 4U);
}

TEST(GrowthTest, EveryNumberOfRegionsLeadsToEveryOther) {
  Instance instance(Swarm(60), 1);
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
    Instance instance(Swarm(80), 2, {.seed = seed, .weather = {.loss = 0.05, .jitter = 6000}});
    instance.simulation->RunTo(Tick(30));
    instance.ScaleTo(4);
    instance.ScaleTo(2);
    instance.simulation->Settle();
    EXPECT_THAT(instance.simulation->problems(), IsEmpty());
    EXPECT_EQ(instance.simulation->States().size(), 80U);
  }
}

TEST(GrowthTest, AMapThatNotEveryoneCouldHearOfInTimeComesIntoForceNowhere) {
  const SceneBuilder builder = Swarm(20);
  const std::shared_ptr<const Scene> scene = builder.Build();
  const PartitionMap map = *MakeGridMap(scene->ground(), 4);
  std::unique_ptr<Control> control;
  Simulation simulation(scene, map, {.attach = [&](Simulation& s) {
                          control = std::make_unique<Control>(s, map, ControlOptions{.lead_ticks = 2});
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
