#include "bench/games_commands.h"

#include <map>
#include <stdexcept>
#include <string>
#include <vector>

#include "bench/statistics.h"
#include "core/game/game_host.h"
#include "core/region/output_commit.h"
#include "core/region/region.h"
#include "core/world/scene.h"
#include "game_sdk/lua/lua_module.h"
#include "scenes/measured/builder.h"

namespace tessera::bench {
namespace {

constexpr PlayerNumber kCommander{1};
constexpr std::uint64_t kSnapshotEvery = 2, kStandbyBehind = 1;  // ticks

constexpr char kCount[] = R"(
  function on_command(player, bytes)
    local body = player:body()
    body.last = tonumber(bytes)
  end
)";

std::shared_ptr<const Scene> CommandScene() {
  scenes::Builder make("commands");
  make.Dynamic(scenes::BallOf(0.2), {5, 1, 5}, 1);
  auto scene = std::make_shared<Scene>(make.Take());
  scene->bounds = {{-20, -10, -20}, {20, 10, 20}};
  scene->kinds = {""};
  scene->properties = {{"last", std::int64_t{0}}};
  PlayerRules rules;
  rules.body.shape = scenes::BallOf(0.5);
  rules.body.mass_kg = 1;
  rules.spawn_points = {{-5, 1, -5}};
  rules.max_force_n = 10;
  rules.max_speed_m_s = 5;
  scene->player = rules;
  return scene;
}

// A region with a standby that has each log a tick after it was made.
class CommandWorld {
 public:
  CommandWorld() : scene_(CommandScene()) {
    auto host = game::GameHost::Load(*game::LuaGameModule(), {"bench.lua", kCount}, scene_, {}, 1);
    if (!host.ok()) throw std::runtime_error(host.status().ToString());
    region::Config config{RegionId(1), Incarnation(1), scene_, *MakeGridMap(scene_->ground(), 1), {}};
    config.game = *std::move(host);
    region_ = std::make_unique<region::Region>(std::move(config));
    (void)region_->Start();
    region_->SetStandby(true);
    region_->SpawnPlayer(kCommander, "ada");
  }
  region::Region& region() { return *region_; }
  void Tick() {
    (void)region_->Step();
    if (region_->tick().value() > kStandbyBehind) {
      region_->LogAcknowledged(tessera::Tick(region_->tick().value() - kStandbyBehind));
    }
  }
  // As a snapshot of this tick has it.
  std::int64_t Told() const {
    const region::KeptRecord* const record = region_->records().Find(PlayerBodyId(kCommander));
    const auto& told = region_->output().PropertiesOf(*record);
    if (told == nullptr || told->empty()) return 0;
    const auto set = PropertySet::Decode(*told, scene_->properties);
    return std::get<std::int64_t>(*ValueOf(scene_->properties, {}, *set, "last"));
  }

 private:
  std::shared_ptr<const Scene> scene_;
  std::unique_ptr<region::Region> region_;
};

}  // namespace

void MeasureCommands(int count, Report& report) {
  CommandWorld world;
  for (int i = 0; i < 10; ++i) world.Tick();
  std::map<std::int64_t, tessera::Tick> arrived;
  std::vector<double> ticks;
  for (std::uint32_t number = 1; static_cast<int>(ticks.size()) < count; world.Tick()) {
    const tessera::Tick now = world.region().tick();
    if (now.value() % kSnapshotEvery == 0) {
      const std::int64_t told = world.Told();
      while (!arrived.empty() && arrived.begin()->first <= told) {
        ticks.push_back(static_cast<double>(now - arrived.begin()->second));
        arrived.erase(arrived.begin());
      }
    }
    if (now.value() % 3 != 0) continue;
    const std::string bytes = std::to_string(number);
    const absl::Status status = world.region().TakeCommand(kCommander, {1, number, bytes});
    if (!status.ok()) throw std::runtime_error(status.ToString());
    arrived.emplace(number++, now);
  }
  report.Add("commands", "tessera", "standby=1", "command_ticks_p50", Median(ticks), "ticks");
  report.Add("commands", "tessera", "standby=1", "command_ticks_p99", Quantile(ticks, 0.99), "ticks");
}

}  // namespace tessera::bench
