// PredictionLoop: a region, a client's prediction of its own body, and the network between them, in virtual time. For
// tests, and for the figure of corrections that docs/benchmarks.md has.
//
//   Loop loop("", {.delay = std::chrono::milliseconds(60)});
//   loop.force = {10, 0, 0};
//   loop.Run(2);
//   EXPECT_LT(loop.WorstSince(Tick(60)), 0.01);
//
// Thread rule: one thread.
#pragma once

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "client_sdk/delay_line.h"
#include "client_sdk/input_clock.h"
#include "client_sdk/input_queue.h"
#include "client_sdk/predictor.h"
#include "core/game/game_host.h"
#include "core/region/region.h"
#include "core/replication/movement_news.h"
#include "core/replication/quantize.h"
#include "core/world/scene_io.h"

namespace tessera::client::prediction {

using std::chrono::milliseconds;

inline constexpr int kHz = 60;
inline constexpr PlayerNumber kPlayer{1};
inline constexpr BodyId kOwn = PlayerBodyId(kPlayer);

inline constexpr const char* kRolledBall =
    "player { body { mass: 2 shape { sphere { radius: 0.5 } } } spawn_points { y: 0.5 } max_force: 30 max_speed: 8 }";
inline constexpr const char* kCharacter = R"(
    player { body { mass: 80 shape { capsule { radius: 0.35 half_height: 0.55 } } } spawn_points { y: 0.9 }
             spawn_points { x: 1.5 y: 0.9 z: -6 } spawn_points { x: -3 y: 0.9 z: -2 }
             character { walk_speed: 4 run_speed: 7 jump_speed: 4.5 } })";

inline std::shared_ptr<const Scene> SceneOf(const std::string& more, const char* player) {
  const auto written = ParseScene(R"(name: "floor" bounds { min { x: -50 y: -5 z: -50 } max { x: 50 y: 50 z: 50 } }
    bodies { id: 1 motion: MOTION_STATIC pose { position { y: -0.5 } } shape { box { half_extents { x: 50 y: 0.5 z: 50 } } } }
    )" + more + player,
                                  "floor.textproto");
  if (!written.ok()) throw std::runtime_error(written.status().ToString());
  return *ResolveScene(*written, "floor.textproto");
}

inline void Prepare(Predictor& predictor, const BodyState& own) {
  WorkBudget budget(100'000);
  predictor.Prepare(own, budget);
}

// A region, a client's part of prediction, and the network between them.
struct Loop {
  struct Report {
    Tick tick;
    std::uint32_t last_input = 0;
    std::int32_t margin = 0;
    std::vector<SeenBody> bodies;
    std::optional<replication::MovementNews> moved;  // as datagrams of their own: see `loses_movements`
  };

  // `module`: a game that the region runs; it outlives this.
  Loop(const std::string& more, const NetworkConditions& conditions_in, const char* player = kRolledBall,
       const tessera_game_module* module = nullptr)
      : conditions(conditions_in),
        scene(SceneOf(more, player)),
        quantizer(scene->bounds, replication::SnapshotSettingsFor(*scene)),
        region({.self = RegionId(1),
                .incarnation = Incarnation(1),
                .scene = scene,
                .map = *MakeGridMap(scene->ground(), 1),
                .settings = {},
                .game = module == nullptr ? nullptr : *game::GameHost::Load(*module, {"game", ""}, scene)}),
        predictor(scene, kPlayer) {
    region.Start();
    region.SpawnPlayer(kPlayer);
    LoseBy(0);
  }
  // Another draw of what the network loses.
  void LoseBy(std::uint64_t seed) {
    down.Seed(2 * seed + 1);
    up.Seed(2 * seed + 2);
  }

  // Calls `frame` after each millisecond.
  void Run(double seconds, const std::function<void()>& frame = {}) {
    for (int i = 0; i < static_cast<int>(seconds * 1000); ++i) {
      now += milliseconds(1);
      ++elapsed_ms;
      Serve();
      Play();
      if (frame) frame();
    }
  }

  void Serve() {
    for (const std::vector<PlayerInput>& message : up.Take(now)) {
      for (const PlayerInput& input : message) {
        if (input.number <= newest_input) continue;
        newest_input = input.number;
        if (input.target != Tick()) margin = static_cast<std::int32_t>(input.target - (region.tick() + 1));
        if (!region.QueueInput(input).ok()) ++refused;
      }
    }
    if (elapsed_ms * kHz / 1000 == static_cast<int>(region.tick().value())) return;
    if (before_step) before_step();
    region.Step();
    if (!region.Owns(kOwn)) return;
    truth[region.tick()] = region.world().StateOf(kOwn).position;
    if (region.tick().value() % 2 != 0) return;
    Report report{region.tick(), region.LastInput(kPlayer), margin, {}, {}};
    if (const auto moved = region.MovementOf(kPlayer); moved && (!loses_movements || ++movements % 3 == 0)) {
      report.moved = {region.tick(), moved->movement.name, moved->state};
    }
    for (const region::OwnedBody& body : region.owned()) {
      if (body.def->id == hidden) continue;
      report.bodies.push_back({body.def->id, RegionId(1), body.epoch, region.tick(), AsShown(body.state)});
    }
    down.Put(now, std::move(report), conditions);
  }

  void Play() {
    for (const Report& report : down.Take(now)) {
      if (applied && report.tick <= applied->tick) continue;
      for (const SeenBody& body : report.bodies) seen[body.id] = body;
      applied = report;
      clock.Applied(now, report.last_input, report.margin);
      if (const auto own = seen.find(kOwn); own != seen.end()) Prepare(predictor, own->second.state);
      if (report.moved) predictor.TakeMovement(*report.moved);
      predictor.Correct(report.tick, report.last_input, seen);
    }
    if (!applied) return;
    for (int due = clock.Due(now, kHz); due > 0; --due) {
      const std::uint32_t number = ++made;
      clock.Made(number);
      PlayerInput input = AsSent(steering);
      input.number = number;
      input.player = kPlayer;
      input.body = kOwn;
      input.target = applied->tick + (number - applied->last_input);
      input.force_n = force;
      predictor.Add(input);
      predicted[predictor.tick()] = predictor.own().position;
      Send(input);
    }
  }
  // Each input in three messages, one a tick.
  void Send(const PlayerInput& input) {
    queue.Push(input);
    up.Put(now, queue.Select([](BodyId) { return true; }), conditions);
    queue.Sent(now);
  }
  // Rounded as snapshots do.
  BodyState AsShown(const BodyState& state) const {
    return rounds ? quantizer.Dequantize(quantizer.Quantize(state)) : state;
  }
  // How often what was predicted came to be off by more than 1 cm.
  int TimesOff(Tick from) const {
    int times = 0;
    bool off = false;
    for (auto it = predicted.lower_bound(from); it != predicted.end(); ++it) {
      const auto came = truth.find(it->first);
      if (came == truth.end()) continue;
      const bool is_off = Length(came->second - it->second) > 0.01;
      times += is_off && !off ? 1 : 0;
      off = is_off;
    }
    return times;
  }
  // Largest distance of what was predicted from what came, over the ticks from `from` on that both know.
  double WorstSince(Tick from) const {
    double worst = 0;
    for (auto it = predicted.lower_bound(from); it != predicted.end(); ++it) {
      const auto came = truth.find(it->first);
      if (came != truth.end()) worst = std::max(worst, Length(came->second - it->second));
    }
    return worst;
  }
  Vec3d ShownOwn() {
    for (const PredictedBody& body : predictor.At(now, clock.Phase(now))) {
      if (body.id == kOwn) return body.pose.position;
    }
    return {};
  }

  NetworkConditions conditions;
  std::shared_ptr<const Scene> scene;
  replication::Quantizer quantizer;
  region::Region region;
  Predictor predictor;
  InputClock clock;
  DelayLine<Report> down;
  DelayLine<std::vector<PlayerInput>> up;
  InputQueue queue;
  TimePoint now{std::chrono::hours(1)};
  int elapsed_ms = 0;
  std::uint32_t newest_input = 0, made = 0, refused = 0;
  std::int32_t margin = 0;
  std::map<BodyId, SeenBody> seen;
  std::optional<Report> applied;
  std::map<Tick, Vec3d> truth, predicted;
  BodyId hidden;  // the client does not get this one
  Vec3f force;
  PlayerInput steering;               // beside `force`
  std::function<void()> before_step;  // called before the region's step
  bool rounds = false;                // states as the wire has them
  bool loses_movements = false;       // two of three news of the movement are lost
  std::uint32_t movements = 0;
};

// Steps, a ramp and walls to walk about.
inline constexpr const char* kCourse = R"(
    bodies { id: 2 motion: MOTION_STATIC pose { position { x: 4 y: 0.1 } } shape { box { half_extents { x: 2 y: 0.1 z: 6 } } } }
    bodies { id: 3 motion: MOTION_STATIC pose { position { x: 5 y: 0.2 } } shape { box { half_extents { x: 1 y: 0.2 z: 6 } } } }
    bodies { id: 4 motion: MOTION_STATIC pose { position { x: -5 y: 0.1 } orientation { z: -0.19867 w: 0.98007 } }
             shape { box { half_extents { x: 3 y: 0.1 z: 6 } } } }
    bodies { id: 5 motion: MOTION_STATIC pose { position { y: 1 z: -7 } } shape { box { half_extents { x: 9 y: 1 z: 0.5 } } } }
    bodies { id: 6 motion: MOTION_STATIC pose { position { y: 1 z: 7 } } shape { box { half_extents { x: 9 y: 1 z: 0.5 } } } })";

// A walk around the middle: another way every 30 ticks, a run and a jump now and then.
inline PlayerInput CourseStep(int step, Vec3d at, bool jumps) {
  PlayerInput input;
  const bool far = std::hypot(at.x, at.z) > 7;
  input.yaw_rad = static_cast<float>(far ? std::atan2(at.x, at.z) : 2.4 * step);
  input.move = {step % 3 == 0 ? 0.5F : 0.0F, step % 7 == 6 ? 0.0F : 1.0F};
  input.buttons = (step % 5 == 2 ? kRunButton : 0) | (jumps && step % 4 == 3 ? kJumpButton : 0);
  return input;
}

struct Figures {
  double seconds = 0;
  int off = 0;
  std::uint64_t corrections = 0;
  double worst_m = 0;
};

inline Figures WalkTheCourse(Loop& loop, double seconds, bool jumps) {
  loop.rounds = true;
  loop.steering.move = {0, 1};
  loop.Run(3);  // the clock of inputs finds its pace
  const Tick from = loop.region.tick();
  const std::uint64_t before = loop.predictor.corrections();
  for (int step = 0; step < static_cast<int>(seconds * 2); ++step) {
    loop.steering = CourseStep(step, loop.predictor.own().position, jumps);
    loop.Run(0.5);
  }
  return {seconds, loop.TimesOff(from + 12), loop.predictor.corrections() - before, loop.WorstSince(from + 12)};
}

// The figure that docs/sdk.md has: 100 ms there and back, 5 % lost each way.
inline constexpr NetworkConditions kBadNetwork{.loss = 0.05, .delay = milliseconds(50)};

// Eight crates on the course, and two other players who walk it and run into whoever is in their way.
class CrowdedCourse {
 public:
  static std::string Crates() {
    std::string crates;
    for (int i = 0; i < 8; ++i) {
      crates += "bodies { id: " + std::to_string(20 + i) +
                " mass: 15 pose { position { x: " + std::to_string(3 * std::cos(i * 0.785)) +
                " y: 0.65 z: " + std::to_string(4 * std::sin(i * 0.785)) +
                " } } shape { box { half_extents { x: 0.4 y: 0.4 z: 0.4 } } } }\n";
    }
    return crates;
  }
  // Before each step of the loop's region.
  void MoveOthers(Loop& loop) {
    if (number_ == 0) {
      loop.region.SpawnPlayer(PlayerNumber(2));
      loop.region.SpawnPlayer(PlayerNumber(3));
    }
    ++number_;
    for (const PlayerNumber player : {PlayerNumber(2), PlayerNumber(3)}) {
      if (!loop.region.Owns(PlayerBodyId(player))) continue;
      const Vec3d at = loop.region.world().StateOf(PlayerBodyId(player)).position;
      PlayerInput input =
          AsSent(CourseStep(static_cast<int>(number_ / 40) + 5 * static_cast<int>(player.value()), at, true));
      input.number = number_;
      input.player = player;
      input.body = PlayerBodyId(player);
      if (!loop.region.QueueInput(input).ok()) ++refused_;
    }
  }
  std::uint32_t refused() const { return refused_; }

 private:
  std::uint32_t number_ = 0, refused_ = 0;
};

}  // namespace tessera::client::prediction
