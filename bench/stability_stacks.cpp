// Stability of stacks: towers, loads, pyramids, other shapes, and an hour of it.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "bench/penetration.h"
#include "bench/stability_stage.h"
#include "scenes/measured/builder.h"
#include "scenes/measured/impacts.h"
#include "scenes/measured/stacks.h"

namespace tessera::bench {
namespace {

// A stack has fallen when its highest body has lost a tenth of its height or a body has gone half a metre aside.
constexpr double kFallen = 0.9, kAside_m = 0.5;

// Height of the uppermost body's top, as built 1; `half_m` is half of one body's height.
double HeightRatio(const Run& run, const Scene& scene, double half_m) {
  const BodyDef& top = scene.bodies.back();
  const double y = run.StateOf(top.id).position.y;
  return std::isfinite(y) ? (y + half_m) / (top.initial.position.y + half_m) : 0;
}

struct StackFigures {
  double height_ratio = 1, drift_m = 0, residual_m_s = 0, cpu_us = 0;
  bool standing = true;
};

// Runs a stack, and looks at its speed over the last two seconds. Ends early once it has fallen.
absl::StatusOr<StackFigures> Stand(const StabilityStage& stage, const Scene& scene, double half_m, double seconds) {
  absl::StatusOr<Run> run = stage.Start(scene);
  if (!run.ok()) return run.status();
  StackFigures figures;
  while (run->time_s() < seconds - 2.01 && figures.standing) {
    run->Seconds(1);
    figures.standing = HeightRatio(*run, scene, half_m) > kFallen;
  }
  for (int tick = 0; tick < 120; ++tick) {
    run->Tick();
    figures.residual_m_s = std::max(figures.residual_m_s, FastestOf(*run, scene));
  }
  figures.height_ratio = HeightRatio(*run, scene, half_m);
  figures.drift_m = DisplacementOf(*run, scene).sideways_m;
  figures.standing = figures.standing && figures.height_ratio > kFallen && figures.drift_m < kAside_m;
  figures.cpu_us = run->cpu_us_per_tick();
  return figures;
}

absl::Status Towers(StabilityStage& stage) {
  constexpr double kJitter_m = 0.01;
  const bool stock = stage.engine() == EngineKind::kBullet;
  for (const int n : {10, 20, 40, 80}) {
    if (stage.quick() && n != 20) continue;
    if (stock && n > 20) continue;  // it has fallen long before
    const int seeds = stage.Repeats(10, 2);
    StackFigures worst;
    int standing = 0;
    for (int seed = 1; seed <= seeds; ++seed) {
      const Scene scene = scenes::Tower(n, kJitter_m, static_cast<std::uint64_t>(seed));
      const absl::StatusOr<StackFigures> one = Stand(stage, scene, 0.5, stage.quick() ? 10 : 60);
      if (!one.ok()) return one.status();
      standing += one->standing;
      worst.height_ratio = std::min(worst.height_ratio, one->height_ratio);
      worst.drift_m = std::max(worst.drift_m, one->drift_m);
      worst.residual_m_s = std::max(worst.residual_m_s, one->residual_m_s);
      worst.cpu_us += one->cpu_us / seeds;
    }
    const std::string config = fmt::format("n={}", n);
    stage.Note("tower", config, "tower_standing", static_cast<double>(standing) / seeds);
    stage.Note("tower", config, "tower_height_ratio", worst.height_ratio);
    stage.Note("tower", config, "tower_residual_speed", worst.residual_m_s, "m/s");
    stage.Note("tower", config, "tower_drift_m", worst.drift_m, "m");
    stage.Cost("tower", config, worst.cpu_us);
  }
  return absl::OkStatus();
}

void NoteStack(StabilityStage& stage, const std::string& scene, const std::string& config, const StackFigures& figures,
               const std::string& height_metric = "height_ratio") {
  stage.Note(scene, config, "standing", figures.standing);
  stage.Note(scene, config, height_metric, figures.height_ratio);
  stage.Note(scene, config, "drift_m", figures.drift_m, "m");
  stage.Note(scene, config, "residual_speed", figures.residual_m_s, "m/s");
  stage.Cost(scene, config, figures.cpu_us);
}

absl::Status MassRatios(StabilityStage& stage) {
  for (const double ratio : {10.0, 100.0, 1000.0}) {
    const absl::StatusOr<StackFigures> figures = Stand(stage, scenes::LoadedStack(10, ratio), 0.5, 10);
    if (!figures.ok()) return figures.status();
    NoteStack(stage, "mass_ratio", fmt::format("ratio={:g}", ratio), *figures, "mass_ratio_height_ratio");
  }
  return absl::OkStatus();
}

// Far more than substeps alone hold, standing straight and under a pull that leans by a degree.
absl::Status Loads(StabilityStage& stage) {
  constexpr double kDegree_rad = 0.017453292519943295;
  for (const double ratio : {1500.0, 3000.0, 10000.0}) {
    double lowest = 1;
    for (const double size : {0.2, 1.0}) {
      for (const int n : {5, 10, 20}) {
        for (const double lean : {0.0, kDegree_rad}) {
          if (stage.quick() && (n != 10 || ratio != 3000)) continue;
          const Scene scene = scenes::HeavyLoadStack({.n = n, .size_m = size, .ratio = ratio, .lean_rad = lean});
          const absl::StatusOr<StackFigures> figures = Stand(stage, scene, size / 2, stage.quick() ? 10 : 60);
          if (!figures.ok()) return figures.status();
          const std::string config =
              fmt::format("ratio={:g} n={} size={:g} lean={:d}", ratio, n, size, static_cast<int>(lean > 0));
          NoteStack(stage, "load", config, *figures, "load_height_ratio");
          lowest = std::min(lowest, figures->height_ratio);
        }
      }
    }
    if (!stage.quick() || ratio == 3000) {
      stage.Note("load", fmt::format("ratio={:g}", ratio), "load_height_ratio", lowest);
    }
  }
  return absl::OkStatus();
}

// A body that was squeezed out, and came past the end of the wall, is not behind it.
bool BehindWall(const Run& run, BodyId body) {
  const Vec3d position = run.StateOf(body).position;
  return !(position.x < 0 || std::abs(position.z) > 2 || position.y > 4);
}

// A body that a heavy one presses against a thin wall stays on its side of it, and so does the heavy one.
absl::Status Presses(StabilityStage& stage) {
  for (const double newtons : {500.0, 3000.0, 20000.0}) {
    for (const double heavy : {10.0, 100.0}) {
      double through = 0, deepest = 0, cpu_us = 0;
      int runs = 0;
      for (const bool ball : {false, true}) {
        for (const double gap : {0.0, 0.1}) {
          const Scene scene = scenes::PressAgainstWall({.heavy_kg = heavy, .gap_m = gap, .ball = ball});
          absl::StatusOr<Run> run = stage.Start(scene);
          if (!run.ok()) return run.status();
          run->Push(scenes::kPresser, {static_cast<float>(newtons), 0, 0});
          const Yardstick yardstick(scene);
          bool inside = true;
          for (int tick = 0; tick < (stage.quick() ? 150 : 600); ++tick) {
            run->Tick();
            inside = inside && !BehindWall(*run, scenes::kPressed) && !BehindWall(*run, scenes::kPresser);
            if (tick % 15 != 0) continue;
            deepest = std::max(deepest, yardstick.Measure(StatesOf(run->engine(), scene)).deepest_m);
          }
          through += inside ? 0 : 1;
          cpu_us += run->cpu_us_per_tick();
          ++runs;
        }
      }
      const std::string config = fmt::format("newtons={:g} heavy={:g}", newtons, heavy);
      stage.Note("press", config, "pressed_through", through / runs);
      stage.Note("press", config, "deepest_m", deepest, "m");
      stage.Cost("press", config, cpu_us / runs);
    }
  }
  return absl::OkStatus();
}

absl::Status MassRatioPyramids(StabilityStage& stage) {
  for (const double density : {100.0, 200.0, 300.0}) {
    const Scene scene = scenes::MassRatioPyramid(10, density);
    absl::StatusOr<Run> run = stage.Start(scene);
    if (!run.ok()) return run.status();
    const Yardstick yardstick(scene);
    double deepest = 0;
    for (int look = 0; look < 40; ++look) {
      run->Seconds(0.25);
      deepest = std::max(deepest, yardstick.Measure(StatesOf(run->engine(), scene)).deepest_m);
    }
    const Displacement moved = DisplacementOf(*run, scene);
    const std::string config = fmt::format("apex={:g}", density);
    stage.Note("mass_ratio_pyramid", config, "standing", moved.any_m < 0.5);
    stage.Note("mass_ratio_pyramid", config, "deepest_m", deepest, "m");
    stage.Note("mass_ratio_pyramid", config, "sink_m", moved.down_m, "m");
    stage.Note("mass_ratio_pyramid", config, "drift_m", moved.sideways_m, "m");
    stage.Cost("mass_ratio_pyramid", config, run->cpu_us_per_tick());
  }
  return absl::OkStatus();
}

absl::Status OtherShapes(StabilityStage& stage) {
  struct Case {
    const char* name;
    ShapePtr shape;
    double half_m, mass_kg;
    int n;
  };
  const Case cases[] = {{"cylinders", scenes::CylinderOf(0.5, 0.5), 0.5, 1, 10},
                        {"hulls", scenes::EightSidedPrism(0.5, 0.5), 0.5, 1, 10},
                        {"boxes_5cm", scenes::BoxOf(0.025, 0.025, 0.025), 0.025, 0.1, 10},
                        {"cards_1mm", scenes::BoxOf(0.03, 0.0005, 0.045), 0.0005, 0.002, 20}};
  for (const Case& one : cases) {
    const Scene scene = scenes::ShapeStack(one.shape, 2 * one.half_m, one.mass_kg, one.n);
    const absl::StatusOr<StackFigures> figures = Stand(stage, scene, one.half_m, stage.quick() ? 5 : 20);
    if (!figures.ok()) return figures.status();
    NoteStack(stage, one.name, fmt::format("n={}", one.n), *figures);
  }
  return absl::OkStatus();
}

// A tower, and a box on a slope at nine tenths of what friction holds. What it creeps, by the hour.
absl::Status Creep(StabilityStage& stage) {
  const double seconds = stage.quick() ? 60 : 3600;
  for (const bool slope : {false, true}) {
    const Scene scene = slope ? scenes::SlopeAtLimit(0.9) : scenes::Tower(5, 0.01);
    absl::StatusOr<Run> run = stage.Start(scene);
    if (!run.ok()) return run.status();
    run->Seconds(2);  // to settle
    std::vector<Vec3d> settled;
    for (const BodyDef& body : scene.bodies) settled.push_back(run->StateOf(body.id).position);
    run->Seconds(seconds);
    double crept = 0;
    for (std::size_t i = 0; i < settled.size(); ++i) {
      crept = std::max(crept, Length(run->StateOf(scene.bodies[i].id).position - settled[i]));
    }
    const std::string name = slope ? "creep_slope" : "creep_tower";
    const std::string config = fmt::format("seconds={:g}", seconds);
    stage.Note(name, config, "creep_m_per_hour", crept * 3600 / seconds, "m");
    stage.Cost(name, config, run->cpu_us_per_tick());
  }
  return absl::OkStatus();
}

}  // namespace

std::vector<Check> StackChecks() {
  return {{"tower", Towers, true},
          {"mass_ratio", MassRatios, true},
          {"load", Loads},
          {"press", Presses},
          {"mass_ratio_pyramid", MassRatioPyramids, true},
          {"shapes", OtherShapes, true},
          {"creep", Creep}};
}

}  // namespace tessera::bench
