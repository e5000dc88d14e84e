// Borders that close and open again, and borders that nobody is near.
#include <gmock/gmock.h>

#include "core/region/testing/kept_bodies.h"
#include "tests/simulation/scene_builder.h"
#include "tests/simulation/simulation.h"

namespace tessera::simulation {
namespace {

using ::testing::IsEmpty;

constexpr double kHalfSide = 20;
constexpr RegionId kFirst{1}, kSecond{2};

Simulation Make(const SceneBuilder& builder, std::uint32_t regions) {
  const std::shared_ptr<const Scene> scene = builder.Build();
  return Simulation(scene, *MakeGridMap(scene->ground(), regions), {});
}

std::uint64_t FramesOf(Simulation& simulation) {
  std::uint64_t frames = 0;
  for (const auto& [id, worker] : simulation.workers()) frames += worker->totals().frames;
  return frames;
}

// Balls that fly about near the border.
SceneBuilder Balls() {
  SceneBuilder builder(kHalfSide);
  for (int i = 0; i < 12; ++i) {
    builder.Add(Ball(0.4), {i % 2 == 0 ? -1.5 : 1.5, 0, -16.0 + 3 * i}, {i % 2 == 0 ? 0.5F : -0.5F, 0, 0}).may_sleep =
        false;
  }
  return builder;
}

TEST(ClosingTest, ASilentBorderClosesAndTheRestGoesOnAndItOpensAgain) {
  Simulation simulation = Make(Balls(), 4);
  simulation.RunTo(Tick(30));
  simulation.CutBetween(kFirst, kSecond, Milliseconds(1000));
  simulation.RunFor(Milliseconds(600));
  EXPECT_FALSE(simulation.worker(1).region().IsLinkUp(kSecond));
  EXPECT_FALSE(simulation.worker(2).region().IsLinkUp(kFirst));
  EXPECT_TRUE(simulation.worker(1).region().IsLinkUp(RegionId(3)));
  const Tick then = simulation.tick();
  simulation.RunFor(Milliseconds(300));
  EXPECT_GE(simulation.tick() - then, 15);
  simulation.RunFor(Milliseconds(200));
  simulation.Settle();
  EXPECT_TRUE(simulation.worker(1).region().IsLinkUp(kSecond));
  EXPECT_THAT(simulation.problems(), IsEmpty());
}

TEST(ClosingTest, AWorkerThatStoodStillAdoptsTheLaterTickAndItsBodiesWentNowhere) {
  Simulation simulation = Make(Balls(), 2);
  simulation.RunTo(Tick(30));
  simulation.Stall(kSecond, Milliseconds(2000));
  simulation.RunFor(Milliseconds(1900));
  const Tick stood = simulation.worker(2).region().tick();
  EXPECT_GE(simulation.worker(1).region().tick() - stood, 80);
  const BodyState before = simulation.worker(2).region().owned().front().state;
  simulation.Settle();
  EXPECT_EQ(simulation.worker(2).region().tick(), simulation.worker(1).region().tick());
  const BodyState after = simulation.States().at(simulation.worker(2).region().owned().front().def->id);
  EXPECT_LT(Length(after.position - before.position), 1.5);  // a second or so at its half metre a second
  EXPECT_THAT(simulation.problems(), IsEmpty());
}

TEST(ClosingTest, ABodyThatIsBeingHandedOverWhenTheBorderClosesIsNeitherLostNorDoubled) {
  for (std::uint64_t when = 20; when < 60; when += 2) {
    SceneBuilder builder(kHalfSide);
    for (int i = 0; i < 4; ++i) {
      builder.Add(Ball(0.4), {-1.0 - 0.4 * i, 0, -8.0 + 4 * i}, {3, 0, 0}).may_sleep = false;
    }
    builder.Add(Box(0.3), {-2, 0, 12}, {3, 0, 0});
    builder.Add(Box(0.3), {-1, 0, 12}, {3, 0, 0});
    builder.Tie(BodyId(5), BodyId(6), {0.5, 0, 0}, {-0.5, 0, 0});
    Simulation simulation = Make(builder, 2);
    simulation.RunTo(Tick(when));
    simulation.CutBetween(kFirst, kSecond, Milliseconds(700));
    simulation.RunFor(Milliseconds(1500));
    simulation.Settle();
    EXPECT_THAT(simulation.problems(), IsEmpty()) << "cut at tick " << when;
    EXPECT_EQ(simulation.totals().handovers, 6U) << "cut at tick " << when;
    for (const auto& [id, state] : simulation.States()) {
      EXPECT_NEAR(state.linear_velocity.x, 3, 0.01) << "body " << id << ", cut at tick " << when;
    }
    for (auto& [id, worker] : simulation.workers()) EXPECT_TRUE(region::KeptBodies(worker->region()).empty());
  }
}

TEST(QuietBorderTest, CostsAFrameInNineTicks) {
  SceneBuilder builder(kHalfSide);
  builder.Gravity().Floor();
  for (int i = 0; i < 8; ++i) builder.Add(Box(0.4), {i % 2 == 0 ? -0.5 : 0.5, 0.4, -14.0 + 4 * i});
  Simulation simulation = Make(builder, 2);
  simulation.RunTo(Tick(200));
  ASSERT_EQ(simulation.worker(1).region().asleep_count() + simulation.worker(2).region().asleep_count(), 8U);
  const std::uint64_t before = FramesOf(simulation);
  simulation.RunTo(Tick(290));
  EXPECT_LE(FramesOf(simulation) - before, 2 * 11U);
  EXPECT_THAT(simulation.problems(), IsEmpty());
}

TEST(QuietBorderTest, WaitsForNobody) {
  SceneBuilder builder(kHalfSide);
  builder.Add(Ball(0.5), {-12, 0, 0}, {0, 0, 1}).may_sleep = false;
  builder.Add(Ball(0.5), {12, 0, 0}, {0, 0, 1}).may_sleep = false;
  Simulation simulation = Make(builder, 2);
  simulation.RunTo(Tick(45));  // right after both have promised
  const Tick before = simulation.worker(1).region().tick();
  simulation.Stall(kSecond, Milliseconds(80));
  simulation.RunFor(Milliseconds(84));
  EXPECT_GE(simulation.worker(1).region().tick() - before, 4);
  EXPECT_THAT(simulation.problems(), IsEmpty());
}

}  // namespace
}  // namespace tessera::simulation
