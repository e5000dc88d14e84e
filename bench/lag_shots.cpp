#include "bench/lag_shots.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <map>
#include <memory>
#include <optional>
#include <random>
#include <set>
#include <stdexcept>
#include <string>
#include <variant>
#include <vector>

#include "bench/lockstep.h"
#include "client_sdk/playout_clock.h"
#include "client_sdk/world_view.h"
#include "core/game/game_host.h"
#include "core/game/player_record.h"
#include "core/game/value.h"
#include "core/world/player_input.h"
#include "game_sdk/lua/lua_module.h"
#include "scenes/measured/builder.h"

namespace tessera::bench {
namespace {

using TimePoint = client::PlayoutClock::TimePoint;

constexpr PlayerNumber kShooter{1};
constexpr BodyId kTarget{1};
constexpr double kRadius_m = 0.4, kTurn_m = 40;
constexpr int kSnapshotEvery = 2, kTicksBetweenShots = 7;
constexpr double kNear_m = 0.02;
const Vec3d kMuzzle{-5, 0, 20};

// The target turns back where it is far from the border, which is at x = 0.
constexpr char kShootingGame[] = R"lua(
  local MUZZLE = vec(-5, 0, 20)
  kinds.target = {
    on_tick = function(self)
      local x = self:position().x
      if x > 40 then self:set_velocity(vec(-10, 0, 0)) end
      if x < -40 then self:set_velocity(vec(10, 0, 0)) end
    end,
  }
  function on_command(player, bytes)
    local parts = string.split(bytes, " ")
    local number, rewind, x, y, z = parts[1], parts[2], parts[3], parts[4], parts[5]
    local options = { kinds = "target" }
    if rewind == "1" then options.at_time = player:shown_time() end
    world.ask_ray("shot", MUZZLE, vec(tonumber(x), tonumber(y), tonumber(z)), options, { number = tonumber(number) })
  end
  function on_answer(name, hits, complete, values, asker)
    local point = hits[1] and hits[1].point
    asker:player():send("shot", { complete = complete, hit = point ~= nil, number = values.number,
                                  point = point or vec(0, 0, 0) })
  end
)lua";

std::shared_ptr<const Scene> ShootingScene() {
  scenes::Builder make("lag");
  BodyDef& target = make.Dynamic(scenes::BallOf(kRadius_m), {-20, 0, 0}, 1);
  target.initial.linear_velocity = {10, 0, 0};
  target.kind = 1;
  auto scene = std::make_shared<Scene>(make.Take());
  scene->gravity_m_s2 = {};
  scene->bounds = {{-60, -20, -40}, {60, 20, 40}};
  scene->kinds = {"", "target"};
  PlayerRules rules;
  rules.body.shape = scenes::BallOf(0.5);
  rules.body.mass_kg = 1;
  rules.spawn_points = {kMuzzle + Vec3d{0, 0, 2}};
  rules.max_force_n = 10;
  rules.max_speed_m_s = 5;
  scene->player = rules;
  return scene;
}

// Things on their way, by when they arrive.
template <class Thing>
class LagLine {
 public:
  void Send(double arrives_s, Thing thing) { under_way_.emplace(arrives_s, std::move(thing)); }
  template <class Take>
  void Deliver(double now_s, const Take& take) {
    while (!under_way_.empty() && under_way_.begin()->first <= now_s) {
      auto node = under_way_.extract(under_way_.begin());
      take(node.key(), node.mapped());
    }
  }

 private:
  std::multimap<double, Thing> under_way_;
};

struct SentShot {
  std::uint32_t number = 0;
  std::string bytes;
  std::uint64_t shown_at = 0;
};

struct SentSnapshot {
  RegionId from;
  replication::ReceivedSnapshot snapshot;
};

class ShootingRange {
 public:
  explicit ShootingRange(const LagSettings& settings)
      : settings_(settings),
        random_(settings.seed),
        scene_(ShootingScene()),
        playout_(60, 60.0 / kSnapshotEvery),
        view_(60, kSnapshotEvery) {
    world_ = std::make_unique<Lockstep>(
        scene_, *MakeGridMap(scene_->ground(), 2), region::RegionSettings(), Lockstep::Observer(), [this](RegionId) {
          auto host = game::GameHost::Load(*game::LuaGameModule(), {"lag.lua", kShootingGame}, scene_, {}, 1);
          if (!host.ok()) throw std::runtime_error(host.status().ToString());
          return hosts_.emplace_back(*std::move(host));
        });
    world_->region(0).SpawnPlayer(kShooter, "ada");
  }

  LagShots Run() {
    for (int tick = 1; result_.answered < settings_.shots; ++tick) {
      if (tick > 20 * kTicksBetweenShots * (settings_.shots + 100)) throw std::runtime_error("shots are not answered");
      now_s_ = tick / 60.0;
      world_->Tick();
      for (const auto& host : hosts_) {
        for (const game::GameLine& line : host->TakeLines()) throw std::runtime_error("the game: " + line.text);
      }
      if (tick % kSnapshotEvery == 0) SendSnapshots();
      // A frame of the client, between two ticks.
      const double frame_s = now_s_ + 0.007;
      snapshots_.Deliver(frame_s, [this](double at_s, const SentSnapshot& sent) { Show(at_s, sent); });
      shown_tick_ = playout_.Advance(At(frame_s));
      if (tick > 240 && tick % kTicksBetweenShots == 0 && result_.shots < settings_.shots) Shoot(frame_s);
      commands_.Deliver(now_s_ + 1 / 60.0, [this](double, const SentShot& shot) { Arrive(shot); });
      TakeEvents();
    }
    return result_;
  }

 private:
  static TimePoint At(double seconds) {
    return TimePoint(std::chrono::duration_cast<TimePoint::duration>(std::chrono::duration<double>(seconds)));
  }
  double OneWay() {
    const double jitter = std::uniform_real_distribution<>(-1, 1)(random_) * settings_.jitter_s;
    return settings_.round_trip_s / 2 + jitter;
  }

  void SendSnapshots() {
    for (std::size_t i = 0; i < world_->size(); ++i) {
      const region::Region& region = world_->region(i);
      SentSnapshot sent{region.id(), {}};
      sent.snapshot.tick = region.tick();
      for (const region::OwnedBody& body : region.owned()) {
        replication::BodyRecord record;
        record.id = body.def->id;
        record.epoch = body.epoch;
        record.state = body.state;
        sent.snapshot.bodies.push_back(record);
      }
      snapshots_.Send(now_s_ + OneWay(), std::move(sent));
    }
  }

  void Show(double at_s, const SentSnapshot& sent) {
    std::vector<client::ClientEvent> events;
    playout_.Arrived(At(at_s), sent.snapshot.tick);
    view_.Take(At(at_s), sent.from, sent.snapshot, events);
  }

  // At the middle of what is shown.
  void Shoot(double at_s) {
    std::optional<Vec3d> middle;
    for (const client::ShownBody& body : view_.At(shown_tick_, 60)) {
      if (body.id == kTarget) middle = body.pose.position;
    }
    if (!middle) return;
    const Vec3d way = *middle - kMuzzle, along = way / Length(way);
    const Vec3d to = kMuzzle + along * (Length(way) + 20);
    const std::uint32_t number = ++last_;
    aimed_[number] = *middle - along * kRadius_m;
    ++result_.shots;
    result_.across += world_->region(0).Owns(kTarget) ? 0 : 1;
    commands_.Send(
        at_s + OneWay(),
        {number, fmt::format("{} {} {:.9f} {:.9f} {:.9f}", number, settings_.rewind ? 1 : 0, to.x, to.y, to.z),
         ShownAt(shown_tick_)});
  }

  // Commands may overtake each other on the line; the SDK gives them in order.
  void Arrive(const SentShot& shot) {
    arrived_.emplace(shot.number, shot);
    while (!arrived_.empty() && arrived_.begin()->first == taken_ + 1) {
      const SentShot& next = arrived_.begin()->second;
      const absl::Status status = world_->region(0).TakeCommand(kShooter, {1, next.number, next.bytes, next.shown_at});
      if (!status.ok()) throw std::runtime_error(status.ToString());
      ++taken_;
      arrived_.erase(arrived_.begin());
    }
  }

  void TakeEvents() {
    const game::PlayerRecord* const talk = world_->region(0).TalkOf(kShooter);
    if (talk == nullptr || talk->events.empty()) return;
    const std::vector<game::PlayerEvent> events = talk->events;
    world_->region(0).AcknowledgeEvents(kShooter, talk->last_event);
    for (const game::PlayerEvent& event : events) {
      const auto fields = game::DecodeFields(event.values);
      if (!fields.ok()) throw std::runtime_error(fields.status().ToString());
      std::map<std::string, game::GameValue> values(fields->begin(), fields->end());
      const auto number = static_cast<std::uint32_t>(std::get<std::int64_t>(values.at("number")));
      ++result_.answered;
      if (!std::get<bool>(values.at("complete"))) ++result_.incomplete;
      if (!std::get<bool>(values.at("hit"))) {
        ++result_.missed;
        continue;
      }
      const double off_m = Length(std::get<Vec3d>(values.at("point")) - aimed_.at(number));
      result_.worst_m = std::max(result_.worst_m, off_m);
      if (off_m <= kNear_m) ++result_.near;
    }
  }

  const LagSettings settings_;
  std::mt19937_64 random_;
  std::shared_ptr<const Scene> scene_;
  std::vector<std::shared_ptr<game::GameHost>> hosts_;
  std::unique_ptr<Lockstep> world_;
  client::PlayoutClock playout_;
  client::WorldView view_;
  LagLine<SentSnapshot> snapshots_;
  LagLine<SentShot> commands_;
  std::map<std::uint32_t, SentShot> arrived_;
  std::map<std::uint32_t, Vec3d> aimed_;  // where the ray meets what was shown, by the number of the shot
  double now_s_ = 0, shown_tick_ = 0;
  std::uint32_t last_ = 0, taken_ = 0;
  LagShots result_;
};

}  // namespace

LagShots ShootWithLag(const LagSettings& settings) { return ShootingRange(settings).Run(); }

void MeasureLagHits(bool quick, Report& report) {
  for (const bool rewind : {true, false}) {
    LagSettings settings;
    settings.shots = quick ? 100 : 1'000;
    settings.rewind = rewind;
    const LagShots shots = ShootWithLag(settings);
    const std::string config = fmt::format("rewind={}", rewind ? 1 : 0);
    const auto share = [&](int count) { return static_cast<double>(count) / shots.shots; };
    report.Add("lag", "tessera", config, "lag_hit_share", share(shots.near), "1");
    report.Add("lag", "tessera", config, "lag_across_share", share(shots.across), "1");
    report.Add("lag", "tessera", config, "lag_incomplete_share", share(shots.incomplete), "1");
  }
}

}  // namespace tessera::bench
