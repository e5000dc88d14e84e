// Prediction against truth: a real region at the other end of a network with a known delay, all in virtual time.
#include <gtest/gtest.h>

#include "absl/strings/str_cat.h"
#include "client_sdk/delay_line.h"
#include "client_sdk/input_clock.h"
#include "client_sdk/predictor.h"
#include "core/region/region.h"
#include "core/world/scene_io.h"

namespace tessera::client {
namespace {

using std::chrono::milliseconds;

constexpr int kHz = 60;
constexpr PlayerNumber kPlayer{1};
constexpr BodyId kOwn = PlayerBodyId(kPlayer);

std::shared_ptr<const Scene> SceneOf(const std::string& more) {
  const auto written = ParseScene(R"(name: "floor" bounds { min { x: -50 y: -5 z: -50 } max { x: 50 y: 50 z: 50 } }
    bodies { id: 1 motion: MOTION_STATIC pose { position { y: -0.5 } } shape { box { half_extents { x: 50 y: 0.5 z: 50 } } } }
    player { body { mass: 2 shape { sphere { radius: 0.5 } } } spawn_points { y: 0.5 } max_force: 30 max_speed: 8 }
    )" + more,
                                  "floor.textproto");
  EXPECT_TRUE(written.ok()) << written.status();
  return *ResolveScene(*written, "floor.textproto");
}

// A region, a client's part of prediction, and the network between them.
struct Loop {
  struct Report {
    Tick tick;
    std::uint32_t last_input = 0;
    std::int32_t margin = 0;
    std::vector<SeenBody> bodies;
  };

  Loop(const std::string& more, const NetworkConditions& conditions_in)
      : conditions(conditions_in),
        scene(SceneOf(more)),
        region({.self = RegionId(1),
                .incarnation = Incarnation(1),
                .scene = scene,
                .map = *MakeGridMap(scene->ground(), 1),
                .settings = {}}),
        predictor(scene, kPlayer) {
    region.Start();
    region.SpawnPlayer(kPlayer);
    down.Seed(1);
    up.Seed(2);
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
    for (const PlayerInput& input : up.Take(now)) {
      if (input.number <= newest_input) continue;
      newest_input = input.number;
      if (input.target != Tick()) margin = static_cast<std::int32_t>(input.target - (region.tick() + 1));
      if (!region.QueueInput(input).ok()) ++refused;
    }
    if (elapsed_ms * kHz / 1000 == static_cast<int>(region.tick().value())) return;
    region.Step();
    if (!region.Owns(kOwn)) return;
    truth[region.tick()] = region.world().StateOf(kOwn).position;
    if (region.tick().value() % 2 != 0) return;
    Report report{region.tick(), region.LastInput(kPlayer), margin, {}};
    for (const region::OwnedBody& body : region.owned()) {
      if (body.def->id == hidden) continue;
      report.bodies.push_back({body.def->id, RegionId(1), body.epoch, region.tick(), body.state});
    }
    down.Put(now, std::move(report), conditions);
  }

  void Play() {
    for (const Report& report : down.Take(now)) {
      if (applied && report.tick <= applied->tick) continue;
      for (const SeenBody& body : report.bodies) seen[body.id] = body;
      applied = report;
      clock.Applied(now, report.last_input, report.margin);
      predictor.Correct(report.tick, report.last_input, seen);
    }
    if (!applied) return;
    for (int due = clock.Due(now, kHz); due > 0; --due) {
      const std::uint32_t number = ++made;
      clock.Made(number);
      const PlayerInput input{.number = number,
                              .player = kPlayer,
                              .body = kOwn,
                              .target = applied->tick + (number - applied->last_input),
                              .force_n = force,
                              .torque_nm = {}};
      predictor.Add(input);
      predicted[predictor.tick()] = predictor.own().position;
      up.PutReliable(now, 0, input, conditions);
    }
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
  region::Region region;
  Predictor predictor;
  InputClock clock;
  DelayLine<Report> down;
  DelayLine<PlayerInput> up;
  TimePoint now{std::chrono::hours(1)};
  int elapsed_ms = 0;
  std::uint32_t newest_input = 0, made = 0, refused = 0;
  std::int32_t margin = 0;
  std::map<BodyId, SeenBody> seen;
  std::optional<Report> applied;
  std::map<Tick, Vec3d> truth, predicted;
  BodyId hidden;  // the client does not get this one
  Vec3f force;
};

// Alone on a floor, steered this way and that, 60 ms away from the server: where it is shown is where it comes to.
TEST(PredictionTest, IsWhatTheServerComesTo) {
  Loop loop("", {.delay = milliseconds(60)});
  loop.Run(1);
  const Tick from = loop.region.tick();
  for (int i = 0; i < 10; ++i) {
    const double angle = 2.4 * i;
    loop.force = Vec3f(Vec3d(25 * std::cos(angle), 0, 25 * std::sin(angle)));
    loop.Run(0.4);
  }
  EXPECT_GT(loop.predicted.rbegin()->first - loop.region.tick(), 2);  // ahead of the server, not only of its news
  EXPECT_GT(loop.predicted.size(), 200u);
  EXPECT_LT(loop.WorstSince(from + 30), 0.001);
  EXPECT_EQ(loop.refused, 0u);
}

TEST(PredictionTest, HoldsUnderJitterOnceInputsAreEarlyEnough) {
  Loop loop("", {.delay = milliseconds(40), .jitter = milliseconds(30)});
  loop.force = {20, 0, 5};
  loop.Run(6);
  EXPECT_GE(loop.clock.margin_ticks(), 1);
  EXPECT_LE(loop.clock.margin_ticks(), 4);
  const Tick from = loop.region.tick();
  for (int i = 0; i < 10; ++i) {
    loop.force = i % 2 == 0 ? Vec3f(-20, 0, 10) : Vec3f(20, 0, -10);
    loop.Run(0.5);
  }
  EXPECT_LT(loop.WorstSince(from), 0.02);
  EXPECT_EQ(loop.refused, 0u);
}

// A wall that ignores the player's layer is no obstacle, neither to the server nor in the prediction; another one is.
TEST(PredictionTest, HonoursCollisionLayers) {
  for (const char* layer : {"glass", "default"}) {
    Loop loop(absl::StrCat(
                  R"(layers { name: "glass" ignores: "default" } bodies { id: 2 motion: MOTION_STATIC layer: ")", layer,
                  R"(" pose { position { x: 3 y: 2 } } shape { box { half_extents { x: 0.2 y: 2 z: 9 } } } })"),
              {.delay = milliseconds(50)});
    loop.force = {20, 0, 0};
    loop.Run(3);
    const bool through = layer == std::string("glass");
    EXPECT_EQ(loop.truth.rbegin()->second.x > 4, through) << layer;
    EXPECT_EQ(loop.predicted.rbegin()->second.x > 4, through) << layer;
    EXPECT_LT(loop.WorstSince(Tick(60)), 0.05) << layer;
  }
}

// A ball that the client could not know of knocks it aside: it glides to where it belongs.
TEST(PredictionTest, ASurpriseIsBlendedAwayWithoutAJump) {
  Loop loop(R"(bodies { id: 2 mass: 4 pose { position { x: 20 y: 0.5 z: 0.3 } } linear_velocity { x: -12 }
               shape { sphere { radius: 0.5 } } })",
            {.delay = milliseconds(50)});
  loop.hidden = BodyId(2);
  Vec3d last;
  double largest_step_m = 0;
  bool known = false;
  loop.Run(4, [&] {
    const Vec3d shown = loop.ShownOwn();
    if (loop.elapsed_ms < 600) {
      last = shown;
      return;
    }
    // Nobody moves at more than 16 m/s here: 16 mm in a millisecond, and a blend of .5 m adds 5.
    largest_step_m = std::max(largest_step_m, Length(shown - last));
    known = known || loop.predictor.corrections() > 0;
    last = shown;
  });
  EXPECT_TRUE(known);
  EXPECT_LT(largest_step_m, 0.025);
  EXPECT_GT(Length(loop.truth.rbegin()->second - Vec3d(0, 0.5, 0)), 1);  // it was knocked away
  const auto came = loop.truth.at(loop.region.tick());
  EXPECT_LT(Length(loop.ShownOwn() - came), 2);  // and is shown there, as far ahead as inputs are
}

TEST(PredictionTest, WhatTheOwnBodyPushesIsShownAtItsOwnTime) {
  Loop loop(
      R"(bodies { id: 2 mass: 1 pose { position { x: 3 y: 0.5 } } shape { box { half_extents { x: 0.5 y: 0.5 z: 0.5 } } } }
               bodies { id: 3 mass: 1 pose { position { x: -9 y: 0.5 } } shape { box { half_extents { x: 0.5 y: 0.5 z: 0.5 } } } })",
      {.delay = milliseconds(50)});
  loop.force = {25, 0, 0};
  bool crate = false, other = false;
  loop.Run(2.5, [&] {
    for (const PredictedBody& body : loop.predictor.At(loop.now, loop.clock.Phase(loop.now))) {
      crate = crate || (body.id == BodyId(2) && body.weight > 0.9);
      other = other || body.id == BodyId(3);
    }
  });
  EXPECT_TRUE(crate);
  EXPECT_FALSE(other);
}

TEST(PredictionTest, AtMostADozenTicksAreSimulatedAnew) {
  Loop loop("", {.delay = milliseconds(300)});
  loop.force = {10, 0, 0};
  loop.Run(2);
  EXPECT_LE(loop.predictor.tick() - loop.applied->tick, static_cast<std::int64_t>(Predictor::kMaxTicks));
}

}  // namespace
}  // namespace tessera::client
