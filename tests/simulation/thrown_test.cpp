// A player throws, and the region that has its body dies while the command waits for its input: the ball is made once,
// and it is the one that the player's client shows.
#include <gmock/gmock.h>

#include <cstdio>
#include <deque>
#include <map>
#include <memory>
#include <vector>

#include "game_sdk/lua/lua_module.h"
#include "tests/simulation/instance.h"
#include "tests/simulation/talk_model.h"

namespace tessera::simulation {
namespace {

using ::testing::IsEmpty;

constexpr double kYardHalf_m = 20;
constexpr PlayerNumber kThrower{1};
constexpr BodyId kThrowersBody = PlayerBodyId(kThrower);
constexpr std::uint32_t kInputsAhead = 6;  // a command waits for so many inputs more
constexpr std::size_t kInputRepeats = 4;

constexpr char kThrowGame[] = R"(
  function on_command(player, command)
    world.spawn("ball", player:body():position() + vec(0, 2, 0), { velocity = vec(5, 0, 3), predicted = player })
  end
)";

// The player flies about in a square of walls, across all borders; balls do so above it.
SceneBuilder Yard() {
  SceneBuilder builder = Swarm(kYardHalf_m, 0);
  Scene& scene = builder.scene();
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
  Prefab& prefab = scene.prefabs.emplace_back();
  prefab.name = "ball";
  BodyDef& def = prefab.bodies.emplace_back();
  def.id = BodyId(1);
  def.shape = Ball(0.3);
  def.mass_kg = 1;
  def.material.restitution = 1;
  def.may_sleep = false;
  return builder;
}

class ThrownSimulationTest : public ::testing::Test {
 protected:
  void Begin(std::uint64_t seed) {
    SimulationOptions options;
    options.seed = seed;
    hosts_.clear();
    options.game = [this](std::shared_ptr<const Scene> scene) -> std::shared_ptr<game::GameHost> {
      auto host = game::GameHost::Load(*game::LuaGameModule(), {"throw.lua", kThrowGame}, std::move(scene), {}, 7);
      EXPECT_TRUE(host.ok()) << host.status();
      return hosts_.emplace_back(*std::move(host));
    };
    talk.reset();
    instance = std::make_unique<Instance>(Yard(), 4, options);
    simulation().SpawnPlayer(kThrower, RegionId(1));
    talk = std::make_unique<TalkModel>(simulation(), kThrower, TalkOptions{.seed = seed + 1, .loss = 0.1});
    asked_.clear();
    next_input_ = 1;
  }
  Simulation& simulation() { return *instance->simulation; }
  // Each with an input, which goes to all regions a few times, as clients send them.
  void Play(int frames) {
    for (int i = 0; i < frames; ++i) {
      asked_.push_back({.number = next_input_++, .player = kThrower, .body = kThrowersBody});
      if (asked_.size() > kInputRepeats) asked_.pop_front();
      for (const auto& [id, worker] : simulation().workers()) {
        for (const PlayerInput& input : asked_) (void)worker->region().QueueInput(input);
      }
      talk->RunFor(16'667);
    }
  }
  // With an input that is yet to come. Returns the command's number.
  std::uint32_t Throw() {
    const std::optional<std::uint32_t> number = talk->next();
    EXPECT_TRUE(number.has_value()) << "no region has spoken";
    EXPECT_TRUE(talk->Give("throw", next_input_ + kInputsAhead));
    return number.value_or(0);
  }
  // Whether a command waits in that region.
  bool WaitsIn(RegionId region) {
    const region::KeptRecord* const record = simulation().worker(region.value()).region().records().Find(kThrowersBody);
    return record != nullptr && !record->game.player->commands.empty();
  }
  // How many bodies there are of each command of the player's.
  std::map<std::uint32_t, int> Made() {
    std::map<std::uint32_t, int> made;
    for (const auto& [id, worker] : simulation().workers()) {
      for (const region::KeptRecord& record : worker->region().records().all()) {
        const std::optional<SpawnClaim>& claim = record.game.tuning.claim;
        if (!claim || !worker->region().Owns(record.body)) continue;
        EXPECT_EQ(claim->player, kThrower);
        ++made[claim->command];
      }
    }
    return made;
  }
  void ExpectSound() {
    simulation().Settle();
    EXPECT_THAT(simulation().problems(), IsEmpty());
    EXPECT_EQ(instance->control->totals().lost, 0U);
    EXPECT_EQ(talk->pending(), 0U);
    for (const auto& host : hosts_) {
      for (const game::GameLine& line : host->TakeLines()) ADD_FAILURE() << line.text;
    }
  }

  std::unique_ptr<Instance> instance;
  std::unique_ptr<TalkModel> talk;

 private:
  std::deque<PlayerInput> asked_;
  std::uint32_t next_input_ = 1;
  std::vector<std::shared_ptr<game::GameHost>> hosts_;
};

TEST_F(ThrownSimulationTest, ABallWhoseCommandWaitsWhileItsRegionDiesIsMadeOnce) {
  int waited = 0;
  for (int delay = 0; delay < 14; ++delay) {
    SCOPED_TRACE(delay);
    Begin(static_cast<std::uint64_t>(delay) + 1);
    Play(200 + 7 * delay);
    const std::uint32_t before = Throw();
    Play(60);
    const std::uint32_t thrown = Throw();
    Play(delay);
    const RegionId owner = simulation().OwnerOf(kThrowersBody);
    ASSERT_NE(owner, RegionId());
    waited += WaitsIn(owner) ? 1 : 0;
    simulation().Kill(owner);
    Play(200);
    const std::uint32_t after = Throw();
    Play(100);
    EXPECT_EQ(Made(), (std::map<std::uint32_t, int>{{before, 1}, {thrown, 1}, {after, 1}}));
    EXPECT_EQ(instance->control->totals().failovers, 1U);
    ExpectSound();
  }
  EXPECT_GE(waited, 5) << "deaths while a command waited";
  std::printf("%d of 14 regions died while a command waited\n", waited);
}

}  // namespace
}  // namespace tessera::simulation
