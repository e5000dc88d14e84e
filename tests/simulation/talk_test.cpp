// Players talk with a game while their bodies change hands and regions die: every command is carried out once and in
// order, and so does every event come.
#include <gmock/gmock.h>

#include <algorithm>
#include <cstdio>

#include "core/region/output_commit.h"
#include "game_sdk/lua/lua_module.h"
#include "tests/simulation/instance.h"
#include "tests/simulation/talk_model.h"

namespace tessera::simulation {
namespace {

using ::testing::IsEmpty;

constexpr double kHalf = 20;  // half the ground's side, m
constexpr PlayerNumber kTalker{1};
constexpr BodyId kTalkersBody = PlayerBodyId(kTalker);

// Counts, and says so when a number is not the next one.
constexpr char kCounter[] = R"(
  function on_command(player, bytes)
    local body, n = player:body(), tonumber(bytes)
    if n ~= body.last + 1 then world.log(n .. " comes after " .. body.last) end
    body.last = n
    player:send("counted", { n = n })
  end
)";

// A ball that flies about in a square of walls, across all borders.
SceneBuilder TalkWorld() {
  SceneBuilder builder = Swarm(kHalf, 0);
  Scene& scene = builder.scene();
  scene.properties = {{"last", std::int64_t{0}}};
  PlayerRules rules;
  rules.body.shape = Ball(0.5);
  rules.body.mass_kg = 1;
  rules.body.material.restitution = 1;
  rules.body.material.friction = 0;
  rules.body.may_sleep = false;
  rules.body.initial.linear_velocity = {11, 0, 7};
  rules.spawn_points = {{-10, 0, -10}};
  rules.max_force_n = 10;
  rules.max_speed_m_s = 20;
  scene.player = rules;
  return builder;
}

class TalkSimulationTest : public ::testing::Test {
 protected:
  void Begin(std::uint64_t seed, double loss) {
    SimulationOptions options;
    options.seed = seed;
    options.game = [this](std::shared_ptr<const Scene> scene) -> std::shared_ptr<game::GameHost> {
      auto host = game::GameHost::Load(*game::LuaGameModule(), {"counter.lua", kCounter}, std::move(scene), {}, 7);
      EXPECT_TRUE(host.ok()) << host.status();
      return hosts_.emplace_back(*std::move(host));
    };
    instance = std::make_unique<Instance>(TalkWorld(), 4, options);
    simulation().SpawnPlayer(kTalker, RegionId(1));
    talk = std::make_unique<TalkModel>(simulation(), kTalker, TalkOptions{.seed = seed + 1, .loss = loss});
  }
  Simulation& simulation() { return *instance->simulation; }
  // Gives a command every third frame, and hears what came.
  void Play(int frames) {
    for (int i = 0; i < frames; ++i) {
      if (i % 3 == 0 && talk->Give(std::to_string(given + 1))) ++given;
      Frame();
    }
  }
  void Frame() {
    talk->RunFor(16'667);
    for (const client::GameEvent& event : talk->TakeEvents()) {
      EXPECT_EQ(event.name, "counted");
      EXPECT_EQ(std::get<std::int64_t>(event.values.at(0).second), ++heard) << "each event once, in order";
    }
  }
  void ExpectAllArrived() {
    for (int i = 0; i < 600 && (talk->pending() > 0 || heard < given); ++i) Frame();
    EXPECT_EQ(talk->pending(), 0U);
    EXPECT_EQ(heard, given);
    for (const auto& host : hosts_) {
      for (const game::GameLine& line : host->TakeLines()) ADD_FAILURE() << line.text;
    }
    EXPECT_THAT(simulation().problems(), IsEmpty());
  }

  std::unique_ptr<Instance> instance;
  std::unique_ptr<TalkModel> talk;
  std::int64_t given = 0, heard = 0;

 private:
  std::vector<std::shared_ptr<game::GameHost>> hosts_;
};

TEST_F(TalkSimulationTest, EachCommandIsCarriedOutOnceAndInOrderWhileRegionsDie) {
  std::uint64_t handovers = 0;
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    SCOPED_TRACE(seed);
    given = heard = 0;
    Begin(seed, 0.2);
    Play(240);
    for (int deaths = 0; deaths < 2; ++deaths) {
      const RegionId owner = simulation().OwnerOf(kTalkersBody);
      ASSERT_NE(owner, RegionId());
      simulation().Kill(owner);
      Play(420);
    }
    ExpectAllArrived();
    EXPECT_GT(given, 300);
    EXPECT_EQ(instance->control->totals().failovers, 2U);
    handovers += simulation().totals().handovers;
    EXPECT_GT(talk->repeated(), 0U);
  }
  EXPECT_GT(handovers, 20U);
  std::printf("%lld commands of the last run, %lu handovers in all\n", static_cast<long long>(given),
              static_cast<unsigned long>(handovers));
}

// Ticks from a command's arrival at the region to the committed effect, beyond the way there and back.
TEST_F(TalkSimulationTest, AnEffectIsToldWithinSixTicks) {
  Begin(5, 0);
  std::map<std::int64_t, Tick> taken;
  talk->on_taken = [&](SimulatedRegion& worker, std::string_view bytes) {
    taken.emplace(std::stoll(std::string(bytes)), worker.region().tick());
  };
  std::vector<std::int64_t> ticks;
  simulation().on_step = [&, before = simulation().on_step](SimulatedRegion& worker, const region::StepResult& result) {
    before(worker, result);
    const region::KeptRecord* const record = worker.region().records().Find(kTalkersBody);
    if (result.tick.value() % 2 != 0 || record == nullptr) return;  // ticks with snapshots
    const auto& told = worker.region().output().PropertiesOf(*record);
    if (told == nullptr || told->empty()) return;
    const auto set = PropertySet::Decode(*told, simulation().scene()->properties);
    const auto last = std::get<std::int64_t>(*ValueOf(simulation().scene()->properties, {}, *set, "last"));
    while (!taken.empty() && taken.begin()->first <= last) {
      ticks.push_back(result.tick - taken.begin()->second);
      taken.erase(taken.begin());
    }
  };
  Play(1800);
  ExpectAllArrived();
  ASSERT_GT(ticks.size(), 500U);
  std::ranges::sort(ticks);
  const std::int64_t p99 = ticks[ticks.size() * 99 / 100];
  EXPECT_LE(p99, 6);
  std::printf("command_ticks_p50 %lld, command_ticks_p99 %lld, most %lld, of %zu commands\n",
              static_cast<long long>(ticks[ticks.size() / 2]), static_cast<long long>(p99),
              static_cast<long long>(ticks.back()), ticks.size());
}

}  // namespace
}  // namespace tessera::simulation
