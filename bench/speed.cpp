#include "bench/speed.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

#include "bench/crowd_run.h"
#include "bench/speed_threads.h"
#include "bench/statistics.h"
#include "scenes/measured/crowds.h"
#include "scenes/measured/stacks.h"

namespace tessera::bench {
namespace {

constexpr int kChunk = 10;  // steps of one engine before the other's turn

template <class Place>
double RmsDistance(const Scene& scene, const States& states, Place place) {
  double sum = 0;
  int count = 0;
  for (std::size_t i = 0; i < states.size(); ++i) {
    if (scene.bodies[i].motion != Motion::kDynamic) continue;
    sum += LengthSquared(states[i].position - place(scene.bodies[i].initial.position));
    ++count;
  }
  return std::sqrt(sum / count);
}

// Where a pyramid's cubes should have come to lie: the air between its layers is gone.
double PyramidDrift(const Scene& scene, const States&, const States& end) {
  return RmsDistance(scene, end, [](Vec3d start) {
    const double layer = std::round((start.y - 1) / 2.5);
    return Vec3d{start.x, 1 + 2 * layer, start.z};
  });
}

double DriftFromStart(const Scene& scene, const States&, const States& end) {
  return RmsDistance(scene, end, [](Vec3d start) { return start; });
}

// Balls roll as they please, and push others; but most boxes of a heap should lie still: how far the middle one of them
// moved in the last second.
double BoxCreep(const Scene& scene, const States& before, const States& end) {
  std::vector<double> moved;
  for (std::size_t i = 0; i < end.size(); ++i) {
    if (scene.bodies[i].motion == Motion::kDynamic && std::holds_alternative<BoxShape>(scene.bodies[i].shape->form)) {
      moved.push_back(Length(end[i].position - before[i].position));
    }
  }
  return Median(std::move(moved));
}

double CpuSeconds(const CrowdRunner& runner) {
  double sum = 0;
  for (const ChunkTime& chunk : runner.chunks) sum += chunk.cpu_s;
  return sum;
}

void ReportPair(const CrowdCase& test, std::size_t bodies, const CrowdRunner& tessera, const CrowdRunner& bullet,
                Report& report) {
  const std::string config = fmt::format("n={} steps={}", bodies, test.steps);
  const auto add = [&](const CrowdRunner& runner, const std::string& metric, double value, const std::string& unit) {
    report.Add(test.name, std::string(runner.engine->name()), config, metric, value, unit);
  };
  std::vector<double> ratios;
  for (std::size_t i = 0; i < tessera.chunks.size(); ++i) {
    ratios.push_back(tessera.chunks[i].cpu_s / bullet.chunks[i].cpu_s);
  }
  add(tessera, "time_ratio", Median(ratios), "1");
  add(tessera, "time_ratio_p10", Quantile(ratios, 0.1), "1");
  add(tessera, "time_ratio_p90", Quantile(ratios, 0.9), "1");
  add(tessera, "time_ratio_total", CpuSeconds(tessera) / CpuSeconds(bullet), "1");
  add(tessera, "counts", NoWorse(tessera.outcome, bullet.outcome) ? 1 : 0, "1");
  for (const CrowdRunner* runner : {&tessera, &bullet}) {
    add(*runner, "step_ms", 1e3 * CpuSeconds(*runner) / test.steps, "ms");
    ReportOutcome(test, *runner, config, report);
  }
}

absl::Status RunCase(const CrowdCase& test, Report& report) {
  const Scene scene = test.scene();
  const std::size_t bodies = scene.bodies.size() - 1;  // but for the ground
  fmt::print(stderr, "speed: {}, {} bodies, {} steps\n", test.name, bodies, test.steps);
  CrowdRunner tessera{MakeEngine(EngineKind::kTessera, {}), {}, {}, {}},
      bullet{MakeEngine(EngineKind::kBullet, {}), {}, {}, {}};
  if (absl::Status status = RunTurns(test, scene, kChunk, {&tessera, &bullet}); !status.ok()) return status;
  ReportPair(test, bodies, tessera, bullet, report);
  fmt::print(stderr, "speed: {}: {:.2f} ms a step against {:.2f}\n", test.name, 1e3 * CpuSeconds(tessera) / test.steps,
             1e3 * CpuSeconds(bullet) / test.steps);
  return absl::OkStatus();
}

// --- Sleepers: what 50 000 boxes asleep add to a step of 100 rolling balls.

absl::Status RunAsleep(bool quick, Report& report) {
  constexpr int kSleepers = 50'000, kRollers = 100, kWarmUp = 20;  // the first steps find the pairs
  const int steps = quick ? 60 : 240;
  fmt::print(stderr, "speed: asleep, {} sleepers, {} steps\n", kSleepers, steps);
  const Scene with = scenes::SleepersBesideRollers(kSleepers, kRollers).scene;
  const Scene without = scenes::SleepersBesideRollers(0, kRollers).scene;
  const std::string config = fmt::format("n={} steps={}", kSleepers, steps);
  for (const EngineKind kind : {EngineKind::kTessera, EngineKind::kBullet}) {
    const auto full = MakeEngine(kind, {.sleep = true}), bare = MakeEngine(kind, {.sleep = true});
    if (absl::Status status = full->Load(with); !status.ok()) return status;
    if (absl::Status status = bare->Load(without); !status.ok()) return status;
    std::vector<double> full_ms, bare_ms, cost_ms;
    for (int i = 0; i < kWarmUp + steps; ++i) {
      double full_s = 0, bare_s = 0;
      if (i % 2 == 0) full_s = TimedStep(*full, kCrowdDt_s);
      bare_s = TimedStep(*bare, kCrowdDt_s);
      if (i % 2 == 1) full_s = TimedStep(*full, kCrowdDt_s);
      if (i < kWarmUp) continue;
      full_ms.push_back(1e3 * full_s);
      bare_ms.push_back(1e3 * bare_s);
      cost_ms.push_back(1e3 * (full_s - bare_s));
    }
    int awake = 0;
    for (const BodyDef& body : with.bodies) {
      if (body.may_sleep && body.motion == Motion::kDynamic && !full->StateOf(body.id).asleep) ++awake;
    }
    const auto add = [&](const std::string& metric, double value, const std::string& unit) {
      report.Add("asleep", std::string(EngineName(kind)), config, metric, value, unit);
    };
    add("sleepers_cost_ms", Median(full_ms) - Median(bare_ms), "ms");
    add("sleepers_cost_ms_p10", Quantile(cost_ms, 0.1), "ms");
    add("sleepers_cost_ms_p90", Quantile(cost_ms, 0.9), "ms");
    add("step_ms", Median(full_ms), "ms");
    add("step_without_sleepers_ms", Median(bare_ms), "ms");
    add("sleepers_awake_at_end", awake, "1");
  }
  return absl::OkStatus();
}

// Whether a part whose name begins so is to run: if it is asked for by that beginning, or everything is.
bool Asked(const SuiteOptions& options, const std::string& begin, const std::string& scene) {
  if (options.only.empty()) return true;
  return options.only.starts_with(begin.substr(0, options.only.size())) &&
         (begin + scene).find(options.only) != std::string::npos;
}

}  // namespace

absl::Status RunSpeed(const SuiteOptions& options, Report& report) {
  const bool quick = options.quick;
  const int crowd = quick ? 1000 : 4000, steps = quick ? 300 : 500;
  const CrowdCase cases[] = {
      {"pyramid", [=] { return scenes::Pyramid(quick ? 9 : 15); }, steps, PyramidDrift},
      {"rain", [=] { return scenes::Rain(crowd, scenes::kRainSpacing_m); }, steps, BoxCreep},
      {"dense", [=] { return scenes::Rain(crowd, scenes::kDenseSpacing_m); }, steps, BoxCreep},
      {"mesh", [=] { return quick ? scenes::ConvexOnMesh(11, 2) : scenes::ConvexOnMesh(); }, steps, BoxCreep},
      {"many_pyramids", [=] { return quick ? scenes::ManyPyramids(5) : scenes::ManyPyramids(); }, quick ? 100 : 200,
       DriftFromStart},
  };
  for (const CrowdCase& test : cases) {
    if (test.name.find(options.only) == std::string::npos) continue;
    if (absl::Status status = RunCase(test, report); !status.ok()) return status;
  }
  // Those with threads are asked for as threads_pyramid, and those against peers as peers_pyramid.
  for (const CrowdCase& test : cases) {
    if (Asked(options, "threads_", test.name)) {
      if (absl::Status status = RunThreads(test, 2, report); !status.ok()) return status;
    }
    if (Asked(options, "peers_", test.name)) {
      if (absl::Status status = RunPeers(test, report); !status.ok()) return status;
    }
  }
  if (std::string("asleep").find(options.only) == std::string::npos) return absl::OkStatus();
  return RunAsleep(quick, report);
}

}  // namespace tessera::bench
