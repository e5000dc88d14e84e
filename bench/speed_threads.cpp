#include "bench/speed_threads.h"

#include <fmt/format.h>

#include <cstdio>
#include <string>
#include <vector>

#include "bench/statistics.h"

namespace tessera::bench {
namespace {

// Steps of one engine before the other's turn: the fewer, the more often a chunk goes undisturbed; but in the first
// ones of each turn the other's memory has to make way.
constexpr int kTurnSteps = 5;

// Chunks of both runs in which neither was disturbed.
struct FairChunks {
  std::vector<double> ratios;
  double ours_s = 0, theirs_s = 0;
  double steps() const { return static_cast<double>(ratios.size()) * kTurnSteps; }
};

FairChunks FairChunksOf(const CrowdRunner& ours, const CrowdRunner& theirs) {
  FairChunks fair;
  for (std::size_t i = 0; i < ours.chunks.size(); ++i) {
    if (!ours.chunks[i].undisturbed || !theirs.chunks[i].undisturbed) continue;
    fair.ratios.push_back(ours.chunks[i].wall_s / theirs.chunks[i].wall_s);
    fair.ours_s += ours.chunks[i].wall_s;
    fair.theirs_s += theirs.chunks[i].wall_s;
  }
  return fair;
}

void ReportRatio(const CrowdCase& test, const std::string& config, const std::string& name, const FairChunks& fair,
                 Report& report) {
  const auto add = [&](const std::string& metric, double value) {
    report.Add(test.name, std::string(EngineName(EngineKind::kTessera)), config, metric, value, "1");
  };
  add(name + "_chunks", static_cast<double>(fair.ratios.size()));
  if (fair.ratios.empty()) return;
  add(name + "_ratio", Median(fair.ratios));
  add(name + "_ratio_p10", Quantile(fair.ratios, 0.1));
  add(name + "_ratio_p90", Quantile(fair.ratios, 0.9));
}

absl::Status RunPeer(const CrowdCase& test, const Scene& scene, EngineKind kind, int threads, Report& report) {
  const std::string peer(EngineName(kind));
  fmt::print(stderr, "speed: {} against {}, {} thread(s), {} steps\n", test.name, peer, threads, test.steps);
  CrowdRunner ours{MakeEngine(EngineKind::kTessera, {.threads = threads}), {}, {}, {}},
      theirs{MakeEngine(kind, {.threads = threads}), {}, {}, {}};
  const absl::Status status = RunTurns(test, scene, kTurnSteps, {&ours, &theirs});
  if (absl::IsUnimplemented(status)) {
    fmt::print(stderr, "speed: {}\n", std::string(status.message()));
    return absl::OkStatus();
  }
  if (!status.ok()) return status;
  const FairChunks fair = FairChunksOf(ours, theirs);
  const std::string config = fmt::format("threads={} steps={} {}={}", threads, test.steps, peer, EngineCommit(kind));
  ReportRatio(test, config, peer, fair, report);
  report.Add(test.name, std::string(ours.engine->name()), config, peer + "_counts",
             NoWorse(ours.outcome, theirs.outcome) ? 1 : 0, "1");
  for (const CrowdRunner* runner : {&ours, &theirs}) {
    const double taken_s = runner == &ours ? fair.ours_s : fair.theirs_s;
    if (!fair.ratios.empty()) {
      report.Add(test.name, std::string(runner->engine->name()), config, "step_ms", 1e3 * taken_s / fair.steps(), "ms");
    }
    ReportOutcome(test, *runner, config, report);
  }
  if (!fair.ratios.empty()) {
    fmt::print(stderr, "speed: {}: {:.2f} of {}'s time, {} of {} chunks count\n", test.name, Median(fair.ratios), peer,
               fair.ratios.size(), ours.chunks.size());
  }
  return absl::OkStatus();
}

}  // namespace

absl::Status RunThreads(const CrowdCase& test, int threads, Report& report) {
  const Scene scene = test.scene();
  fmt::print(stderr, "speed: {}, one thread and {}, {} steps\n", test.name, threads, test.steps);
  CrowdRunner together{MakeEngine(EngineKind::kTessera, {.threads = threads}), {}, {}, {}},
      alone{MakeEngine(EngineKind::kTessera, {}), {}, {}, {}};
  if (absl::Status status = RunTurns(test, scene, kTurnSteps, {&together, &alone}); !status.ok()) return status;
  int unlike = 0;
  for (const BodyDef& body : scene.bodies) {
    if (alone.engine->StateOf(body.id) != together.engine->StateOf(body.id)) ++unlike;
  }
  const std::string config = fmt::format("threads={} steps={}", threads, test.steps);
  const auto add = [&](const std::string& metric, double value, const std::string& unit) {
    report.Add(test.name, std::string(EngineName(EngineKind::kTessera)), config, metric, value, unit);
  };
  const FairChunks fair = FairChunksOf(together, alone);
  ReportRatio(test, config, "threads", fair, report);
  add("threads_unlike", unlike, "1");
  if (fair.ratios.empty()) return absl::OkStatus();
  add("threads_step_ms", 1e3 * fair.ours_s / fair.steps(), "ms");
  add("one_thread_step_ms", 1e3 * fair.theirs_s / fair.steps(), "ms");
  fmt::print(stderr, "speed: {}: {:.2f} of one thread's time, {} of {} chunks count\n", test.name, Median(fair.ratios),
             fair.ratios.size(), alone.chunks.size());
  return absl::OkStatus();
}

absl::Status RunPeers(const CrowdCase& test, Report& report) {
  for (const EngineKind kind : {EngineKind::kBox3d, EngineKind::kJolt}) {
    if (!EngineBuilt(kind)) continue;
    const Scene scene = test.scene();
    for (const int threads : {1, 2}) {
      if (absl::Status status = RunPeer(test, scene, kind, threads, report); !status.ok()) return status;
    }
  }
  return absl::OkStatus();
}

}  // namespace tessera::bench
