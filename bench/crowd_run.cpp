#include "bench/crowd_run.h"

#include <algorithm>
#include <utility>

#include "bench/penetration.h"

namespace tessera::bench {
namespace {

constexpr int kSamples = 5;          // samples of penetration, over the last fifth
constexpr int kCreepSteps = 60;      // over which what lies still is watched
constexpr double kNoWorse_m = 1e-4;  // differences of lengths below this are no differences: float positions of these
                                     // worlds are as coarse as 1e-5
constexpr double kFallen_m = -3;     // no ground of these scenes is as low

void SamplePenetration(const Scene& scene, const Yardstick& yardstick, CrowdRunner& runner) {
  const Penetration now = yardstick.Measure(StatesOf(*runner.engine, scene));
  runner.outcome.mean_m += now.mean_per_body_m / kSamples;
  runner.outcome.deepest_m = std::max(runner.outcome.deepest_m, now.deepest_m);
}

void Conclude(const CrowdCase& test, const Scene& scene, CrowdRunner& runner) {
  const States end = StatesOf(*runner.engine, scene);
  CrowdOutcome& outcome = runner.outcome;
  outcome.drift_m = test.drift(scene, runner.before, end);
  int count = 0;
  for (std::size_t i = 0; i < end.size(); ++i) {
    if (scene.bodies[i].motion != Motion::kDynamic) continue;
    ++count;
    outcome.mean_height_m += end[i].position.y;
    if (!(end[i].position.y >= kFallen_m)) ++outcome.fallen;  // or not a number
  }
  outcome.mean_height_m /= count;
}

}  // namespace

absl::Status RunTurns(const CrowdCase& test, const Scene& scene, int chunk_steps, std::array<CrowdRunner*, 2> runners) {
  for (CrowdRunner* runner : runners) {
    if (absl::Status status = runner->engine->Load(scene); !status.ok()) return status;
  }
  const Yardstick yardstick(scene);
  const int chunks = test.steps / chunk_steps, creep_from = chunks - kCreepSteps / chunk_steps;
  const int sample_every = std::max(1, chunks / 5 / kSamples),
            first_sample = chunks - 1 - (kSamples - 1) * sample_every;
  for (int chunk = 0; chunk < chunks; ++chunk) {
    std::array<CrowdRunner*, 2> order = runners;
    if (chunk % 2 == 1) std::swap(order[0], order[1]);
    for (CrowdRunner* runner : order) {
      if (chunk == creep_from) runner->before = StatesOf(*runner->engine, scene);
    }
    for (CrowdRunner* runner : order) runner->chunks.push_back(TimeSteps(*runner->engine, chunk_steps, kCrowdDt_s));
    if (chunk >= first_sample && (chunk - first_sample) % sample_every == 0) {
      for (CrowdRunner* runner : order) SamplePenetration(scene, yardstick, *runner);
    }
  }
  for (CrowdRunner* runner : runners) Conclude(test, scene, *runner);
  return absl::OkStatus();
}

bool NoWorse(const CrowdOutcome& ours, const CrowdOutcome& theirs) {
  return ours.mean_m <= theirs.mean_m + kNoWorse_m && ours.deepest_m <= theirs.deepest_m + kNoWorse_m &&
         ours.drift_m <= theirs.drift_m + kNoWorse_m && ours.fallen <= theirs.fallen;
}

void ReportOutcome(const CrowdCase& test, const CrowdRunner& runner, const std::string& config, Report& report) {
  const auto add = [&](const std::string& metric, double value, const std::string& unit) {
    report.Add(test.name, std::string(runner.engine->name()), config, metric, value, unit);
  };
  add("penetration_mean_m", runner.outcome.mean_m, "m");
  add("penetration_deepest_m", runner.outcome.deepest_m, "m");
  add("drift_m", runner.outcome.drift_m, "m");
  add("mean_height_m", runner.outcome.mean_height_m, "m");
  add("fallen_through", runner.outcome.fallen, "1");
}

}  // namespace tessera::bench
