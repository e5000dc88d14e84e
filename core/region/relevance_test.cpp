#include "core/region/relevance.h"

#include <gtest/gtest.h>

#include <cmath>
#include <optional>

#include "core/region/testing/small_world.h"

namespace tessera::region {
namespace {

// Region 1 has the cells of x < 0 and one neighbour, region 2. Balls of half a metre; an aura of 1 m; predictions
// reach 4 ticks of 1/60 s ahead.
class RelevanceTest : public ::testing::Test {
 protected:
  void Make(Scene scene, RegionSettings settings = {.aura_m = 1, .ghost_depth = 1, .whole_up_to = 0}) {
    world.emplace(std::move(scene));
    relevance.emplace(world->catalog, settings, SmallWorld::kTick_s);
  }
  // As after a first step: before it, a few bodies are all relevant.
  void Update() {
    world->Step();
    UpdateOnly();
  }
  void UpdateOnly() {
    const std::vector<physics::Forces> forces(world->bodies.owned().size());
    const std::vector<std::span<const GhostRecord>> sent = {sent_before};
    relevance->Update({world->bodies, world->neighborhood, forces, departing, sent});
    relevance->Validate(world->bodies);
  }
  bool Relevant(std::size_t index) const { return relevance->table().To(index, 0); }
  bool RelevantAt(double x, float speed, bool asleep = false) {
    Make(Balls({{x, 0, 0}}));
    BodyState state = world->InitialOf(1);
    state.asleep = asleep;
    if (!asleep) state.position.x -= speed * SmallWorld::kTick_s;  // there after the step
    state.linear_velocity = {asleep ? 0 : speed, 0, 0};
    world->Own(1, state);
    Update();
    return Relevant(0);
  }

  std::optional<SmallWorld> world;
  std::optional<Relevance> relevance;
  std::vector<DepartingBody> departing;
  std::vector<GhostRecord> sent_before;
};

// A ball's radius is bounded by the half diagonal of the cube around it.
const double kReach_m = 0.5 * std::sqrt(3) + 1;

TEST_F(RelevanceTest, ABodyIsRelevantFromItsRadiusAndTheAuraOn) {
  EXPECT_FALSE(RelevantAt(-kReach_m - 0.1, 0));
  EXPECT_TRUE(RelevantAt(-kReach_m + 0.1, 0));
  EXPECT_TRUE(RelevantAt(1, 0));  // beyond the border, not handed over yet
}

TEST_F(RelevanceTest, SpeedReachesAheadAndOnlyForward) {
  EXPECT_TRUE(RelevantAt(-kReach_m - 30 * 4.0 / 60 + 0.1, 30));
  EXPECT_FALSE(RelevantAt(-kReach_m - 30 * 4.0 / 60 - 0.1, 30));
  EXPECT_FALSE(RelevantAt(-kReach_m - 0.1, -30));
}

TEST_F(RelevanceTest, ASleeperReachesNoFurtherThanItLies) { EXPECT_FALSE(RelevantAt(-kReach_m - 0.1, 30, true)); }

TEST_F(RelevanceTest, ABodyNearAnothersIsRelevantToItsOwnerWhereverItIs) {
  Make(Balls({{-5, 0, 0}, {-5, 0, 1.05}, {-8, 0, 0}}));
  world->Own(1);
  world->Own(3);
  world->AddGhost(2, 2);
  Update();
  EXPECT_TRUE(Relevant(0));
  EXPECT_FALSE(Relevant(1));
}

TEST_F(RelevanceTest, ABodyNearADepartingOneIsRelevantToItsNewOwner) {
  Make(Balls({{-5, 0, 0}, {-5, 0, 1.05}, {-8, 0, 0}}));
  for (const std::uint64_t id : {1, 2, 3}) world->Own(id);
  departing.push_back({{}, RegionId(2)});
  departing[0].record.id = BodyId(2);
  Update();
  EXPECT_TRUE(Relevant(0));
  EXPECT_FALSE(Relevant(2));
}

// A row of balls that touch each other, the first at the border.
Scene Row() {
  Scene scene = Balls({{-0.6, 0, 0}, {-1.6, 0, 0}, {-2.6, 0, 0}, {-3.6, 0, 0}});
  for (BodyDef& def : scene.bodies) def.may_sleep = false;
  return scene;
}

TEST_F(RelevanceTest, WhatMovesIsRelevantWithSoManyLayersBehindIt) {
  Make(Row(), {.aura_m = 0.1, .ghost_depth = 2, .whole_up_to = 0});
  for (const std::uint64_t id : {1, 2, 3, 4}) world->Own(id);
  Update();
  EXPECT_TRUE(Relevant(0) && Relevant(1) && Relevant(2));
  EXPECT_FALSE(Relevant(3));
}

TEST_F(RelevanceTest, WhatIsSettledIsHeldByItsLoadsAlone) {
  Make(Row(), {.aura_m = 0.1, .ghost_depth = 2, .whole_up_to = 0});
  for (const std::uint64_t id : {1, 2, 3, 4}) world->Own(id);
  for (int i = 0; i < kSettledTicks; ++i) {
    EXPECT_FALSE(i > 0 && relevance->IsSettled(0, world->bodies.owned()[0])) << i;
    Update();
  }
  EXPECT_TRUE(relevance->IsSettled(0, world->bodies.owned()[0]));
  Update();
  EXPECT_TRUE(Relevant(0));
  EXPECT_FALSE(Relevant(1));
}

TEST_F(RelevanceTest, ASleeperStaysWithWhoeverSawItFallAsleep) {
  Make(Balls({{-5, 0, 0}, {-8, 0, 0}}));
  BodyState asleep = world->InitialOf(1);
  asleep.asleep = true;
  world->Own(1, asleep);
  world->Own(2);
  sent_before.resize(2);
  sent_before[0].id = BodyId(1);
  sent_before[0].state.asleep = true;
  sent_before[1].id = BodyId(2);
  Update();
  EXPECT_TRUE(Relevant(0));
  EXPECT_FALSE(Relevant(1));
}

TEST_F(RelevanceTest, AnAssemblyIsRelevantAsAWhole) {
  Scene scene = Balls({{-0.6, 0, 0}, {-5, 0, 0}, {-8, 0, 0}});
  Join(scene, 1, 2);
  Make(std::move(scene));
  for (const std::uint64_t id : {1, 2, 3}) world->Own(id);
  world->bodies.NotePlaces();
  // Before the first step, too few bodies to choose from are all relevant.
  UpdateOnly();
  EXPECT_TRUE(Relevant(2));
  world->Step();
  UpdateOnly();
  EXPECT_TRUE(Relevant(1));
}

TEST_F(RelevanceTest, WithoutNeighboursNothingIsRelevant) {
  world.emplace(Balls({{-0.6, 0, 0}}), 1);
  relevance.emplace(world->catalog, RegionSettings(), SmallWorld::kTick_s);
  world->Own(1);
  relevance->Update({world->bodies, world->neighborhood, {}, {}, {}});
  EXPECT_FALSE(relevance->table().Any());
}

}  // namespace
}  // namespace tessera::region
