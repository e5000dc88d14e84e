// Events that wait because a game is late, while their bodies change regions under every fault: the game hears of each
// once and in order. Balls fly along a street with gates across it and never turn round, so where a ball is says which
// gates it has passed, whatever the game has counted.
#include <gmock/gmock.h>

#include <algorithm>
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include "game_sdk/lua/lua_module.h"
#include "tests/simulation/disturbance.h"
#include "tests/simulation/instance.h"

namespace tessera::simulation {
namespace {

using ::testing::IsEmpty;

constexpr double kStreetHalf_m = 70, kFirstGate_m = -50, kGateSpacing_m = 7, kGateHalf_m = 0.5, kBallRadius_m = 0.3;
constexpr std::int64_t kGates = 15, kBallsInStreet = 40;
constexpr float kBallSpeed_m_s = 3;
constexpr Tick kLastFault{1'700}, kAllPassed{2'330};

// The world's on_tick uses up all of a tick's work in two of three ticks, 60 in a row. Both bodies of a pair are told.
constexpr char kLateGame[] = R"(
  function on_tick()
    if world.tick() % 90 < 60 then for i = 1, 6000 do end end
  end
  kinds.gate = {
    on_entered = function(self, ball)
      if self.index ~= ball.entered + 1 then print(self.index, "entered after", ball.entered) end
      ball.entered = ball.entered + 1
    end,
    on_left = function(self, ball)
      if self.index ~= ball.left + 1 then print(self.index, "left after", ball.left) end
      if ball.entered ~= self.index then print(self.index, "left and not entered") end
      ball.left = ball.left + 1
    end,
  }
  kinds.ball = {
    on_entered = function(self, gate) self.own_entered = self.own_entered + 1 end,
    on_left = function(self, gate) self.own_left = self.own_left + 1 end,
  }
)";

SceneBuilder Street() {
  SceneBuilder builder(kStreetHalf_m);
  Scene& scene = builder.scene();
  scene.kinds = {"", "ball", "gate"};
  for (const char* name : {"index", "entered", "left", "own_entered", "own_left"}) {
    scene.properties.push_back({name, std::int64_t{0}});
  }
  for (std::int64_t i = 0; i < kBallsInStreet; ++i) {
    BodyDef& ball =
        builder.Add(Ball(kBallRadius_m), {-56, 0, 3.0 * static_cast<double>(i) - 58}, {kBallSpeed_m_s, 0, 0});
    ball.kind = 1;
    ball.may_sleep = false;
  }
  for (std::int64_t i = 0; i < kGates; ++i) {
    BodyDef& gate = builder.Add(MakeShape(BoxShape{{kGateHalf_m, 2, kStreetHalf_m}}),
                                {kFirstGate_m + kGateSpacing_m * static_cast<double>(i), 0, 0});
    gate.motion = Motion::kStatic;
    gate.mass_kg = 0;
    gate.trigger = true;
    gate.kind = 2;
    EXPECT_TRUE(gate.properties.Set(scene.properties, "index", i + 1).ok());
  }
  return builder;
}

class WaitingSimulationTest : public ::testing::Test {
 protected:
  void Begin(std::uint64_t seed) {
    SimulationOptions options;
    options.seed = seed;
    hosts_.clear();
    options.game = [this](std::shared_ptr<const Scene> scene) -> std::shared_ptr<game::GameHost> {
      game::GameSettings settings;
      settings.instructions_per_tick = 5'000;
      auto host = game::GameHost::Load(*game::LuaGameModule(), {"late.lua", kLateGame}, std::move(scene), settings, 7);
      EXPECT_TRUE(host.ok()) << host.status();
      return hosts_.emplace_back(*std::move(host));
    };
    instance = std::make_unique<Instance>(Street(), 4, options);
    Simulation& simulation = *instance->simulation;
    simulation.on_step = [this, before = simulation.on_step](SimulatedRegion& worker,
                                                             const region::StepResult& result) {
      before(worker, result);
      CountTravelling(worker);
    };
  }
  // A body that is about to be handed over has its events in its record, for that tick alone.
  void CountTravelling(const SimulatedRegion& worker) {
    for (const region::KeptRecord& record : worker.region().records().all()) {
      travelled += record.game.waiting.size();
    }
  }
  std::int64_t CountOf(BodyId ball, const char* name) {
    for (const auto& [id, worker] : instance->simulation->workers()) {
      const region::KeptRecord* const record = worker->region().records().Find(ball);
      if (record == nullptr || !worker->region().Owns(ball)) continue;
      const PropertySet set = PropertySet::Decode(*record->bytes, instance->scene->properties).value();
      return std::get<std::int64_t>(*ValueOf(instance->scene->properties, {}, set, name));
    }
    return 0;
  }
  // Compares what the game counted with the gates that lie behind each ball.
  void ExpectCountsToBeTheWorlds() {
    const std::map<BodyId, BodyState> states = instance->simulation->States();
    ASSERT_EQ(states.size(), static_cast<std::size_t>(kBallsInStreet));
    for (const auto& [ball, state] : states) {
      std::int64_t entered = 0, left = 0;
      for (std::int64_t gate = 0; gate < kGates; ++gate) {
        const double middle = kFirstGate_m + kGateSpacing_m * static_cast<double>(gate);
        const double reach = kGateHalf_m + kBallRadius_m;
        entered += state.position.x > middle - reach ? 1 : 0;
        left += state.position.x > middle + reach ? 1 : 0;
      }
      EXPECT_EQ(left, kGates) << "ball " << ball.value() << " is at x = " << state.position.x;
      for (const char* name : {"entered", "own_entered"})
        EXPECT_EQ(CountOf(ball, name), entered) << ball.value() << name;
      for (const char* name : {"left", "own_left"}) EXPECT_EQ(CountOf(ball, name), left) << ball.value() << name;
    }
    for (const auto& host : hosts_) {
      for (const game::GameLine& line : host->TakeLines()) ADD_FAILURE() << line.text;
      EXPECT_EQ(host->statistics().dropped_events, 0U);
    }
    EXPECT_THAT(instance->simulation->problems(), IsEmpty());
    EXPECT_EQ(instance->control->totals().lost, 0U);
  }

  std::unique_ptr<Instance> instance;
  std::uint64_t travelled = 0;

 private:
  std::vector<std::shared_ptr<game::GameHost>> hosts_;
};

TEST_F(WaitingSimulationTest, EachEventGoesAlongWithItsBodyOnceUnderEveryFault) {
  std::uint64_t deaths = 0, handovers = 0, planned = 0;
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    SCOPED_TRACE(seed);
    Begin(seed);
    Chance chance(seed);
    Disturb(*instance, chance, kLastFault);
    instance->simulation->RunFor(Milliseconds(1'000));
    instance->simulation->Settle();
    instance->simulation->RunTo(kAllPassed);
    ExpectCountsToBeTheWorlds();
    deaths += instance->control->totals().deaths;
    handovers += instance->simulation->totals().handovers;
    planned += instance->control->totals().planned;
  }
  EXPECT_GT(deaths, 10U);
  EXPECT_GT(travelled, 100U) << "events that waited while their bodies were handed over";
  std::printf("%lld events, %lu of them handed over with their bodies; %lu deaths, %lu handovers, %lu planned maps\n",
              static_cast<long long>(kGates) * kBallsInStreet * 16, static_cast<unsigned long>(travelled),
              static_cast<unsigned long>(deaths), static_cast<unsigned long>(handovers),
              static_cast<unsigned long>(planned));
}

}  // namespace
}  // namespace tessera::simulation
