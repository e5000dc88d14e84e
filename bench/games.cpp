#include "bench/games.h"

#include <fmt/format.h>

#include <fstream>
#include <iterator>
#include <map>
#include <stdexcept>
#include <utility>

#include "bench/engine.h"
#include "bench/games_absent.h"
#include "bench/games_character.h"
#include "bench/games_commands.h"
#include "bench/games_reload.h"
#include "bench/games_state.h"
#include "bench/lag_shots.h"
#include "bench/lockstep.h"
#include "bench/statistics.h"
#include "bench/thread_cpu.h"
#include "core/game/game_host.h"
#include "core/world/scene_load.h"
#include "core/world/spawned_id.h"
#include "game_sdk/lua/lua_module.h"
#include "lua.hpp"
#include "scenes/measured/builder.h"

namespace tessera::bench {
namespace {

using scenes::Builder;

constexpr int kCallers = 2000;

// --- Games and their worlds

struct GameRun {
  std::shared_ptr<const Scene> scene;
  std::vector<std::shared_ptr<game::GameHost>> hosts;
  std::unique_ptr<Lockstep> world;

  std::uint64_t Sum(std::uint64_t game::GameStatistics::*field) const {
    std::uint64_t sum = 0;
    for (const auto& host : hosts) sum += host->statistics().*field;
    return sum;
  }
  // A game that fails measures nothing.
  void ExpectNoErrors() const {
    for (const auto& host : hosts) {
      for (const game::GameLine& line : host->TakeLines()) throw std::runtime_error("the game failed: " + line.text);
    }
  }
};

// Without a text, no game.
GameRun RunOf(const std::shared_ptr<const Scene>& scene, const PartitionMap& map, const std::string& text,
              Lockstep::Observer observer = {}) {
  GameRun run;
  run.scene = scene;
  Lockstep::GameMaker maker;
  if (!text.empty()) {
    maker = [&](RegionId) {
      auto host = game::GameHost::Load(*game::LuaGameModule(), {"bench.lua", text}, scene, {}, 1);
      if (!host.ok()) throw std::runtime_error(host.status().ToString());
      return run.hosts.emplace_back(*std::move(host));
    };
  }
  run.world = std::make_unique<Lockstep>(scene, map, region::RegionSettings(), std::move(observer), maker);
  return run;
}

GameRun RunOf(const std::shared_ptr<const Scene>& scene, std::uint32_t regions, const std::string& text,
              Lockstep::Observer observer = {}) {
  return RunOf(scene, *MakeGridMap(scene->ground(), regions), text, std::move(observer));
}

double TickSeconds(Lockstep& world) {
  const double before = ThreadCpuSeconds();
  world.Tick();
  return ThreadCpuSeconds() - before;
}

// --- A callback against a call of bare Lua

// Balls that lie still, far from each other: a step that costs as little as one of so many can.
std::shared_ptr<const Scene> SleepingCallers() {
  Builder make("callers");
  const ShapePtr ball = scenes::BallOf(0.2);
  for (int i = 0; i < kCallers; ++i) {
    BodyDef& body = make.Dynamic(ball, {i % 50 * 2.0, 1, i / 50 * 2.0}, 1);
    body.initial.asleep = true;
    body.kind = 1;
  }
  Scene scene = make.Take();
  scene.gravity_m_s2 = {};
  scene.kinds = {"", "caller"};
  scene.bounds = {{-10, -10, -10}, {110, 10, 110}};
  return std::make_shared<const Scene>(std::move(scene));
}

constexpr char kThreeCalls[] = R"(
  kinds.caller = {
    on_tick = function(self)
      self:mass() self:is_own() self:is_here()
    end,
  }
)";

int GiveNumber(lua_State* L) {
  lua_pushnumber(L, 1);
  return 1;
}

// CPU time of kCallers calls of a Lua function that calls three C functions.
class BareLua {
 public:
  BareLua() : state_(luaL_newstate()) {
    lua_register(state_, "give", GiveNumber);
    if (luaL_dostring(state_, "local give = give  function call(x) give(x) give(x) give(x) end") != 0) {
      throw std::runtime_error(lua_tostring(state_, -1));
    }
  }
  ~BareLua() { lua_close(state_); }
  BareLua(const BareLua&) = delete;
  BareLua& operator=(const BareLua&) = delete;

  double Seconds() {
    const double before = ThreadCpuSeconds();
    for (int i = 0; i < kCallers; ++i) {
      lua_getglobal(state_, "call");
      lua_pushinteger(state_, i);
      if (lua_pcall(state_, 1, 0, 0) != 0) throw std::runtime_error(lua_tostring(state_, -1));
    }
    return ThreadCpuSeconds() - before;
  }

 private:
  lua_State* state_;
};

void MeasureCallbacks(int ticks, Report& report) {
  const auto scene = SleepingCallers();
  GameRun with = RunOf(scene, 1, kThreeCalls);
  GameRun without = RunOf(scene, 1, "");
  BareLua bare;
  std::vector<double> ratios;
  for (int i = 0; i < ticks; ++i) {
    const double nothing = TickSeconds(*without.world), calls = TickSeconds(*with.world), lua = bare.Seconds();
    ratios.push_back((calls - nothing) / lua);
  }
  with.ExpectNoErrors();
  const std::uint64_t made = with.Sum(&game::GameStatistics::calls);
  if (made != static_cast<std::uint64_t>(kCallers) * static_cast<std::uint64_t>(ticks)) {
    throw std::runtime_error(fmt::format("{} callbacks were called, of {}", made, kCallers * ticks));
  }
  report.Add("callback", "tessera", "host_calls=3", "callback_cost_ratio", Median(ratios), "1");
  report.Add("callback", "tessera", "host_calls=3", "callback_cost_ratio_p10", Quantile(ratios, 0.1), "1");
  report.Add("callback", "tessera", "host_calls=3", "callback_cost_ratio_p90", Quantile(ratios, 0.9), "1");
}

// --- A callback a body and tick against the plaza's own step

constexpr char kCrowd[] = R"(
  kinds.crowd = {
    on_tick = function(self)
      if self:velocity().y < -30 then self:set_velocity(vec(0, 0, 0)) end
    end,
  }
)";

void MeasurePlaza(int ticks, Report& report) {
  const std::string path = std::string(TESSERA_SOURCE_DIR) + "/scenes/plaza.textproto";
  std::ifstream file(path);
  const std::string text{std::istreambuf_iterator<char>(file), {}};
  auto loaded = LoadScene(SceneForm::kText, text, path);
  if (!loaded.ok()) throw std::runtime_error(loaded.status().ToString());
  auto scene = std::make_shared<Scene>(*loaded->scene);
  scene->kinds = {"", "crowd"};
  int crowd = 0;
  for (BodyDef& body : scene->bodies) {
    if (body.motion != Motion::kDynamic || crowd == kCallers) continue;
    body.kind = 1;
    ++crowd;
  }
  GameRun with = RunOf(scene, 1, kCrowd), without = RunOf(scene, 1, "");
  std::vector<double> shares;
  for (int i = 0; i < ticks; ++i) {
    double calls = 0;
    if (i % 2 == 0) calls = TickSeconds(*with.world);
    const double nothing = TickSeconds(*without.world);
    if (i % 2 == 1) calls = TickSeconds(*with.world);
    shares.push_back((calls - nothing) / nothing);
  }
  with.ExpectNoErrors();
  const std::string config = fmt::format("bodies={}", crowd);
  const double calls = static_cast<double>(with.Sum(&game::GameStatistics::calls)) / ticks;
  report.Add("plaza", "tessera", config, "callbacks_per_tick", calls, "1");
  report.Add("plaza", "tessera", config, "tick_share", Median(shares), "1");
  report.Add("plaza", "tessera", config, "tick_share_p10", Quantile(shares, 0.1), "1");
  report.Add("plaza", "tessera", config, "tick_share_p90", Quantile(shares, 0.9), "1");
}

// --- Bodies that come and go against as many that stay

constexpr double kArena_m = 40;  // half of the world's side
constexpr int kRegions = 4;
// So many live for 60 to 120 ticks, at 500 a second in all.
constexpr int kAlive = 750;

constexpr char kFountain[] = R"(
  local function anywhere() return (world.random() - 0.5) * 76 end
  local function fast() return world.random() * 20 - 10 end
  function on_tick()
    for i = 1, world.tick() % 12 == 0 and 3 or 2 do
      local ball = world.spawn("ball", vec(anywhere(), 0, anywhere()), { velocity = vec(fast(), 0, fast()) })
      local ticks = 60 + math.random(60)
      if i % 2 == 0 then ball:expire_after(ticks) else ball:after(ticks, "remove") end
    end
  end
  kinds.ball = { on_timer = function(self) self:remove() end }
)";

// An arena without gravity, within walls, in which balls bounce without loss; `alive` of them are of the scene. Without
// walls those that stay would soon be far apart, and cost nothing.
std::shared_ptr<const Scene> ArenaOf(int alive) {
  Builder make("fountain");
  const ShapePtr ball = scenes::BallOf(0.3);
  std::uint64_t random = 88172645463325252u;  // xorshift64 (Marsaglia 2003)
  const auto next = [&] {
    random ^= random << 13, random ^= random >> 7, random ^= random << 17;
    return static_cast<double>(random >> 11) * 0x1p-53 - 0.5;
  };
  const auto bounce = [](BodyDef& body) {
    body.material.restitution = 1;
    body.may_sleep = false;
    body.kind = 1;
  };
  for (int i = 0; i < alive; ++i) {
    BodyDef& body = make.Dynamic(ball, {next() * 76, 0, next() * 76}, 1);
    body.initial.linear_velocity = Vec3f(Vec3d(next() * 20, 0, next() * 20));
    bounce(body);
  }
  Material wall;
  wall.restitution = 1;
  for (const double side : {-1.0, 1.0}) {
    make.Static(scenes::BoxOf(0.5, 5, kArena_m), {side * (kArena_m - 0.5), 0, 0}, wall);
    make.Static(scenes::BoxOf(kArena_m, 5, 0.5), {0, 0, side * (kArena_m - 0.5)}, wall);
  }
  Scene scene = make.Take();
  scene.gravity_m_s2 = {};
  scene.kinds = {"", "ball"};
  scene.bounds = {{-kArena_m, -kArena_m, -kArena_m}, {kArena_m, kArena_m, kArena_m}};
  Prefab& prefab = scene.prefabs.emplace_back();
  prefab.name = "ball";
  BodyDef& body = prefab.bodies.emplace_back();
  body.id = BodyId(1);
  body.shape = ball;
  body.mass_kg = 1;
  bounce(body);
  return std::make_shared<const Scene>(std::move(scene));
}

// Whether all that was made and not removed is owned by one region each.
struct Conserved {
  std::uint64_t lost = 0, doubled = 0;
};
Conserved CountMade(const GameRun& run, std::uint64_t removed) {
  std::map<BodyId, int> owners;
  for (std::size_t i = 0; i < run.world->size(); ++i) {
    for (const region::OwnedBody& body : run.world->region(i).owned()) ++owners[body.def->id];
  }
  Conserved conserved;
  std::uint64_t alive = 0;
  for (const auto& [id, count] : owners) {
    alive += IsSpawned(id) ? 1 : 0;
    conserved.doubled += count > 1 ? 1 : 0;
  }
  const std::uint64_t expected = run.Sum(&game::GameStatistics::spawned) - removed;
  conserved.lost = expected > alive ? expected - alive : 0;
  conserved.doubled += alive > expected ? alive - expected : 0;
  return conserved;
}

void MeasureSpawns(int seconds, Report& report) {
  std::vector<double> spawning, staying;
  std::uint64_t removed = 0;
  bool warm = false;
  const auto observe = [&](std::vector<double>& times) {
    return Lockstep::Observer{[&](const region::Region&, const region::StepResult& result, double cpu_s) {
                                for (const region::Departure& departure : result.departures) {
                                  removed += departure.reason == region::DepartureReason::kRemoved ? 1 : 0;
                                }
                                if (warm) times.push_back(cpu_s);
                              },
                              {}};
  };
  GameRun with = RunOf(ArenaOf(0), kRegions, kFountain, observe(spawning));
  GameRun without = RunOf(ArenaOf(kAlive), kRegions, "", observe(staying));
  // As many live after two seconds as ever.
  for (int tick = 0; tick < (seconds + 2) * 60; ++tick) {
    warm = tick >= 120;
    with.world->Tick();
    without.world->Tick();
  }
  with.ExpectNoErrors();
  const Conserved conserved = CountMade(with, removed);
  const std::string config = fmt::format("regions={}", kRegions);
  const auto add = [&](const char* metric, double value) {
    report.Add("spawns", "tessera", config, metric, value, "1");
  };
  add("spawned_per_s", static_cast<double>(with.Sum(&game::GameStatistics::spawned)) / (seconds + 2));
  add("spawned_lost", static_cast<double>(conserved.lost));
  add("spawned_doubled", static_cast<double>(conserved.doubled));
  add("spawned_step_p99_ratio", Quantile(spawning, 0.99) / Quantile(staying, 0.99));
  add("spawned_step_median_ratio", Median(spawning) / Median(staying));
}

// --- Messages over borders

constexpr int kTalkers = 20;
// Where four regions that lie in a row begin and end, m; the record of the world is in the first.
constexpr double kRow_m[] = {0, 20, 27, 34, 40};
// Each message that a ball sends to the world comes back. What comes twice, or out of order, is a line in the log.
constexpr char kEcho[] = R"(
  function on_message(name, values, sender) sender:send("back", values) end
  kinds.ball = {
    on_tick = function(self)
      if world.tick() > LAST then return end
      self.sent = self.sent + 1
      world.send("there", { n = self.sent })
    end,
    on_message = function(self, name, values)
      if values.n <= self.got then self.doubled = self.doubled + 1 else self.got = self.got + 1 end
    end,
  }
)";

PartitionMap RowOfFour() {
  constexpr double kHalf_m = 10;
  std::vector<Cell> cells;
  std::vector<MapRegion> regions;
  for (std::uint32_t i = 0; i < 4; ++i) {
    cells.push_back({{kRow_m[i], -kHalf_m, kRow_m[i + 1], kHalf_m}, RegionId(i + 1), Epoch(1)});
    regions.push_back({RegionId(i + 1), RegionId(i == 3 ? 1 : i + 2)});
  }
  return *PartitionMap::Create(MapVersion(1), {kRow_m[0], -kHalf_m, kRow_m[4], kHalf_m}, cells, regions);
}

// Balls that lie in one region of the row.
std::shared_ptr<const Scene> TalkersIn(int region) {
  Builder make("talkers");
  const ShapePtr ball = scenes::BallOf(0.1);
  for (int i = 0; i < kTalkers; ++i) {
    make.Dynamic(ball, {(kRow_m[region - 1] + kRow_m[region]) / 2, 0, i - kTalkers / 2.0}, 1).kind = 1;
  }
  Scene scene = make.Take();
  scene.gravity_m_s2 = {};
  scene.kinds = {"", "ball"};
  scene.properties = {{"sent", std::int64_t{0}}, {"got", std::int64_t{0}}, {"doubled", std::int64_t{0}}};
  scene.bounds = {{kRow_m[0], -10, -10}, {kRow_m[4], 10, 10}};
  return std::make_shared<const Scene>(std::move(scene));
}

void MeasureMessages(int ticks, int hops, Report& report) {
  const auto scene = TalkersIn(1 + hops);
  std::string text = kEcho;
  text.replace(text.find("LAST"), 4, std::to_string(ticks));
  GameRun run = RunOf(scene, RowOfFour(), text);
  for (int tick = 0; tick < ticks + 60; ++tick) run.world->Tick();
  run.ExpectNoErrors();
  std::int64_t sent = 0, got = 0, doubled = 0;
  for (std::size_t i = 0; i < run.world->size(); ++i) {
    for (const region::KeptRecord& record : run.world->region(i).records().all()) {
      if (record.body == kInstanceBody || record.bytes->empty()) continue;
      const PropertySet set = PropertySet::Decode(*record.bytes, scene->properties).value();
      const auto value = [&](const char* name) {
        return std::get<std::int64_t>(*ValueOf(scene->properties, {}, set, name));
      };
      sent += value("sent"), got += value("got"), doubled += value("doubled");
    }
  }
  game::MessageStatistics all;
  for (const auto& host : run.hosts) {
    const game::MessageStatistics& messages = host->statistics().messages;
    all.applied += messages.applied;
    all.late += messages.late;
    all.most_ticks = std::max(all.most_ticks, messages.most_ticks);
  }
  const std::string config = fmt::format("hops={}", hops);
  const auto add = [&](const char* metric, double value) {
    report.Add("messages", "tessera", config, metric, value, "1");
  };
  add("messages_sent", static_cast<double>(2 * sent));
  add("messages_lost", static_cast<double>(sent - got));
  add("messages_doubled", static_cast<double>(doubled));
  add("messages_late", static_cast<double>(all.late));
  report.Add("messages", "tessera", config, "message_ticks_max", static_cast<double>(all.most_ticks), "ticks");
}

}  // namespace

absl::Status RunGames(const SuiteOptions& options, Report& report) {
  const auto wanted = [&](const std::string& scene) { return scene.find(options.only) != std::string::npos; };
  const int ticks = options.quick ? 40 : 400;
  if (wanted("absent")) {
    if (absl::Status status = MeasureAbsent(report); !status.ok()) return status;
  }
  if (wanted("callback")) MeasureCallbacks(ticks, report);
  if (wanted("plaza")) MeasurePlaza(ticks, report);
  if (wanted("reload")) MeasureReload(report);
  if (wanted("character")) MeasureCharacter(options.quick, report);
  if (wanted("state")) MeasureState(report);
  if (wanted("commands")) MeasureCommands(options.quick ? 200 : 2000, report);
  if (wanted("lag")) MeasureLagHits(options.quick, report);
  if (wanted("spawns")) MeasureSpawns(options.quick ? 4 : 60, report);
  if (wanted("messages")) {
    for (const int hops : {1, 3}) MeasureMessages(options.quick ? 120 : 3'600, hops, report);
  }
  return absl::OkStatus();
}

}  // namespace tessera::bench
