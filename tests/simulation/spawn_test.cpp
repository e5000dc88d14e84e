// A game makes and removes bodies in four regions while two of them die.
#include <gmock/gmock.h>

#include <cstdio>

#include "game_sdk/lua/lua_module.h"
#include "tests/simulation/instance.h"

namespace tessera::simulation {
namespace {

using ::testing::IsEmpty;

constexpr double kArena_m = 40;  // half the ground's side

// In each region and second 125 balls, anywhere in the world, which live for a second or two: half of them expire, the
// others are removed by a timer, wherever they are then.
constexpr char kFountain[] = R"(
  local function anywhere() return (world.random() - 0.5) * 76 end
  function on_tick()
    local count = world.tick() % 12 == 0 and 3 or 2
    for i = 1, count do
      local velocity = vec(world.random() * 20 - 10, 0, world.random() * 20 - 10)
      local ball = world.spawn("ball", vec(anywhere(), 0, anywhere()), { velocity = velocity })
      local ticks = 60 + math.random(60)
      if i % 2 == 0 then
        ball:expire_after(ticks)
      else
        ball:after(ticks, "remove")
      end
      ball.born = world.tick()
    end
  end
  kinds.ball = {
    on_timer = function(self, name)
      self:remove()
    end,
  }
)";

SceneBuilder Arena() {
  SceneBuilder builder(kArena_m);
  Scene& scene = builder.scene();
  scene.kinds = {"", "ball"};
  scene.properties = {{"born", std::int64_t{0}}};
  Prefab& prefab = scene.prefabs.emplace_back();
  prefab.name = "ball";
  BodyDef& def = prefab.bodies.emplace_back();
  def.id = BodyId(1);
  def.kind = 1;
  def.shape = Ball(0.3);
  def.mass_kg = 1;
  def.material.restitution = 1;
  def.may_sleep = false;
  builder.Add(Ball(0.3), {1, 5, 1});  // one of the scene's own
  return builder;
}

class SpawnSimulationTest : public ::testing::Test {
 protected:
  std::unique_ptr<Instance> Begin(std::uint64_t seed, const PacketConditions& conditions = {}) {
    SimulationOptions options;
    options.seed = seed;
    options.conditions = conditions;
    hosts_.clear();
    options.game = [this](std::shared_ptr<const Scene> scene) -> std::shared_ptr<game::GameHost> {
      auto host = game::GameHost::Load(*game::LuaGameModule(), {"fountain.lua", kFountain}, std::move(scene), {}, 7);
      EXPECT_TRUE(host.ok()) << host.status();
      return hosts_.emplace_back(*std::move(host));
    };
    return std::make_unique<Instance>(Arena(), 4, options);
  }
  void ExpectSound(Instance& instance) {
    instance.simulation->Settle();
    EXPECT_THAT(instance.simulation->problems(), IsEmpty());
    EXPECT_EQ(instance.control->totals().lost, 0U);
    for (const auto& host : hosts_) {
      for (const game::GameLine& line : host->TakeLines()) ADD_FAILURE() << line.text;
    }
  }

 private:
  std::vector<std::shared_ptr<game::GameHost>> hosts_;
};

TEST_F(SpawnSimulationTest, NothingThatClientsKnowOfIsLostOrComesBackWhenRegionsDie) {
  const auto instance = Begin(3);
  Simulation& simulation = *instance->simulation;
  simulation.RunTo(Tick(1200));
  simulation.Kill(RegionId(2));
  simulation.RunTo(Tick(2400));
  simulation.Kill(RegionId(4));
  simulation.RunTo(Tick(3600));  // a minute
  ExpectSound(*instance);
  EXPECT_EQ(instance->control->totals().failovers, 2U);
  const InvariantChecker::Made& made = simulation.invariants().made();
  EXPECT_GT(made.made, 9'500U);
  EXPECT_GT(made.removed, 9'000U);
  EXPECT_EQ(made.came_back, 0U);
  EXPECT_GT(simulation.totals().handovers, 5'000U);
  std::printf("%lu made, %lu removed, %lu handovers\n", static_cast<unsigned long>(made.made),
              static_cast<unsigned long>(made.removed), static_cast<unsigned long>(simulation.totals().handovers));
}

TEST_F(SpawnSimulationTest, OnAnyNetworkTheSameBodiesAreMade) {
  const auto play = [&](std::uint64_t seed, Micros jitter) {
    PacketConditions conditions;
    conditions.jitter = jitter;
    const auto instance = Begin(seed, conditions);
    for (const auto& [id, worker] : instance->simulation->workers()) worker->set_target(Tick(120));
    instance->simulation->RunTo(Tick(120));
    EXPECT_THAT(instance->simulation->problems(), IsEmpty());
    std::vector<BodyId> bodies;
    for (const auto& [id, state] : instance->simulation->States()) bodies.push_back(id);
    return bodies;
  };
  EXPECT_EQ(play(1, 0), play(9, Milliseconds(8)));
}

// A ball that a game throws up again whenever it comes down; its region dies at each tick of a throw.
TEST(BouncingGameTest, TheStandbyGoesOnWithTheGame) {
  static constexpr char kBounce[] = R"(
    kinds.ball = {
      on_contact = function(self)
        self.hits = self.hits + 1
        self:impulse(vec(0, 3, 0))
      end,
    }
  )";
  for (std::uint64_t death = 100; death < 140; ++death) {
    SceneBuilder builder(12);
    builder.Gravity().Floor();
    builder.scene().kinds = {"", "ball"};
    builder.scene().properties = {{"hits", std::int64_t{0}}};
    builder.Add(Ball(0.5), {-6, 1, -6}).kind = 1;
    SimulationOptions options;
    options.game = [](std::shared_ptr<const Scene> scene) -> std::shared_ptr<game::GameHost> {
      return *game::GameHost::Load(*game::LuaGameModule(), {"bounce.lua", kBounce}, std::move(scene));
    };
    Instance instance(builder, 4, options);
    const auto hits = [&] {
      for (const auto& [id, worker] : instance.simulation->workers()) {
        const region::KeptRecord* record = worker->region().records().Find(BodyId(2));
        if (record == nullptr) continue;
        const PropertySet set = PropertySet::Decode(*record->bytes, instance.scene->properties).value();
        return std::get<std::int64_t>(*ValueOf(instance.scene->properties, {}, set, "hits"));
      }
      return std::int64_t{-1};
    };
    instance.simulation->RunTo(Tick(death));
    const std::int64_t before = hits();
    instance.simulation->Kill(RegionId(1));
    instance.simulation->RunTo(Tick(death + 180));
    EXPECT_GE(hits(), before + 2) << "death at tick " << death;
    EXPECT_THAT(instance.simulation->problems(), IsEmpty());
  }
}

}  // namespace
}  // namespace tessera::simulation
