// Worlds that are paused and slowed down, and what may go wrong meanwhile.
#include <gmock/gmock.h>

#include <bit>
#include <limits>
#include <map>
#include <set>

#include "spdlog/spdlog.h"
#include "tests/simulation/deployment.h"
#include "tests/simulation/instance.h"

namespace tessera::simulation {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

class ClockTest : public testing::Test {
 protected:
  ClockTest() { spdlog::set_level(spdlog::level::off); }
};

bool IsState(const Deployment& deployment, v1::InstanceState state) { return deployment.instance().state() == state; }

bool AwaitState(Deployment& deployment, v1::InstanceState state) {
  return deployment.RunUntil(Milliseconds(20'000), [&] { return IsState(deployment, state); });
}

// The tick after which all regions stand; tick 0 if they do not stand after the same one.
Tick StandingTick(const Deployment& deployment) {
  std::set<Tick> ticks;
  for (const SimulatedWorker* worker : deployment.Workers()) {
    ticks.insert(worker->core().run()->clock().paused() ? worker->region()->tick() : Tick());
  }
  return ticks.size() == 1 ? *ticks.begin() : Tick();
}

std::uint64_t LinksDown(const Deployment& deployment) {
  std::uint64_t down = 0;
  for (const SimulatedWorker* worker : deployment.Workers()) down += worker->core().run()->ticks().links_down();
  return down;
}

TEST_F(ClockTest, APausedWorldStandsStillAfterTheSameTickEverywhereAndGoesOnFromThere) {
  Deployment deployment(Swarm(20, 60).Build(), {.checkpoint_interval = std::chrono::milliseconds(0)});
  ASSERT_TRUE(deployment.AwaitCalm()) << deployment.Standing();
  ASSERT_TRUE(deployment.Pause().ok());
  ASSERT_TRUE(deployment.Pause().ok()) << "a second one changes nothing";
  ASSERT_TRUE(AwaitState(deployment, v1::INSTANCE_STATE_PAUSED)) << deployment.Standing();
  const Tick tick = StandingTick(deployment);
  ASSERT_NE(tick, Tick());
  EXPECT_EQ(deployment.instance().ticks_per_second(), 0);
  deployment.RunFor(Milliseconds(10'000));
  EXPECT_EQ(StandingTick(deployment), tick);
  EXPECT_TRUE(IsState(deployment, v1::INSTANCE_STATE_PAUSED));
  EXPECT_EQ(deployment.instance().failovers(), 0u) << "nobody is declared dead because it does not step";
  for (const SimulatedWorker* worker : deployment.Workers()) EXPECT_TRUE(worker->Protected());

  ASSERT_TRUE(deployment.Pause(false).ok());
  ASSERT_TRUE(AwaitState(deployment, v1::INSTANCE_STATE_RUNNING));
  deployment.RunFor(Milliseconds(500));
  EXPECT_GT(deployment.tick(), tick + 20);
  EXPECT_EQ(LinksDown(deployment), 0u);
  deployment.Settle();
  EXPECT_THAT(deployment.problems(), IsEmpty());
}

TEST_F(ClockTest, APausedWorldOutlivesTheDeathsOfRegions) {
  Deployment deployment(Swarm(20, 60).Build(), {.hosts = 3, .regions = 4});
  ASSERT_TRUE(deployment.AwaitCalm()) << deployment.Standing();
  ASSERT_TRUE(deployment.Pause().ok());
  ASSERT_TRUE(AwaitState(deployment, v1::INSTANCE_STATE_PAUSED));
  for (std::uint32_t deaths = 1; deaths <= 2; ++deaths) {
    deployment.Kill(deployment.Workers().back()->identity().region);
    ASSERT_TRUE(deployment.RunUntil(Milliseconds(20'000), [&] {
      return deployment.instance().failovers() == deaths && IsState(deployment, v1::INSTANCE_STATE_PAUSED) &&
             deployment.instance().changes().empty() && deployment.instance().unprotected_regions().empty();
    })) << deployment.Standing();
    const Tick tick = StandingTick(deployment);
    EXPECT_NE(tick, Tick());
    deployment.RunFor(Milliseconds(2000));
    EXPECT_EQ(StandingTick(deployment), tick);
    for (const SimulatedWorker* worker : deployment.Workers()) {
      EXPECT_TRUE(worker->Protected()) << "the new standbys have copies, although nobody steps";
    }
  }
  ASSERT_TRUE(deployment.Pause(false).ok());
  deployment.Settle();
  EXPECT_THAT(deployment.problems(), IsEmpty());
  EXPECT_EQ(deployment.bodies(), 60u);
}

TEST_F(ClockTest, AWorldIsPausedThoughARegionDiesOnTheWay) {
  for (int step = 0; step < 6; ++step) {
    Deployment deployment(Swarm(20, 40).Build(), {.seed = static_cast<std::uint64_t>(step + 1)});
    ASSERT_TRUE(deployment.AwaitCalm()) << deployment.Standing();
    ASSERT_TRUE(deployment.Pause().ok());
    deployment.RunFor(Milliseconds(100) * step);
    deployment.Kill(RegionId(3));
    ASSERT_TRUE(AwaitState(deployment, v1::INSTANCE_STATE_PAUSED)) << step << deployment.Standing();
    EXPECT_NE(StandingTick(deployment), Tick()) << step;
    ASSERT_TRUE(deployment.Pause(false).ok());
    deployment.Settle();
    EXPECT_THAT(deployment.problems(), IsEmpty()) << step;
    EXPECT_EQ(deployment.bodies(), 40u);
  }
}

TEST_F(ClockTest, APauseOutlivesTheControlPlaneWhereverItDies) {
  for (int writes = 1; writes <= 4; ++writes) {
    Deployment deployment(Swarm(20, 30).Build(), {});
    ASSERT_TRUE(deployment.AwaitCalm()) << deployment.Standing();
    deployment.control().DieAfterStores(writes);
    (void)deployment.Pause();
    deployment.RunFor(Milliseconds(1500));
    if (deployment.control().alive()) deployment.control().Kill();
    deployment.control().Start();
    ASSERT_TRUE(AwaitState(deployment, v1::INSTANCE_STATE_PAUSED)) << writes << deployment.Standing();
    const Tick tick = StandingTick(deployment);
    deployment.control().Kill();
    deployment.RunFor(Milliseconds(1500));
    EXPECT_EQ(StandingTick(deployment), tick);
    deployment.control().Start();
    deployment.RunFor(Milliseconds(1500));
    EXPECT_EQ(StandingTick(deployment), tick);
    ASSERT_TRUE(deployment.Pause(false).ok());
    deployment.Settle();
    EXPECT_THAT(deployment.problems(), IsEmpty()) << writes;
  }
}

TEST_F(ClockTest, ARegionThatNoOrderReachesIsLeftAloneAndGoesOnWithItsNeighbours) {
  Deployment deployment(Swarm(20, 40).Build(), {});
  ASSERT_TRUE(deployment.AwaitCalm()) << deployment.Standing();
  ASSERT_TRUE(deployment.Pause().ok());
  ASSERT_TRUE(AwaitState(deployment, v1::INSTANCE_STATE_PAUSED));
  const Tick tick = StandingTick(deployment);
  deployment.host(2).KillAgent();
  deployment.RunFor(Milliseconds(5000));
  EXPECT_EQ(deployment.instance().failovers(), 0u) << "its lease shows its standby that it lives";
  EXPECT_EQ(StandingTick(deployment), tick);
  ASSERT_TRUE(deployment.Pause(false).ok());
  deployment.RunFor(Milliseconds(1000));
  for (const SimulatedWorker* worker : deployment.Workers()) {
    EXPECT_GT(worker->region()->tick(), tick + 30) << worker->identity().region.value();
  }
  EXPECT_EQ(LinksDown(deployment), 0u);
  deployment.Settle();
  EXPECT_THAT(deployment.problems(), IsEmpty());
}

// True once the world stands after this tick, in all regions and by the control plane's word.
bool AwaitStanding(Deployment& deployment, Tick tick) {
  return deployment.RunUntil(Milliseconds(20'000), [&] {
    return IsState(deployment, v1::INSTANCE_STATE_PAUSED) && deployment.instance().changes().empty() &&
           StandingTick(deployment) == tick;
  });
}

TEST_F(ClockTest, APausedWorldMakesAsManyTicksAsItIsToldInEveryRegion) {
  Deployment deployment(Swarm(20, 60).Build(), {.hosts = 3, .regions = 4});
  ASSERT_TRUE(deployment.AwaitCalm()) << deployment.Standing();
  EXPECT_EQ(deployment.MakeTicks(1).code(), absl::StatusCode::kFailedPrecondition) << "it goes";
  ASSERT_TRUE(deployment.Pause().ok());
  EXPECT_EQ(deployment.MakeTicks(1).code(), absl::StatusCode::kFailedPrecondition) << "it goes on for some ticks";
  ASSERT_TRUE(AwaitState(deployment, v1::INSTANCE_STATE_PAUSED)) << deployment.Standing();
  Tick tick = StandingTick(deployment);
  ASSERT_NE(tick, Tick());
  for (const std::uint32_t ticks : {1u, 1u, 2u, 3u, 7u, 60u, 1u, 400u}) {
    ASSERT_TRUE(deployment.MakeTicks(ticks).ok()) << ticks;
    EXPECT_EQ(deployment.MakeTicks(ticks).code(), absl::StatusCode::kFailedPrecondition) << "one at a time";
    tick = tick + ticks;
    ASSERT_TRUE(AwaitStanding(deployment, tick)) << ticks << " to " << tick.value() << deployment.Standing();
    deployment.RunFor(Milliseconds(2000));
    EXPECT_EQ(StandingTick(deployment), tick);
  }
  EXPECT_EQ(LinksDown(deployment), 0u);
  ASSERT_TRUE(deployment.Pause(false).ok());
  deployment.RunFor(Milliseconds(1000));
  EXPECT_GT(deployment.tick(), tick + 30);
  deployment.Settle();
  EXPECT_THAT(deployment.problems(), IsEmpty());
}

// Whether the regions of the host know where the next step ends, and have not heard that it begins.
bool KnowTheStep(Deployment& deployment, std::uint32_t host) {
  return std::ranges::all_of(deployment.host(host).workers(), [](const SimulatedWorker* worker) {
    const worker::RegionRun& run = *worker->core().run();
    return run.planned() > run.region().map().version() && !run.region().committed();
  });
}

// The agent dies some tenths of milliseconds after its regions know where the step ends, later each time: before it has
// passed on that they know, so that nobody steps; and then before the order to go on has come, so that only neighbours
// can tell them. Those may have promised to be silent for some ticks, so that a short step is made once the agent is
// back; a longer one is made at once. In no case does a region make other ticks than those.
TEST_F(ClockTest, ARegionThatNoOrderReachesMakesTheTicksOfItsNeighboursAndNoMore) {
  for (const std::uint32_t ticks : {1u, 2u, 30u}) {
    bool untold_was_left = false;
    for (int moment = 0; moment < 30; ++moment) {
      Deployment deployment(Swarm(20, 40).Build(), {});
      ASSERT_TRUE(deployment.AwaitCalm()) << deployment.Standing();
      ASSERT_TRUE(deployment.Pause().ok());
      ASSERT_TRUE(AwaitState(deployment, v1::INSTANCE_STATE_PAUSED));
      const Tick tick = StandingTick(deployment);
      ASSERT_TRUE(deployment.MakeTicks(ticks).ok());
      ASSERT_TRUE(deployment.RunUntil(Milliseconds(1000), [&] { return KnowTheStep(deployment, 2); }));
      deployment.RunFor(Micros(100) * moment);
      deployment.host(2).KillAgent();
      const bool untold = KnowTheStep(deployment, 2);
      deployment.RunFor(Milliseconds(5000));
      bool any_went = false;
      for (const SimulatedWorker* worker : deployment.Workers()) {
        const Tick now = worker->region()->tick();
        EXPECT_TRUE(now == tick || now == tick + ticks) << moment << ": " << now.value() << " from " << tick.value();
        EXPECT_TRUE(worker->core().run()->clock().paused()) << moment;
        any_went = any_went || now != tick;
      }
      untold_was_left = untold_was_left || (untold && any_went);
      if (ticks == 30 && any_went) {
        EXPECT_EQ(StandingTick(deployment), tick + ticks) << moment;
      }
      deployment.host(2).StartAgent();
      ASSERT_TRUE(AwaitStanding(deployment, tick + ticks)) << moment << deployment.Standing();
      ASSERT_TRUE(deployment.Pause(false).ok());
      deployment.Settle();
      EXPECT_THAT(deployment.problems(), IsEmpty()) << moment;
    }
    EXPECT_TRUE(untold_was_left) << ticks << ": the others never went without it";
  }
}

TEST_F(ClockTest, AStepThatARegionHoldsUpIsCalledOffByGoingOn) {
  Deployment deployment(Swarm(20, 40).Build(), {});
  ASSERT_TRUE(deployment.AwaitCalm()) << deployment.Standing();
  ASSERT_TRUE(deployment.Pause().ok());
  ASSERT_TRUE(AwaitState(deployment, v1::INSTANCE_STATE_PAUSED));
  const Tick tick = StandingTick(deployment);
  deployment.host(2).KillAgent();
  ASSERT_TRUE(deployment.MakeTicks(5).ok());
  deployment.RunFor(Milliseconds(3000));
  EXPECT_EQ(StandingTick(deployment), tick);
  ASSERT_TRUE(deployment.Pause(false).ok());
  deployment.RunFor(Milliseconds(2000));
  for (const SimulatedWorker* worker : deployment.Workers()) {
    EXPECT_GT(worker->region()->tick(), tick + 30) << worker->identity().region.value();
  }
  deployment.host(2).StartAgent();
  ASSERT_TRUE(AwaitState(deployment, v1::INSTANCE_STATE_RUNNING));
  deployment.Settle();
  EXPECT_THAT(deployment.problems(), IsEmpty());
  ASSERT_TRUE(deployment.Pause().ok()) << "and it can be paused again";
  ASSERT_TRUE(AwaitState(deployment, v1::INSTANCE_STATE_PAUSED)) << deployment.Standing();
  EXPECT_NE(StandingTick(deployment), Tick());
}

TEST_F(ClockTest, AStepOutlivesTheDeathsOfRegionsAndOfTheControlPlane) {
  for (int moment = 0; moment < 10; ++moment) {
    Deployment deployment(Swarm(20, 40).Build(), {.seed = static_cast<std::uint64_t>(moment + 1)});
    ASSERT_TRUE(deployment.AwaitCalm()) << deployment.Standing();
    ASSERT_TRUE(deployment.Pause().ok());
    ASSERT_TRUE(AwaitState(deployment, v1::INSTANCE_STATE_PAUSED));
    ASSERT_TRUE(deployment.MakeTicks(20).ok());
    deployment.RunFor(Milliseconds(60) * moment);
    deployment.Kill(RegionId(3));
    ASSERT_TRUE(deployment.RunUntil(Milliseconds(20'000),
                                    [&] {
                                      return deployment.instance().failovers() == 1 &&
                                             IsState(deployment, v1::INSTANCE_STATE_PAUSED) &&
                                             deployment.instance().changes().empty();
                                    }))
        << moment << deployment.Standing();
    EXPECT_NE(StandingTick(deployment), Tick()) << moment;
    ASSERT_TRUE(deployment.Pause(false).ok());
    deployment.Settle();
    EXPECT_THAT(deployment.problems(), IsEmpty()) << moment;
    EXPECT_EQ(deployment.bodies(), 40u);
  }
  for (int writes = 1; writes <= 3; ++writes) {
    Deployment deployment(Swarm(20, 30).Build(), {});
    ASSERT_TRUE(deployment.AwaitCalm()) << deployment.Standing();
    ASSERT_TRUE(deployment.Pause().ok());
    ASSERT_TRUE(AwaitState(deployment, v1::INSTANCE_STATE_PAUSED));
    const Tick tick = StandingTick(deployment);
    deployment.control().DieAfterStores(writes);
    (void)deployment.MakeTicks(20);
    deployment.RunFor(Milliseconds(1500));
    if (deployment.control().alive()) deployment.control().Kill();
    deployment.control().Start();
    ASSERT_TRUE(AwaitStanding(deployment, tick + 20)) << writes << deployment.Standing();
  }
}

TEST_F(ClockTest, AWorldInSlowMotionMakesFewerTicksAndHastensBackAtOnce) {
  Deployment deployment(Swarm(20, 40).Build(), {});
  ASSERT_TRUE(deployment.AwaitCalm()) << deployment.Standing();
  ASSERT_TRUE(deployment.SetPace(2).ok());
  ASSERT_TRUE(deployment.RunUntil(Milliseconds(20'000), [&] { return deployment.instance().ticks_per_second() == 2; }));
  deployment.RunFor(Milliseconds(2000));
  const Tick before = deployment.tick();
  deployment.RunFor(Milliseconds(10'000));
  EXPECT_NEAR(static_cast<double>(deployment.tick() - before), 20, 2);
  EXPECT_EQ(deployment.instance().failovers(), 0u);
  ASSERT_TRUE(deployment.SetPace(60).ok());
  const auto back = [&] { return deployment.instance().ticks_per_second() == 60; };
  EXPECT_TRUE(deployment.RunUntil(Milliseconds(3000), back)) << "a faster pace counts as soon as it is committed";
  EXPECT_EQ(LinksDown(deployment), 0u) << "a long tick is no silence";
  deployment.Settle();
  EXPECT_THAT(deployment.problems(), IsEmpty());
}

TEST_F(ClockTest, RefusesAPaceThatNoWorldCanHave) {
  Deployment deployment(Swarm(20, 10).Build(), {});
  EXPECT_EQ(deployment.Pause().code(), absl::StatusCode::kFailedPrecondition) << "it does not run yet";
  ASSERT_TRUE(deployment.AwaitCalm()) << deployment.Standing();
  for (const double pace :
       {0.0, -1.0, 0.5, 60.5, std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    const absl::Status refused = deployment.SetPace(pace);
    EXPECT_EQ(refused.code(), absl::StatusCode::kInvalidArgument) << pace;
    EXPECT_THAT(std::string(refused.message()), HasSubstr("ticks_per_second: ")) << pace;
  }
  EXPECT_EQ(deployment.instance().ticks_per_second(), 60);
}

// All bodies at one tick, by id.
std::map<BodyId, BodyState> StatesAt(Deployment& deployment, Tick end) {
  for (SimulatedWorker* worker : deployment.Workers()) worker->set_target(end);
  const auto there = [&] {
    return std::ranges::all_of(deployment.Workers(),
                               [&](const SimulatedWorker* worker) { return worker->region()->tick() == end; });
  };
  EXPECT_TRUE(deployment.RunUntil(Milliseconds(60'000), there)) << deployment.Standing();
  std::map<BodyId, BodyState> states;
  for (const SimulatedWorker* worker : deployment.Workers()) {
    for (const region::OwnedBody& body : worker->region()->owned()) states[body.def->id] = body.state;
  }
  return states;
}

TEST_F(ClockTest, APauseStepsAndSlowMotionChangeNoBit) {
  Deployment plain(Swarm(20, 60).Build(), {}), changed(Swarm(20, 60).Build(), {});
  for (Deployment* deployment : {&plain, &changed}) {
    ASSERT_TRUE(deployment->AwaitCalm()) << deployment->Standing();
  }
  ASSERT_TRUE(changed.Pause().ok());
  ASSERT_TRUE(AwaitState(changed, v1::INSTANCE_STATE_PAUSED));
  changed.RunFor(Milliseconds(777));
  const Tick stood = StandingTick(changed);
  for (const std::uint32_t ticks : {1u, 5u}) {
    ASSERT_TRUE(changed.MakeTicks(ticks).ok());
    ASSERT_TRUE(AwaitStanding(changed, stood + (ticks == 1 ? 1 : 6)));
  }
  ASSERT_TRUE(changed.Pause(false).ok());
  ASSERT_TRUE(AwaitState(changed, v1::INSTANCE_STATE_RUNNING));
  ASSERT_TRUE(changed.SetPace(20).ok());
  changed.RunFor(Milliseconds(2000));
  ASSERT_TRUE(changed.SetPace(60).ok());
  changed.RunFor(Milliseconds(1000));
  const Tick end = std::max(plain.tick(), changed.tick()) + 60;
  const std::map<BodyId, BodyState> one = StatesAt(plain, end), other = StatesAt(changed, end);
  ASSERT_EQ(one.size(), 60u);
  ASSERT_EQ(other.size(), 60u);
  for (const auto& [id, state] : one) {
    const BodyState& same = other.at(id);
    EXPECT_EQ(std::bit_cast<std::uint64_t>(state.position.x), std::bit_cast<std::uint64_t>(same.position.x));
    EXPECT_EQ(std::bit_cast<std::uint64_t>(state.position.y), std::bit_cast<std::uint64_t>(same.position.y));
    EXPECT_EQ(std::bit_cast<std::uint64_t>(state.position.z), std::bit_cast<std::uint64_t>(same.position.z));
    EXPECT_EQ(state.linear_velocity, same.linear_velocity);
  }
}

TEST_F(ClockTest, ACheckpointOfAPausedWorldIsThatOfItsTick) {
  Deployment deployment(Swarm(20, 30).Build(), {.checkpoint_interval = std::chrono::milliseconds(5000)});
  ASSERT_TRUE(deployment.AwaitCalm()) << deployment.Standing();
  ASSERT_TRUE(deployment.Pause().ok());
  ASSERT_TRUE(AwaitState(deployment, v1::INSTANCE_STATE_PAUSED));
  const Tick tick = StandingTick(deployment);
  const auto newest = [&] {
    const v1::Instance now = deployment.instance();
    return now.checkpoints().empty() ? 0 : now.checkpoints(now.checkpoints_size() - 1).tick();
  };
  ASSERT_TRUE(deployment.RunUntil(Milliseconds(30'000), [&] { return newest() == tick.value(); }));
  const int made = deployment.instance().checkpoints_size();
  deployment.RunFor(Milliseconds(20'000));
  EXPECT_EQ(newest(), tick.value());
  EXPECT_EQ(deployment.instance().checkpoints_size(), made) << "one of a tick is enough";
}

}  // namespace
}  // namespace tessera::simulation
