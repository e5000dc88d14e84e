// A region dies and the world goes on.
#include <gmock/gmock.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>

#include "core/region/testing/kept_bodies.h"
#include "tests/simulation/instance.h"

namespace tessera::simulation {
namespace {

using ::testing::IsEmpty;

constexpr double kHalf = 20;  // half the ground's side, m

TEST(FailoverTest, TheStandbyCarriesTheAreaOn) {
  Instance instance(Swarm(kHalf, 120), 4);
  instance.simulation->RunTo(Tick(60));
  const std::size_t owned = instance.simulation->worker(2).region().owned().size();
  instance.simulation->Kill(RegionId(2));
  instance.ExpectWhole(120);
  EXPECT_EQ(instance.control->totals().failovers, 1U);
  EXPECT_GE(instance.control->totals().adopted + 10, owned);
  EXPECT_EQ(instance.simulation->worker(3).region().map().OwnerOf({10, 0, -10}), RegionId(3));
  std::printf("age %ld ticks, gap %lu us, %lu adopted, %lu promoted, %lu pending\n",
              static_cast<long>(instance.control->totals().max_age_ticks),
              static_cast<unsigned long>(instance.control->totals().max_gap),
              static_cast<unsigned long>(instance.control->totals().adopted),
              static_cast<unsigned long>(instance.control->totals().from_grant),
              static_cast<unsigned long>(instance.control->totals().pending));
}

TEST(FailoverTest, APileThatIsPromotedHardlySags) {
  SceneBuilder builder(kHalf);
  builder.Gravity().Floor(0.6);
  for (int row = 0; row < 8; ++row) {
    for (int i = 0; i < 8 - row; ++i) {
      builder.Add(Box(0.5), {6 + i + 0.5 * row, 0.5 + row, -10}).may_sleep = false;
    }
  }
  Instance instance(builder, 4);
  Simulation& simulation = *instance.simulation;
  simulation.RunTo(Tick(600));
  const std::map<BodyId, BodyState> before = simulation.States();
  ASSERT_EQ(simulation.OwnerOf(before.begin()->first), RegionId(2));
  simulation.Kill(RegionId(2));
  instance.ExpectWhole(36);
  double furthest = 0;
  for (const auto& [id, state] : simulation.States()) {
    EXPECT_NE(simulation.OwnerOf(id), RegionId(2));
    furthest = std::max(furthest, Length(state.position - before.at(id).position));
  }
  std::printf("a pile through a failover: furthest moved %.2e m\n", furthest);
  EXPECT_LT(furthest, 3e-4);
}

TEST(FailoverTest, EachRegionMayDieInTurnUntilOneIsLeft) {
  Instance instance(Swarm(kHalf, 120), 4);
  for (const std::uint32_t region : {3U, 1U, 4U}) {
    instance.simulation->RunFor(Milliseconds(700));
    instance.simulation->Kill(RegionId(region));
    instance.ExpectWhole(120);
  }
  EXPECT_EQ(instance.control->totals().failovers, 3U);
  EXPECT_EQ(instance.simulation->workers().size(), 1U);
}

TEST(FailoverTest, ADeathAtAnyTickAroundAHandoverLosesNothing) {
  // A ball crosses from region 1 to region 2 about tick 22. Either dies at each tick around that, with its standby's
  // news held back or not.
  std::uint64_t adopted = 0, from_grant = 0, pending = 0;
  for (std::uint64_t tick = 18; tick <= 32; ++tick) {
    for (const std::uint32_t victim : {1U, 2U}) {
      for (const std::uint64_t held_ticks : {0U, 1U, 2U}) {
        SceneBuilder builder(kHalf);
        builder.Add(Ball(0.5), {-2, 1, -10}, {6, 0, 0});
        Instance instance(builder, 4, {.seed = tick});
        instance.simulation->RunTo(Tick(tick - held_ticks));
        instance.control->HoldLog(RegionId(victim), held_ticks > 0);
        instance.simulation->RunTo(Tick(tick));
        instance.simulation->Kill(RegionId(victim));
        instance.simulation->RunFor(Milliseconds(400));
        EXPECT_THAT(instance.simulation->problems(), IsEmpty()) << victim << " at " << tick << ", held " << held_ticks;
        ASSERT_EQ(instance.simulation->States().size(), 1U) << victim << " at " << tick << ", held " << held_ticks;
        adopted += instance.control->totals().adopted;
        from_grant += instance.control->totals().from_grant;
        pending += instance.control->totals().pending;
      }
    }
  }
  std::printf("of 90 deaths around one handover: %lu adopted, %lu promoted, %lu kept for the next death\n",
              static_cast<unsigned long>(adopted), static_cast<unsigned long>(from_grant),
              static_cast<unsigned long>(pending));
  EXPECT_GT(adopted, 0U);
  EXPECT_GT(from_grant, 0U);
}

// A body that was granted away and came back, before its first granter heard the first acknowledgement, is its owner's,
// and the grant that was never confirmed is forgotten.
TEST(FailoverTest, AGrantOfABodyThatCameBackIsKeptNoMore) {
  SceneBuilder builder(kHalf);
  BodyDef& wall = builder.Add(MakeShape(BoxShape{{0.5, 3, 3}}), {-2.5, 1, -10});
  wall.motion = Motion::kStatic;
  wall.mass_kg = 0;
  wall.material.restitution = 1;
  BodyDef& ball = builder.Add(Ball(0.5), {2, 1, -10}, {-12, 0, 0});
  ball.material.restitution = 1;
  const BodyId id = ball.id;
  Instance instance(builder, 4);
  Simulation& simulation = *instance.simulation;
  simulation.RunTo(Tick(4));
  instance.control->HoldLog(RegionId(1), true);  // it confirms nothing
  for (int i = 0; i < 200 && simulation.totals().handovers < 2; ++i) simulation.RunFor(Milliseconds(5));
  simulation.RunFor(Milliseconds(40));
  ASSERT_EQ(simulation.OwnerOf(id), RegionId(2));
  EXPECT_THAT(region::KeptBodies(simulation.worker(2).region()), IsEmpty());
  simulation.Kill(RegionId(4));
  simulation.RunFor(Milliseconds(200));
  EXPECT_EQ(instance.control->totals().failovers, 1U);
  EXPECT_EQ(simulation.OwnerOf(id), RegionId(2));
  EXPECT_THAT(simulation.problems(), IsEmpty());
}

// Its death was declared, and yet it speaks: a worker that was cut off.
TEST(FailoverTest, AFencedRegionsFramesAreRefusedAndStopNobody) {
  Instance instance(Swarm(kHalf, 40), 4);
  Simulation& simulation = *instance.simulation;
  simulation.RunTo(Tick(30));
  const region::Config config{
      RegionId(2), Incarnation(1), instance.scene, *MakeGridMap(instance.scene->ground(), 4), {}};
  region::Region fenced(config);
  simulation.Kill(RegionId(2));
  simulation.RunFor(Milliseconds(200));
  ASSERT_EQ(instance.control->totals().failovers, 1U);
  for (const region::OutgoingFrame& frame : fenced.Start()) {
    const absl::Status status = simulation.worker(frame.to.value()).region().Receive(RegionId(2), frame.bytes);
    EXPECT_FALSE(status.ok()) << frame.to;
  }
  instance.ExpectWhole(40);
}

TEST(FailoverTest, TwoOfACornerOfFourDieTogether) {
  for (const auto& [a, b] : {std::pair(1U, 3U), std::pair(2U, 4U)}) {  // neither is the other's standby
    Instance instance(Swarm(kHalf, 120), 4);
    instance.simulation->RunTo(Tick(60));
    instance.simulation->Kill(RegionId(a));
    instance.simulation->Kill(RegionId(b));
    instance.ExpectWhole(120);
    EXPECT_EQ(instance.control->totals().without_copy, 0U);
  }
}

TEST(FailoverTest, ASecondDeathDuringAFailoverStartsItOver) {
  Instance instance(Swarm(kHalf, 120), 6);
  instance.simulation->RunTo(Tick(60));
  instance.simulation->Kill(RegionId(2));  // its standby is 3
  instance.simulation->RunFor(4000);
  ASSERT_TRUE(instance.control->failing_over());
  instance.simulation->Kill(RegionId(5));
  instance.ExpectWhole(120);
}

TEST(FailoverTest, WhenTheStandbyDiesDuringTheTakeoverTheLossIsToldAndTheRestGoesOn) {
  Instance instance(Swarm(kHalf, 120), 4);
  instance.simulation->RunTo(Tick(60));
  const std::size_t owned = instance.simulation->worker(2).region().owned().size();
  instance.simulation->Kill(RegionId(2));
  instance.simulation->RunFor(4000);
  ASSERT_TRUE(instance.control->failing_over());
  instance.simulation->Kill(RegionId(3));
  instance.simulation->RunFor(Milliseconds(800));
  EXPECT_THAT(instance.simulation->problems(), IsEmpty());
  EXPECT_EQ(instance.control->totals().without_copy, 1U);
  EXPECT_GT(instance.control->totals().lost, 0U);
  EXPECT_LE(instance.control->totals().lost, owned);
  EXPECT_EQ(instance.simulation->States().size() + instance.control->totals().lost, 120U);
}

TEST(FailoverTest, RegionAndStandbyLostTogetherAreToldAsALoss) {
  Instance instance(Swarm(kHalf, 120), 4);
  instance.simulation->RunTo(Tick(60));
  instance.simulation->Kill(RegionId(2));
  instance.simulation->Kill(RegionId(3));
  instance.simulation->RunFor(Milliseconds(800));
  EXPECT_THAT(instance.simulation->problems(), IsEmpty());
  EXPECT_EQ(instance.control->totals().without_copy, 1U);
  EXPECT_GT(instance.control->totals().lost, 0U);
}

TEST(FailoverTest, PlayersThatCameOrLeftInTheLastTicksAreNeitherLostNorMadeTwice) {
  for (std::uint64_t after = 0; after < 6; ++after) {
    SceneBuilder builder = Swarm(kHalf, 40);
    PlayerRules& rules = builder.scene().player.emplace();
    rules.body.shape = Ball(0.4);
    rules.spawn_points = {{10, 1, -10}};
    rules.max_force_n = 10;
    rules.max_speed_m_s = 5;
    Instance instance(builder, 4);
    Simulation& simulation = *instance.simulation;
    simulation.RunTo(Tick(40));
    simulation.SpawnPlayer(PlayerNumber(1), RegionId(2));
    simulation.RunTo(Tick(50));
    simulation.RemovePlayer(PlayerNumber(1));
    simulation.SpawnPlayer(PlayerNumber(2), RegionId(2));
    simulation.RunTo(Tick(50 + after));
    simulation.Kill(RegionId(2));
    simulation.RunFor(Milliseconds(200));
    // The control plane tells the standby of the one that may not have been made.
    for (auto& [id, worker] : simulation.workers()) worker->region().RemovePlayer(PlayerNumber(1));
    simulation.worker(3).region().SpawnPlayer(PlayerNumber(2));
    simulation.RunFor(Milliseconds(300));
    EXPECT_THAT(simulation.problems(), IsEmpty()) << "after " << after;
    EXPECT_EQ(simulation.OwnerOf(PlayerBodyId(PlayerNumber(1))), RegionId());
    EXPECT_NE(simulation.OwnerOf(PlayerBodyId(PlayerNumber(2))), RegionId());
    EXPECT_EQ(simulation.States().size(), 41U);
  }
}

// Deaths at random times of random regions, one after the other as soon as all are protected again.
struct Deaths {
  std::uint64_t deaths = 0, from_grant = 0, adopted = 0, pending = 0;
  std::int64_t max_age_ticks = 0;
};

Deaths RandomDeaths(std::uint64_t seed) {
  Chance chance(seed);
  Instance instance(
      Swarm(kHalf, 70), 6,
      {.seed = seed, .conditions = {.loss = static_cast<double>(seed % 3) * 0.01, .jitter = seed % 4 * 1000}});
  Simulation& simulation = *instance.simulation;
  const auto protected_all = [&] {
    return std::all_of(simulation.workers().begin(), simulation.workers().end(), [&](const auto& entry) {
      return entry.second->region().acknowledged() > Tick() && !instance.control->failing_over();
    });
  };
  Deaths sum;
  while (simulation.workers().size() > 1) {
    for (int i = 0; i < 40 && !protected_all(); ++i) simulation.RunFor(Milliseconds(50));
    EXPECT_TRUE(protected_all()) << "seed " << seed;
    simulation.RunFor(Milliseconds(50) + chance.Below(300'000));
    auto victim = simulation.workers().begin();
    std::advance(victim, static_cast<std::ptrdiff_t>(chance.Below(simulation.workers().size())));
    simulation.Kill(victim->first);
    ++sum.deaths;
    for (int i = 0; i < 40 && instance.control->failing_over(); ++i) simulation.RunFor(Milliseconds(50));
    EXPECT_FALSE(instance.control->failing_over()) << "seed " << seed;
    EXPECT_THAT(simulation.problems(), IsEmpty()) << "seed " << seed;
    if (!simulation.problems().empty()) break;
  }
  simulation.RunFor(Milliseconds(100));
  EXPECT_EQ(simulation.States().size(), 70U) << "seed " << seed;
  const ControlTotals& totals = instance.control->totals();
  EXPECT_EQ(totals.lost, 0U) << "seed " << seed;
  sum.adopted = totals.adopted, sum.from_grant = totals.from_grant, sum.pending = totals.pending;
  sum.max_age_ticks = totals.max_age_ticks;
  return sum;
}

TEST(FailoverTest, RandomDeathsLoseAndDoubleNothing) {
  const char* const wanted = std::getenv("TESSERA_DEATH_SEEDS");  // more than the tests have time for
  const std::uint64_t seeds = wanted == nullptr ? 6 : std::strtoull(wanted, nullptr, 10);
  Deaths sum;
  for (std::uint64_t seed = 1; seed <= seeds && !HasFailure(); ++seed) {
    const Deaths one = RandomDeaths(seed);
    sum.deaths += one.deaths, sum.adopted += one.adopted, sum.from_grant += one.from_grant, sum.pending += one.pending;
    sum.max_age_ticks = std::max(sum.max_age_ticks, one.max_age_ticks);
  }
  std::printf("%lu deaths: %lu bodies adopted, %lu promoted, %lu kept for the next; oldest state %ld ticks\n",
              static_cast<unsigned long>(sum.deaths), static_cast<unsigned long>(sum.adopted),
              static_cast<unsigned long>(sum.from_grant), static_cast<unsigned long>(sum.pending),
              static_cast<long>(sum.max_age_ticks));
}

}  // namespace
}  // namespace tessera::simulation
