// games/arena played by bots in regions that die, beside a checker that knows the world and not the game: it sees where
// balls begin and end, and what players are told, and compares that with what the game counted.
//
// TESSERA_ARENA_SEEDS=N plays N matches instead of a few.
#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "core/world/scene_load.h"
#include "core/world/spawned_id.h"
#include "game_sdk/lua/lua_module.h"
#include "games/arena/bot/arena_player.h"
#include "host/files.h"
#include "tests/simulation/disturbance.h"
#include "tests/simulation/instance.h"
#include "tests/simulation/talk_model.h"

namespace tessera::simulation {
namespace {

using ::testing::Each;
using ::testing::IsEmpty;

constexpr std::uint32_t kPlayers = 8, kRegions = 6;
constexpr Tick kLastThrow{9'000};  // a match has 10 800
constexpr std::uint64_t kBallTicks = 600;

std::string ReadGameFile(const std::string& name) {
  return host::ReadFile(std::string(TESSERA_SOURCE_DIR) + "/games/arena/" + name, kMaxSceneBytes).value();
}

std::shared_ptr<const Scene> ArenaScene() {
  return LoadScene(SceneForm::kText, ReadGameFile("scene.json"), "games/arena/scene.json").value().scene;
}

PropertyValue ValueIn(const Scene& scene, const Simulation& simulation, BodyId body, const std::string& name) {
  const bool world = body == kInstanceBody;
  const auto& declared = world ? scene.instance_properties : scene.properties;
  for (const auto& [id, worker] : simulation.workers()) {
    const region::KeptRecord* record = worker->region().records().Find(body);
    if (record == nullptr || record->bytes->empty()) continue;
    return *ValueOf(declared, {}, PropertySet::Decode(*record->bytes, declared).value(), name);
  }
  return *ValueOf(declared, {}, PropertySet(), name);
}

class Bot {
 public:
  Bot(Simulation& simulation, PlayerNumber player, std::uint64_t seed)
      : simulation_(simulation),
        player_(player),
        body_(PlayerBodyId(player)),
        play_(seed),
        talk_(simulation, player, {.seed = seed + 1, .loss = 0.1}) {}

  void Frame() {
    talk_.Exchange();
    for (const client::GameEvent& event : talk_.TakeEvents()) Hear(event);
    if (simulation_.tick() < kLastThrow) Play();
  }
  std::int64_t goals() const { return goals_; }
  std::size_t pending() const { return talk_.pending(); }

 private:
  void Hear(const client::GameEvent& event) {
    if (event.name == "welcome") {
      play_.Welcome(std::get<std::string>(event.values.at(0).second));
    } else if (event.name == "goal") {
      EXPECT_EQ(std::get<std::int64_t>(event.values.at(0).second), ++goals_) << "each goal is told once, in order";
    } else {
      EXPECT_EQ(event.name, "out");
    }
  }
  void Play() {
    const RegionId owner = simulation_.OwnerOf(body_);
    if (owner == RegionId()) return;
    const Vec3d place = simulation_.worker(owner.value()).region().world().StateOf(body_).position;
    const arena::ArenaPlayer::Action act = play_.Frame(place);
    if (!act.command.empty()) talk_.Give(act.command);
    const PlayerInput input{.number = next_++,
                            .player = player_,
                            .body = body_,
                            .move = act.move,
                            .yaw_rad = act.yaw_rad,
                            .buttons = act.buttons};
    for (const auto& [id, worker] : simulation_.workers()) (void)worker->region().QueueInput(input);
  }

  Simulation& simulation_;
  const PlayerNumber player_;
  const BodyId body_;
  arena::ArenaPlayer play_;
  TalkModel talk_;
  std::uint32_t next_ = 1;
  std::int64_t goals_ = 0;
};

struct Sight {
  Tick tick;
  RegionId region;
  Vec3d position;
};
struct BallLife {
  Sight first, last;
};

class ArenaMatch {
 public:
  explicit ArenaMatch(std::uint64_t seed) : scene_(ArenaScene()) {
    SimulationOptions options;
    options.seed = seed;
    options.game = [this](std::shared_ptr<const Scene> scene) -> std::shared_ptr<game::GameHost> {
      auto host =
          game::GameHost::Load(*game::LuaGameModule(), {"game.lua", ReadGameFile("game.lua")}, std::move(scene), {}, 7);
      EXPECT_TRUE(host.ok()) << host.status();
      return hosts_.emplace_back(*std::move(host));
    };
    SceneBuilder builder(0);
    builder.scene() = *scene_;
    instance = std::make_unique<Instance>(builder, kRegions, options);
    simulation().on_step = [this, before = simulation().on_step](SimulatedRegion& worker,
                                                                 const region::StepResult& result) {
      before(worker, result);
      Watch(worker, result.tick);
    };
    for (const BodyDef& body : scene_->bodies) {
      if (scene_->kinds[body.kind] == "barrel") simulation().invariants().GameMayRemove(body.id);
    }
    for (std::uint32_t i = 1; i <= kPlayers; ++i) {
      simulation().SpawnPlayer(PlayerNumber(i), RegionId(1 + i % kRegions));
      bots_.push_back(std::make_unique<Bot>(simulation(), PlayerNumber(i), seed * 100 + i));
    }
    Frame();
  }

  Simulation& simulation() { return *instance->simulation; }
  std::int64_t World(const std::string& name) {
    return std::get<std::int64_t>(ValueIn(*scene_, simulation(), kInstanceBody, name));
  }
  std::int64_t GoalsHeard() const {
    std::int64_t goals = 0;
    for (const auto& bot : bots_) goals += bot->goals();
    return goals;
  }
  std::int64_t GoalsOfPlayers() {
    std::int64_t goals = 0;
    for (std::uint32_t i = 1; i <= kPlayers; ++i) {
      goals += std::get<std::int64_t>(ValueIn(*scene_, simulation(), PlayerBodyId(PlayerNumber(i)), "goals"));
    }
    return goals;
  }
  // How many regions own a body of each player.
  std::vector<std::size_t> BodiesOfPlayers() {
    std::vector<std::size_t> bodies(kPlayers);
    for (std::uint32_t i = 1; i <= kPlayers; ++i) {
      bodies[i - 1] = static_cast<std::size_t>(std::ranges::count_if(simulation().workers(), [&](const auto& entry) {
        return entry.second->region().Owns(PlayerBodyId(PlayerNumber(i)));
      }));
    }
    return bodies;
  }
  std::size_t CommandsPending() const {
    std::size_t pending = 0;
    for (const auto& bot : bots_) pending += bot->pending();
    return pending;
  }
  // Balls that clients were told of; those that a death takes back never were there.
  std::map<BodyId, BallLife> Balls() {
    std::map<BodyId, BallLife> told;
    for (const auto& [id, life] : balls_) {
      if (told_.contains(id)) told.emplace(id, life);
    }
    return told;
  }
  // Things that a player has held, and was seen to hold while another one did, too.
  const std::set<BodyId>& held() const { return held_; }
  const std::set<BodyId>& in_two_hands() const { return in_two_hands_; }
  void ExpectThatHoldersAndThingsAgree() {
    for (const auto& [player, thing] : holders_) {
      if (thing == BodyId()) continue;
      EXPECT_EQ(std::get<BodyId>(ValueIn(*scene_, simulation(), thing, "holder")), player) << "of " << thing.value();
    }
  }
  void ExpectNoLines() {
    for (const auto& host : hosts_) {
      for (const game::GameLine& line : host->TakeLines()) ADD_FAILURE() << line.text;
    }
  }

  std::unique_ptr<Instance> instance;

 private:
  void Frame() {
    for (const auto& bot : bots_) bot->Frame();
    simulation().timeline().In(16'667, [this] { Frame(); });
  }
  // By joints that are in force, whatever properties say: both ends are here then.
  void WatchJoints(const SimulatedRegion& worker) {
    std::map<BodyId, int> hands;
    for (const region::KeptRecord& record : worker.region().records().all()) {
      if (!worker.region().Owns(record.body)) continue;
      for (const game::GameJoint& joint : record.game.joints) {
        const bool player_first = IsPlayerBody(record.body);
        if (joint.until != Tick() || player_first == IsPlayerBody(joint.other)) continue;
        const BodyId thing = player_first ? joint.other : record.body;
        if (++hands[thing] > 1) in_two_hands_.insert(thing);
      }
    }
  }
  void Watch(SimulatedRegion& worker, Tick tick) {
    WatchJoints(worker);
    for (const region::OwnedBody& body : worker.region().owned()) {
      if (IsPlayerBody(body.def->id)) WatchHand(worker, body.def->id);
      if (!IsSpawned(body.def->id)) continue;
      if (simulation().invariants().expected().contains(body.def->id)) told_.insert(body.def->id);
      const Sight sight{tick, worker.id(), worker.region().world().StateOf(body.def->id).position};
      balls_.try_emplace(body.def->id, BallLife{sight, sight}).first->second.last = sight;
    }
  }

  void WatchHand(const SimulatedRegion& worker, BodyId player) {
    const region::KeptRecord* const record = worker.region().records().Find(player);
    const PropertySet set = record == nullptr || record->bytes->empty()
                                ? PropertySet()
                                : PropertySet::Decode(*record->bytes, scene_->properties).value();
    const auto thing = std::get<BodyId>(*ValueOf(scene_->properties, {}, set, "held"));
    holders_[player] = thing;
    if (thing == BodyId()) return;
    held_.insert(thing);
    const auto holds = [&](const auto& entry) { return entry.second == thing; };
    if (std::ranges::count_if(holders_, holds) > 1) in_two_hands_.insert(thing);
  }

  std::shared_ptr<const Scene> scene_;
  std::vector<std::shared_ptr<game::GameHost>> hosts_;
  std::vector<std::unique_ptr<Bot>> bots_;
  std::map<BodyId, BodyId> holders_;  // the thing that each player holds
  std::set<BodyId> held_, in_two_hands_;
  std::map<BodyId, BallLife> balls_;
  std::set<BodyId> told_;
};

int MatchesToPlay() {
  const char* const seeds = std::getenv("TESSERA_ARENA_SEEDS");
  return seeds == nullptr ? 2 : std::atoi(seeds);
}

TEST(ArenaSimulationTest, TheGamesCountsAreTheWorldsUnderEveryFault) {
  std::int64_t scored = 0, scored_elsewhere = 0, thrown = 0;
  std::uint64_t deaths = 0, handovers = 0, planned = 0, held = 0;
  for (int seed = 1; seed <= MatchesToPlay(); ++seed) {
    SCOPED_TRACE(seed);
    ArenaMatch match(static_cast<std::uint64_t>(seed));
    Simulation& simulation = match.simulation();
    Chance chance(static_cast<std::uint64_t>(seed));
    Disturb(*match.instance, chance, kLastThrow);
    simulation.RunFor(Milliseconds(1'000));
    simulation.Settle();
    simulation.RunTo(kLastThrow + 2 * kBallTicks);
    EXPECT_THAT(simulation.problems(), IsEmpty());
    match.ExpectNoLines();
    EXPECT_EQ(match.CommandsPending(), 0U);

    // A ball that ends in a goal as its time runs out, too, may have scored or not.
    std::int64_t goals = 0, at_the_last_moment = 0;
    const std::map<BodyId, BallLife> balls = match.Balls();
    for (const auto& [id, ball] : balls) {
      EXPECT_EQ(simulation.OwnerOf(id), RegionId()) << "ball " << id.value() << " neither landed nor ended";
      const bool in_goal = std::abs(ball.last.position.x) > 33 && std::abs(ball.last.position.z) < 4;
      if (ball.last.tick - ball.first.tick >= static_cast<std::int64_t>(kBallTicks) - 2) {
        at_the_last_moment += in_goal ? 1 : 0;
        continue;
      }
      ++goals;
      EXPECT_GT(std::abs(ball.last.position.x), 33) << "ball " << id.value() << " ended early, and not in a goal";
      EXPECT_LT(std::abs(ball.last.position.z), 4);
      scored_elsewhere += ball.first.region != ball.last.region ? 1 : 0;
    }
    const std::int64_t counted = match.World("red") + match.World("blue");
    EXPECT_GE(counted, goals);
    EXPECT_LE(counted, goals + at_the_last_moment);
    EXPECT_EQ(match.GoalsHeard(), counted);
    EXPECT_EQ(match.GoalsOfPlayers(), counted);
    EXPECT_EQ(match.World("thrown"), static_cast<std::int64_t>(balls.size()));
    EXPECT_EQ(match.World("ended"), static_cast<std::int64_t>(balls.size()));
    EXPECT_EQ(match.World("red_players"), kPlayers / 2);
    EXPECT_EQ(match.World("blue_players"), kPlayers / 2);
    EXPECT_THAT(match.BodiesOfPlayers(), Each(1U)) << "and at no tick two, which the simulation's own checker sees";
    EXPECT_THAT(match.in_two_hands(), IsEmpty());
    EXPECT_GT(match.held().size(), 3U) << "nobody grabs anything";
    match.ExpectThatHoldersAndThingsAgree();
    held += match.held().size();
    scored += goals;
    thrown += match.World("thrown");
    deaths += simulation.totals().kills;
    handovers += simulation.totals().handovers;
    planned += match.instance->control->totals().planned;
  }
  EXPECT_GT(scored, 20 * MatchesToPlay());
  EXPECT_GE(3 * scored_elsewhere, scored) << "a third are thrown in one region and scored in another";
  std::printf(
      "%lld thrown, %lld scored, %lld of them in another region, %lu things held; %lu deaths, %lu handovers, %lu "
      "planned maps\n",
      static_cast<long long>(thrown), static_cast<long long>(scored), static_cast<long long>(scored_elsewhere),
      static_cast<unsigned long>(held), static_cast<unsigned long>(deaths), static_cast<unsigned long>(handovers),
      static_cast<unsigned long>(planned));
}

}  // namespace
}  // namespace tessera::simulation
