// Scenes 9 to 12: towers and pyramids, the chain, and a shot that rebounds.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "bench/accuracy_scenes.h"
#include "bench/chain_watch.h"
#include "scenes/measured/impacts.h"
#include "scenes/measured/stacks.h"

namespace tessera::bench {
namespace {

// How far the bodies end below where they were built, by share of the height of the scene.
absl::StatusOr<Outcome> Sinking(const Trial& trial, const Scene& scene) {
  absl::StatusOr<Run> run = Run::Start(trial, scene);
  if (!run.ok()) return run.status();
  run->Seconds(10);
  double sink = 0, moved = 0, height = 0;
  for (const BodyDef& body : scene.bodies) {
    if (body.motion == Motion::kStatic) continue;
    const BodyState state = run->StateOf(body.id);
    if (!IsFinite(state)) sink = kBroken;
    sink = std::max(sink, std::abs(body.initial.position.y - state.position.y));
    moved = std::max(
        moved, std::hypot(state.position.x - body.initial.position.x, state.position.z - body.initial.position.z));
    height = std::max(height, body.initial.position.y + 0.5);
  }
  return Outcome{sink / height, {{"sink_m", sink, "m"}, {"drift_m", moved, "m"}}, run->cpu_us_per_tick()};
}

absl::StatusOr<Outcome> Chain(const Trial& trial, double ratio) {
  absl::StatusOr<ChainFigures> figures = SwingChain(trial, ratio);
  if (!figures.ok()) return figures.status();
  return Outcome{std::isfinite(figures->gap_m) ? figures->gap_m : kBroken,
                 {{"chain_gap_m", figures->gap_m, "m"}, {"chain_period_error", figures->period_error, "1"}},
                 figures->cpu_us};
}

// Restitution 1: the ball comes back as fast as it went.
absl::StatusOr<Outcome> Rebound(const Trial& trial) {
  constexpr double kSpeed = 500;
  constexpr int kShots = 8;
  double worst = 0, cpu_us = 0;
  for (int i = 0; i < kShots; ++i) {
    const scenes::Shot shot = scenes::ShotAtWall(kSpeed, 0.1, (i + 0.5) / kShots, 1);
    absl::StatusOr<Run> run = Run::Start(trial, shot.scene);
    if (!run.ok()) return run.status();
    run->Seconds(0.2);
    const BodyState state = run->StateOf(shot.bullet);
    worst = std::max(worst, IsFinite(state) ? std::abs(state.linear_velocity.x / kSpeed + 1) : kBroken);
    cpu_us += run->cpu_us_per_tick() / kShots;
  }
  return Outcome{worst, {{"rebound_error", worst, "1"}}, cpu_us};
}

}  // namespace

std::vector<AccuracyScene> SolidScenes() {
  std::vector<AccuracyScene> scenes;
  for (const double ratio : {1.0, 100.0, 1000.0}) {
    scenes.push_back({.name = fmt::format("chain_{:g}", ratio),
                      .error_is = "widest gap at a joint, m",
                      .floor = 1e-6,
                      .run = [ratio](const Trial& trial) { return Chain(trial, ratio); }});
  }
  scenes.push_back({.name = "tower_20",
                    .error_is = "sink after 10 s, share of height",
                    .floor = 1e-5,
                    .run = [](const Trial& trial) { return Sinking(trial, scenes::Tower(20, 0.01)); }});
  scenes.push_back({.name = "mass_ratio_pyramid",
                    .error_is = "sink after 10 s, share of height",
                    .floor = 1e-5,
                    .direct = false,
                    .run = [](const Trial& trial) { return Sinking(trial, scenes::MassRatioPyramid(10, 200)); }});
  scenes.push_back(
      {.name = "rebound", .error_is = "speed after rebound, relative error", .floor = 1e-6, .run = Rebound});
  return scenes;
}

}  // namespace tessera::bench
