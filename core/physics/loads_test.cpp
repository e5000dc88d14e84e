// Loads propagated through a pile equal the weight above, and islands get substeps by what they bear.
#include "core/physics/loads.h"

#include <gmock/gmock.h>

#include "core/physics/load_propagation.h"
#include "core/physics/testing/loose_bodies.h"

namespace tessera::physics {
namespace {

// --- Propagation

std::vector<BodyWeight> Weights(std::initializer_list<double> masses_kg) {
  std::vector<BodyWeight> weights;
  for (const double mass : masses_kg) {
    const std::size_t i = weights.size();
    weights.push_back({BodyId(i + 1), false, mass, mass, mass, static_cast<double>(i)});
  }
  return weights;
}

TEST(LoadPropagationTest, DownAStackIsTheWeightAbove) {
  std::vector<BodyWeight> weights = Weights({4, 2, 8, 1});  // from the ground up
  const std::vector<Support> supports = {{0, kAsleep}, {1, 0}, {2, 1}, {3, 2}};
  LoadPropagation propagation;
  propagation.Run(supports, weights);
  EXPECT_EQ(weights[3].supported_kg, 1);
  EXPECT_EQ(weights[2].supported_kg, 9);
  EXPECT_EQ(weights[1].supported_kg, 11);
  EXPECT_EQ(weights[0].supported_kg, 15);
}

// A body that stands on one body alone counts twice, as it can lean.
TEST(LoadPropagationTest, ALoadIsInWeightsOfTheLighterOfTheTwo) {
  std::vector<BodyWeight> weights = Weights({4, 2, 8});
  const std::vector<Support> supports = {{0, kAsleep}, {1, 0}, {2, 1}};
  LoadPropagation propagation;
  const std::span<const PropagatedLoad> loads = propagation.Run(supports, weights);
  ASSERT_EQ(loads.size(), 3U);
  EXPECT_EQ(loads[0].body, 2U);
  EXPECT_EQ(loads[0].load_ratio, 2 * 8.0f / 2);   // 8 kg press on 2 kg
  EXPECT_EQ(loads[1].load_ratio, 2 * 10.0f / 2);  // 10 kg press on 4 kg through a body of 2 kg
  EXPECT_EQ(loads[2].load_ratio, 2 * 14.0f / 4);  // all on the ground
}

TEST(LoadPropagationTest, ABodyOnSeveralSharesItsWeightEqually) {
  std::vector<BodyWeight> weights = Weights({1, 1, 1, 6});
  for (int i = 0; i < 3; ++i) weights[static_cast<std::size_t>(i)].height_m = 0;
  const std::vector<Support> supports = {{0, kAsleep}, {1, kAsleep}, {2, kAsleep}, {3, 0}, {3, 1}, {3, 2}};
  LoadPropagation propagation;
  const std::span<const PropagatedLoad> loads = propagation.Run(supports, weights);
  EXPECT_EQ(weights[0].supported_kg, 3);
  EXPECT_EQ(weights[1].supported_kg, 3);
  EXPECT_EQ(weights[2].supported_kg, 3);
  EXPECT_EQ(loads[0].load_ratio, 2);  // 2 kg press on each of 1 kg, and nothing leans
}

TEST(LoadPropagationTest, AKnownMassReplacesTheWeightThatIsSeen) {
  std::vector<BodyWeight> weights = Weights({1, 1});
  weights[1].externally_supported = true;
  const std::vector<Support> supports = {{0, kAsleep}, {1, 0, 1, 30}};
  LoadPropagation propagation;
  const std::span<const PropagatedLoad> loads = propagation.Run(supports, weights);
  EXPECT_EQ(weights[0].supported_kg, 31);
  EXPECT_EQ(loads[0].load_ratio, 30);  // It rests on more than is seen, so it does not lean.
}

// --- The pass

// A tower of unit cubes of 1 kg that has just been built, 60 steps a second.
class TowerTest : public ::testing::Test {
 protected:
  void Build(std::uint64_t cubes) {
    loose_.Add(Static(1, Ground()));
    for (std::uint64_t i = 0; i < cubes; ++i) {
      loose_.Add(Dynamic(2 + i, Cube(), {0, static_cast<double>(i) + 0.5, 0}));
      contacts_.push_back(i == 0 ? ContactBetween(kAsleep, 0) : ContactBetween(Index(i - 1), Index(i)));
    }
  }
  static std::uint32_t Index(std::uint64_t i) { return static_cast<std::uint32_t>(i); }
  const IslandPlan& Run(Loads& loads) {
    BuildIslands(loose_.bodies.awake().size(), contacts_, {}, &islands_);
    loads.Run({kDt, loose_.bodies.awake(), contacts_, {}, {}, islands_, groups_});
    EXPECT_TRUE(loads.Validate());
    EXPECT_EQ(loads.plans().size(), islands_.count());
    return loads.plans().front();
  }

  static constexpr Vec3d kTen{0, -10, 0};
  LooseBodies loose_;
  std::vector<ActiveContact> contacts_;
  Islands islands_;
  JointedGroups groups_;
};

TEST_F(TowerTest, LoadsItsFootWithAllThatStandsOnItInItsFirstStep) {
  Build(20);
  Loads loads(kTen, 0);
  const IslandPlan plan = Run(loads);
  EXPECT_TRUE(plan.solved);
  EXPECT_FALSE(plan.unanchored);
  EXPECT_NEAR(plan.load, 2 * 20, 1e-4);  // It stands on one body alone at each height, so all counts twice.
  EXPECT_EQ(plan.substeps, 16);
  for (const RigidBody* body : loose_.bodies.awake()) EXPECT_EQ(body->load.substeps, 16);
}

TEST_F(TowerTest, LoadsArePulledAsHardAsGravityPulls) {
  Build(20);
  Loads half({0, -5, 0}, 0);
  EXPECT_NEAR(Run(half).load, 20, 1e-4);
}

TEST_F(TowerTest, ANewLoadCountsAsAMeanOverTenSteps) {
  Build(10);
  Loads loads(kTen, 0);
  EXPECT_NEAR(Run(loads).load, 20, 1e-4);
  for (RigidBody* body : loose_.bodies.awake()) body->load.propagated = 20;
  contacts_.pop_back();  // the uppermost cube is lifted off
  double expected = 20;
  for (int i = 0; i < 5; ++i) {
    expected += (18 - expected) / 10;
    EXPECT_NEAR(Run(loads).load, expected, 1e-4);
  }
}

// A load that comes down upon a pile counts from its second step on.
TEST_F(TowerTest, TheLesserLoadOfTwoStepsCounts) {
  Build(10);
  Loads loads(kTen, 0);
  for (RigidBody* body : loose_.bodies.awake()) body->load = {4, 2, 4};
  EXPECT_NEAR(Run(loads).load, 4, 1e-4);
  EXPECT_NEAR(Run(loads).load, 4 + (20 - 4) / 10.0, 1e-4);
}

TEST_F(TowerTest, TheLoadOutsideTheWorldCountsForSubstepsAlone) {
  Build(2);
  loose_.bodies.At(BodyId(3)).support.island_load = 100;
  Loads loads(kTen, 0);
  const IslandPlan plan = Run(loads);
  EXPECT_LT(plan.load, 5);
  EXPECT_EQ(plan.substeps, 64);
}

TEST_F(TowerTest, SubstepsThatAreGivenAreTaken) {
  Build(20);
  Loads loads(kTen, 3);
  EXPECT_EQ(Run(loads).substeps, 3);
}

TEST_F(TowerTest, BodiesWithoutContactsAreNotSolvedAndForgetTheirLoads) {
  Build(3);
  contacts_.clear();
  for (RigidBody* body : loose_.bodies.awake()) body->load = {4, 2, 4};
  Loads loads(kTen, 0);
  EXPECT_FALSE(Run(loads).solved);
  for (const RigidBody* body : loose_.bodies.awake()) {
    EXPECT_EQ(body->load.substeps, 0);
    EXPECT_EQ(body->load.propagated, 0);
    EXPECT_EQ(body->load.island_load, kUnknownLoad);
  }
}

TEST_F(TowerTest, AContactThatCannotPushInThisStepNeedsNoSolve) {
  Build(2);
  for (ActiveContact& contact : contacts_) contact.live = false;
  Loads loads(kTen, 0);
  EXPECT_FALSE(Run(loads).solved);
}

TEST_F(TowerTest, AnIslandThatTouchesNothingFixedIsUnanchored) {
  Build(3);
  contacts_.erase(contacts_.begin());
  Loads loads(kTen, 0);
  EXPECT_TRUE(Run(loads).unanchored);
}

}  // namespace
}  // namespace tessera::physics
