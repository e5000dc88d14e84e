#include "bench/games_state.h"

#include <algorithm>
#include <array>
#include <map>
#include <memory>
#include <set>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "core/game/game_host.h"
#include "core/region/output_commit.h"
#include "core/region/region.h"
#include "core/region/region_state.h"
#include "core/region/resolve.h"
#include "core/region/standby_copy.h"
#include "core/world/partition_change.h"
#include "core/world/spawned_id.h"
#include "game_sdk/lua/lua_module.h"
#include "scenes/measured/builder.h"

namespace tessera::bench {
namespace {

constexpr PlayerNumber kTold{1};
constexpr std::uint64_t kTicksOfTwo = 47, kTicksOfOne = 13;  // between two deaths; odd, so that they meet all phases
constexpr std::array<RegionId, 2> kSides = {RegionId(1), RegionId(2)};

constexpr char kMatch[] = R"(
  local function anywhere() return (world.random() - 0.5) * 36 end
  function on_tick()
    if world.tick() % 3 ~= 0 then return end
    local spark = world.spawn("spark", vec(anywhere(), 0, anywhere()), { velocity = vec(9, 0, 0) })
    spark:after(20 + math.random(40), "end")
  end
  kinds.spark = {
    on_tick = function(self) self.count = self.count + 1 end,
    on_timer = function(self) self:remove() end,
  }
  kinds.ball = { on_tick = function(self) self.count = self.count + 1 end }
  kinds.player = {
    on_tick = function(self)
      if world.tick() % 5 == 0 then self:player():send("beat", { tick = world.tick() }) end
    end,
  }
)";

std::shared_ptr<const Scene> MatchScene() {
  scenes::Builder make("match");
  const ShapePtr ball = scenes::BallOf(0.3);
  for (int i = 0; i < 16; ++i) {
    BodyDef& body = make.Dynamic(ball, {i % 4 * 8.0 - 12, 2, i / 4 * 8.0 - 12}, 1);
    body.initial.linear_velocity = {static_cast<float>(i % 5) - 2, 0, static_cast<float>(i % 3) - 1};
    body.may_sleep = false;
    body.kind = 1;
  }
  Scene scene = make.Take();
  scene.gravity_m_s2 = {};
  scene.kinds = {"", "ball", "spark", "player"};
  scene.properties = {{"count", std::int64_t{0}}};
  scene.bounds = {{-20, -20, -20}, {20, 20, 20}};
  Prefab& spark = scene.prefabs.emplace_back();
  spark.name = "spark";
  BodyDef& body = spark.bodies.emplace_back();
  body.id = BodyId(1);
  body.shape = ball;
  body.mass_kg = 1;
  body.kind = 2;
  body.may_sleep = false;
  PlayerRules& player = scene.player.emplace();
  player.body.shape = ball;
  player.body.mass_kg = 80;
  player.body.kind = 3;
  player.body.initial.linear_velocity = {4, 0, 0};
  player.body.may_sleep = false;
  player.max_force_n = 500;
  player.max_speed_m_s = 6;
  player.spawn_points = {{-15, 5, -15}};
  return std::make_shared<const Scene>(std::move(scene));
}

void ExpectWell(const absl::Status& status) {
  if (!status.ok()) throw std::runtime_error(status.ToString());
}

// Two regions, each the other's standby with each log a tick late, and a client that is told what regions may tell.
class TwoSides {
 public:
  TwoSides() : scene_(MatchScene()), map_(*MakeGridMap(scene_->ground(), 2)) {
    BeginFrom(nullptr);
    sides_.at(kSides[0]).region->SpawnPlayer(kTold, "ada");
  }
  void Play(std::uint64_t ticks) {
    for (std::uint64_t i = 0; i < ticks; ++i) Tick();
  }
  // The other one carries on; what is missing then is counted.
  void Kill(RegionId dead) {
    const RegionId heir = dead == kSides[0] ? kSides[1] : kSides[0];
    region::Region& region = *sides_.at(heir).region;
    const region::StandbyCopy& copy = *sides_.at(dead).copy;
    const region::StandbyCopy* const primaries[] = {&copy};
    const auto map = FailoverMap(region.map(), std::vector{dead}, MapVersion(region.map().version().value() + 1));
    ExpectWell(map.status());
    const auto inventory = region.BeginFailover(*map, primaries);
    ExpectWell(inventory.status());
    const auto resolution = region::Resolve(*map, std::vector{dead}, std::vector{*inventory}, {});
    ExpectWell(resolution.status());
    ExpectWell(region.Resume(*resolution, primaries).status());
    sides_.erase(dead);
    region.SetStandby(false);
    ++figures_.deaths;
    CountLosses(region);
  }
  // Both regions go on from the state of the one that lives.
  void Revive() {
    const region::Region& only = *sides_.begin()->second.region;
    auto state = region::DecodeState(only.SaveState(), only.catalog());
    ExpectWell(state.status());
    auto merged = region::MergeStates(std::vector{*std::move(state)});
    ExpectWell(merged.status());
    BeginFrom(std::make_shared<const region::RegionState>(*std::move(merged)));
  }
  const StateFigures& figures() const { return figures_; }

 private:
  struct Side {
    std::unique_ptr<region::Region> region;
    std::unique_ptr<region::StandbyCopy> copy;  // that the other one has of it
    region::Bytes last_log;                     // which the copy does not have yet
    std::map<BodyId, tessera::Tick> removed;    // which nobody is told of yet, and in which tick
  };

  void BeginFrom(const std::shared_ptr<const region::RegionState>& initial) {
    sides_.clear();
    for (const RegionId id : kSides) {
      auto host = game::GameHost::Load(*game::LuaGameModule(), {"match.lua", kMatch}, scene_, {}, 1);
      ExpectWell(host.status());
      region::Config config{id, Incarnation(++incarnations_), scene_, map_, {}, initial};
      config.game = *std::move(host);
      Side& side = sides_[id];
      side.region = std::make_unique<region::Region>(std::move(config));
      side.region->SetStandby(true);
      side.copy = std::make_unique<region::StandbyCopy>(id, side.region->catalog());
    }
    for (auto& [id, side] : sides_) Send(id, side.region->Start());
  }
  void Send(RegionId from, const std::vector<region::OutgoingFrame>& frames) {
    for (const region::OutgoingFrame& frame : frames) {
      const auto to = sides_.find(frame.to);
      if (to != sides_.end()) ExpectWell(to->second.region->Receive(from, frame.bytes));
    }
  }
  void Tick() {
    std::map<RegionId, region::StepResult> results;
    for (auto& [id, side] : sides_) results[id] = side.region->Step();
    for (auto& [id, result] : results) {
      Side& side = sides_.at(id);
      Send(id, result.frames);
      for (const region::Departure& departure : result.departures) {
        const bool removed = departure.reason == region::DepartureReason::kRemoved && IsSpawned(departure.body);
        if (removed) side.removed.emplace(departure.body, result.tick);
      }
      if (side.copy != nullptr && sides_.size() > 1) {
        if (!side.last_log.empty()) ExpectWell(side.copy->Receive(side.last_log));
        side.region->LogAcknowledged(side.copy->tick());
        side.last_log = std::move(result.log);
      }
      for (const game::GameLine& line : side.region->game()->TakeLines()) throw std::runtime_error(line.text);
    }
    for (auto& [id, side] : sides_) Hear(side);
  }
  // As a client of the region hears of it.
  void Hear(Side& side) {
    region::Region& region = *side.region;
    for (const region::KeptRecord& record : region.records().all()) {
      const auto& told = region.output().PropertiesOf(record);
      if (told == nullptr || told->empty() || !region.Owns(record.body)) continue;
      std::int64_t& count = counts_[record.body];
      count = std::max(count, CountIn(*told));
    }
    for (const region::OwnedBody& body : region.owned()) {
      if (!IsSpawned(body.def->id) || region.IsHidden(body.def->id)) continue;
      figures_.told_spawns += there_.insert(body.def->id).second && !gone_.contains(body.def->id) ? 1 : 0;
    }
    std::erase_if(side.removed, [&](const auto& entry) {
      if (entry.second > region.committed_tick()) return false;
      there_.erase(entry.first);
      counts_.erase(entry.first);
      figures_.told_removals += gone_.insert(entry.first).second ? 1 : 0;
      return true;
    });
    if (const game::PlayerRecord* const talk = region.TalkOf(kTold); talk != nullptr && talk->last_event > heard_) {
      figures_.told_events += talk->last_event - heard_;
      heard_ = talk->last_event;
      region.AcknowledgeEvents(kTold, heard_);
    }
  }
  std::int64_t CountIn(const std::vector<std::uint8_t>& bytes) const {
    const auto set = PropertySet::Decode(bytes, scene_->properties);
    ExpectWell(set.status());
    return std::get<std::int64_t>(*ValueOf(scene_->properties, {}, *set, "count"));
  }
  void CountLosses(const region::Region& region) {
    const auto& removed = sides_.begin()->second.removed;  // by the one that lives, and not told yet
    for (const auto& [body, told] : counts_) {
      if (removed.contains(body) || (IsSpawned(body) && !there_.contains(body))) continue;
      const region::KeptRecord* const record = region.records().Find(body);
      const bool kept = record != nullptr && !record->bytes->empty() && CountIn(*record->bytes) >= told;
      figures_.properties_lost += kept ? 0 : 1;
    }
    for (const BodyId body : there_) figures_.spawns_lost += region.Owns(body) || removed.contains(body) ? 0 : 1;
    for (const BodyId body : gone_) figures_.removals_lost += region.Owns(body) ? 1 : 0;
    const region::KeptRecord* const player = region.records().Find(PlayerBodyId(kTold));
    const std::uint32_t last = player == nullptr ? 0 : player->game.player->last_event;
    figures_.events_lost += last < heard_ ? heard_ - last : 0;
  }

  const std::shared_ptr<const Scene> scene_;
  const PartitionMap map_;
  std::map<RegionId, Side> sides_;
  std::uint64_t incarnations_ = 0;
  // A client knows these.
  std::map<BodyId, std::int64_t> counts_;
  std::set<BodyId> there_, gone_;
  std::uint32_t heard_ = 0;
  StateFigures figures_;
};

}  // namespace

StateFigures PlayThroughDeaths(std::uint64_t deaths) {
  TwoSides world;
  for (std::uint64_t death = 0; death < deaths; ++death) {
    world.Play(kTicksOfTwo);
    world.Kill(kSides[death % 2]);
    world.Play(kTicksOfOne);
    world.Revive();
  }
  return world.figures();
}

void MeasureState(Report& report) {
  const StateFigures figures = PlayThroughDeaths(20);
  const auto add = [&](const char* metric, std::uint64_t value) {
    report.Add("state", "tessera", "deaths=20", metric, static_cast<double>(value), "1");
  };
  add("state_lost", figures.lost());
  add("state_told_spawns", figures.told_spawns);
  add("state_told_removals", figures.told_removals);
  add("state_told_events", figures.told_events);
}

}  // namespace tessera::bench
