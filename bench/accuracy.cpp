#include "bench/accuracy.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>

#include "bench/accuracy_scenes.h"
#include "bench/front.h"
#include "bench/plot.h"
#include "bench/thread_cpu.h"

namespace tessera::bench {
namespace {

// A trial this short is repeated, and its least time counts.
constexpr double kShort_s = 0.05;
constexpr int kRepeats = 5;

std::vector<double> StepRates(Sweep sweep, bool quick) {
  if (sweep == Sweep::kNone) return {60};
  if (quick) return {60, 240};
  return {5, 10, 15, 20, 30, 60, 120, 240, 480, 960};
}

std::vector<EngineConfig> ConfigsOf(EngineKind engine, const AccuracyScene& scene, double hz, bool quick) {
  std::vector<EngineConfig> configs{{}};
  if (engine == EngineKind::kMujoco && !quick) configs.push_back({.rk4 = true});
  if (scene.sweep != Sweep::kSolver || quick) return configs;
  switch (engine) {
    case EngineKind::kTessera:  // beyond 240 Hz a substep more is a step more
      if (hz <= 240) {
        for (const int substeps : {1, 2, 4, 8}) configs.push_back({.substeps = substeps});
      }
      break;
    case EngineKind::kBullet:
      for (const int iterations : {4, 40}) configs.push_back({.iterations = iterations});
      break;
    case EngineKind::kOde:
      for (const int iterations : {5, 80}) configs.push_back({.iterations = iterations});
      if (scene.direct) configs.push_back({.direct = true});
      break;
    case EngineKind::kMujoco:
      break;
    case EngineKind::kBox3d:
      for (const int substeps : {1, 8, 32}) configs.push_back({.substeps = substeps});
      break;
    case EngineKind::kJolt:
      for (const int iterations : {4, 40}) configs.push_back({.iterations = iterations});
      break;
  }
  return configs;
}

// The least CPU time of a few runs; they all come to the same error.
absl::StatusOr<Outcome> BestOf(const AccuracyScene& scene, const Trial& trial, bool quick) {
  absl::StatusOr<Outcome> best;
  for (int i = 0; i < (quick ? 1 : kRepeats); ++i) {
    const double begin = ThreadCpuSeconds();
    absl::StatusOr<Outcome> outcome = scene.run(trial);
    if (!outcome.ok()) return outcome;
    if (i > 0) outcome->cpu_us = std::min(outcome->cpu_us, best->cpu_us);
    best = std::move(outcome);
    if (ThreadCpuSeconds() - begin > kShort_s) break;
  }
  return best;
}

class SceneSweep {
 public:
  SceneSweep(const AccuracyScene& scene, const SuiteOptions& options, Report& report)
      : scene_(scene), options_(options), report_(report) {}

  absl::Status Run() {
    for (const EngineKind engine : {EngineKind::kTessera, EngineKind::kBullet, EngineKind::kOde, EngineKind::kMujoco,
                                    EngineKind::kBox3d, EngineKind::kJolt}) {
      if (!EngineBuilt(engine) || (engine == EngineKind::kMujoco && !scene_.mujoco)) continue;
      std::fprintf(stderr, "accuracy: %s in %s\n", scene_.name.c_str(), std::string(EngineName(engine)).c_str());
      if (absl::Status status = RunEngine(engine); !status.ok()) return status;
    }
    return Conclude();
  }

 private:
  absl::Status RunEngine(EngineKind engine) {
    for (const double hz : StepRates(scene_.sweep, options_.quick)) {
      for (const EngineConfig& config : ConfigsOf(engine, scene_, hz, options_.quick)) {
        const Trial trial{.engine = engine, .config = config, .hz = hz};
        const absl::StatusOr<Outcome> outcome = BestOf(scene_, trial, options_.quick);
        if (absl::IsUnimplemented(outcome.status())) {
          std::fprintf(stderr, "accuracy: %s\n", std::string(outcome.status().message()).c_str());
          return absl::OkStatus();
        }
        if (!outcome.ok()) return outcome.status();
        Note(trial, *outcome);
      }
    }
    return absl::OkStatus();
  }

  void Note(const Trial& trial, const Outcome& outcome) {
    const std::string engine(EngineName(trial.engine)), config = ConfigName(trial);
    report_.Add(scene_.name, engine, config, "error", outcome.error, "1");
    for (const Outcome::Part& part : outcome.parts) {
      report_.Add(scene_.name, engine, config, part.metric, part.value, part.unit);
    }
    report_.Add(scene_.name, engine, config, "cpu_us_per_tick", outcome.cpu_us, "us");
    offers_[trial.engine].push_back({outcome.error, outcome.cpu_us});
  }

  absl::Status Conclude() {
    if (scene_.sweep == Sweep::kNone) return absl::OkStatus();
    std::map<EngineKind, std::vector<Offer>> fronts;
    std::vector<Curve> curves;
    for (const auto& [engine, offers] : offers_) {
      fronts[engine] = FrontOf(offers, scene_.floor, scene_.worst);
      curves.push_back({std::string(EngineName(engine)), offers, fronts[engine]});
    }
    bool ahead = true;
    for (const EngineKind peer : {EngineKind::kBullet, EngineKind::kOde, EngineKind::kBox3d, EngineKind::kJolt}) {
      if (!fronts.contains(peer)) continue;
      const bool ahead_of_peer = Dominates(fronts[EngineKind::kTessera], fronts[peer]);
      report_.Add(scene_.name, "tessera", fmt::format("against {}", EngineName(peer)), "front_ahead", ahead_of_peer,
                  "1");
      // The goal names the two that every build can have; how it stands with the others is told beside it.
      if (peer == EngineKind::kBullet || peer == EngineKind::kOde) ahead = ahead && ahead_of_peer;
    }
    report_.Add(scene_.name, "tessera", "sweep", "front_dominated", ahead, "1");
    if (options_.csv.empty()) return absl::OkStatus();
    return PlotCurves(PlotPath(options_.csv, scene_.name), scene_.name, scene_.error_is, curves);
  }

  const AccuracyScene& scene_;
  const SuiteOptions& options_;
  Report& report_;
  std::map<EngineKind, std::vector<Offer>> offers_;
};

}  // namespace

absl::Status RunAccuracy(const SuiteOptions& options, Report& report) {
  for (const auto& part : {FlightScenes(), BallScenes(), SolidScenes()}) {
    for (const AccuracyScene& scene : part) {
      if (scene.name.find(options.only) == std::string::npos) continue;
      if (absl::Status status = SceneSweep(scene, options, report).Run(); !status.ok()) return status;
    }
  }
  return absl::OkStatus();
}

}  // namespace tessera::bench
