// CrowdRun: two engines in the same scene of many bodies, turn about, with what the very same runs came to.
//
// Turns are chunks of steps, A B B A, so that whatever else the machine does meets both alike. An engine that lets
// bodies overlap, creep or fall through saves work; so a comparison of times counts only if the outcome is no worse.
//
// Thread rule: one thread at a time, which steps both engines.
#pragma once

#include <array>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "bench/chunk_clock.h"
#include "bench/engine.h"
#include "bench/report.h"

namespace tessera::bench {

inline constexpr double kCrowdDt_s = 1.0 / 60;

using States = std::vector<BodyState>;

// Outcome of a run beside its time.
struct CrowdOutcome {
  double mean_m = 0, deepest_m = 0;  // penetration, over the last fifth of the run
  double drift_m = 0;
  double mean_height_m = 0;  // mean over the centres of all dynamic bodies
  int fallen = 0;
};

struct CrowdCase {
  std::string name;
  std::function<Scene()> scene;
  int steps = 500;
  // Drift from the states at the end and those a second before.
  std::function<double(const Scene&, const States& before, const States& end)> drift;
};

// One engine in its run.
struct CrowdRunner {
  std::unique_ptr<Engine> engine;
  std::vector<ChunkTime> chunks;
  States before;
  CrowdOutcome outcome;
};

// Loads both engines and steps them through the case, by chunks of so many steps.
absl::Status RunTurns(const CrowdCase& test, const Scene& scene, int chunk_steps, std::array<CrowdRunner*, 2> runners);

// None of ours is worse than theirs, but for differences that floats of such worlds do not hold.
bool NoWorse(const CrowdOutcome& ours, const CrowdOutcome& theirs);

// Rows of an outcome.
void ReportOutcome(const CrowdCase& test, const CrowdRunner& runner, const std::string& config, Report& report);

}  // namespace tessera::bench
