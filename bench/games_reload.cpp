#include "bench/games_reload.h"

#include <map>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "bench/lockstep.h"
#include "core/game/game_host.h"
#include "core/world/ids.h"
#include "game_sdk/lua/lua_module.h"
#include "scenes/measured/builder.h"

namespace tessera::bench {
namespace {

constexpr std::uint32_t kReloadRegions = 4, kReloadPlayers = 8;
constexpr std::uint64_t kTicksBefore = 120, kTicksAfter = 120, kLead = 30;
constexpr char kReloaded[] = R"(
  function on_tick() world.count("world") end
  kinds.ball = { on_tick = function(self) world.count("balls") end }
)";

std::shared_ptr<const Scene> ReloadScene() {
  scenes::Builder make("reload");
  const ShapePtr ball = scenes::BallOf(0.3);
  for (int i = 0; i < 40; ++i) {
    BodyDef& body = make.Dynamic(ball, {i % 8 * 4.0 - 14, 0, i / 8 * 4.0 - 8}, 1);
    body.initial.linear_velocity = {static_cast<float>(i % 5) - 2, 0, static_cast<float>(i % 3) - 1};
    body.may_sleep = false;
    body.kind = 1;
  }
  Scene scene = make.Take();
  scene.gravity_m_s2 = {};
  scene.kinds = {"", "ball"};
  scene.bounds = {{-20, -20, -20}, {20, 20, 20}};
  PlayerRules& player = scene.player.emplace();
  player.body.shape = ball;
  player.body.mass_kg = 80;
  player.max_force_n = 500;
  player.max_speed_m_s = 6;
  player.spawn_points = {{-15, 5, -15}, {15, 5, -15}, {-15, 5, 15}, {15, 5, 15}};
  return std::make_shared<const Scene>(std::move(scene));
}

std::shared_ptr<game::GameHost> Loaded(const std::shared_ptr<const Scene>& scene, std::uint32_t number) {
  auto host = game::GameHost::Load(*game::LuaGameModule(), {"reload.lua", kReloaded}, scene, {}, 1, number);
  if (!host.ok()) throw std::runtime_error(host.status().ToString());
  return *std::move(host);
}

void Expect(const absl::Status& status) {
  if (!status.ok()) throw std::runtime_error(status.ToString());
}

}  // namespace

void MeasureReload(Report& report) {
  const std::shared_ptr<const Scene> scene = ReloadScene();
  const PartitionMap map = *MakeGridMap(scene->ground(), kReloadRegions);
  Lockstep world(scene, map, region::RegionSettings(), {}, [&](RegionId) { return Loaded(scene, 0); });
  for (std::uint32_t n = 1; n <= kReloadPlayers; ++n) {
    const Vec3d& place = scene->player->spawn_points[(n - 1) % scene->player->spawn_points.size()];
    world.region(map.OwnerOf(place).value() - 1).SpawnPlayer(PlayerNumber(n));
  }
  std::uint64_t ball_ticks = 0;
  const auto tick = [&] {
    world.Tick();
    for (std::size_t i = 0; i < world.size(); ++i) {
      for (const region::OwnedBody& body : world.region(i).owned()) ball_ticks += IsPlayerBody(body.def->id) ? 0 : 1;
    }
  };
  for (std::uint64_t i = 0; i < kTicksBefore; ++i) tick();
  absl::StatusOr<PartitionMap> next =
      PartitionMap::Create(MapVersion(2), map.bounds(), {map.cells().begin(), map.cells().end()},
                           {map.regions().begin(), map.regions().end()});
  Expect(next.status());
  const PartitionMap planned = next->With({.paused = false, .ticks_per_second = 0, .game = 1});
  for (std::size_t i = 0; i < world.size(); ++i) {
    world.region(i).PrepareGame(Loaded(scene, 1));
    Expect(world.region(i).Announce(planned, Tick(kTicksBefore + kLead)));
  }
  Expect(world.region(0).Commit(MapVersion(2)));
  for (std::uint64_t i = 0; i < kTicksAfter; ++i) tick();
  std::uint64_t called = 0, players = 0;
  for (std::size_t i = 0; i < world.size(); ++i) {
    const game::GameHost& host = *world.region(i).game();
    if (host.number() != 1) throw std::runtime_error("a region runs the old game");
    for (const auto& [name, count] : host.counters()) called += count;
    for (const region::OwnedBody& body : world.region(i).owned()) players += IsPlayerBody(body.def->id) ? 1 : 0;
  }
  const std::uint64_t due = (kTicksBefore + kTicksAfter) * kReloadRegions + ball_ticks;
  const auto add = [&](const char* metric, double value) {
    report.Add("reload", "tessera", "players=8", metric, value, "1");
  };
  add("reload_ticks_lost", static_cast<double>(due) - static_cast<double>(called));
  add("reload_players_dropped", static_cast<double>(kReloadPlayers) - static_cast<double>(players));
}

}  // namespace tessera::bench
