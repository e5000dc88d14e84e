#include "bench/speed.h"

#include <fmt/format.h>
#include <sys/resource.h>

#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <functional>
#include <string>
#include <vector>

#include "bench/engine.h"
#include "bench/penetration.h"
#include "bench/statistics.h"
#include "scenes/measured/crowds.h"
#include "scenes/measured/stacks.h"

namespace tessera::bench {
namespace {

constexpr double kDt_s = 1.0 / 60;
constexpr int kChunk = 10;           // steps of one engine before the other's turn
constexpr int kSamples = 5;          // samples of penetration, over the last fifth
constexpr int kCreepSteps = 60;      // over which what lies still is watched
constexpr double kNoWorse_m = 1e-4;  // differences of lengths below this are no differences: float positions of these
                                     // worlds are as coarse as 1e-5
constexpr double kFallen_m = -3;     // no ground of these scenes is as low

using States = std::vector<BodyState>;

// Outcome of a run beside its time.
struct Outcome {
  double mean_m = 0, deepest_m = 0;  // penetration
  double drift_m = 0;
  double mean_height_m = 0;  // mean over the centres of all dynamic bodies
  int fallen = 0;
};

struct Case {
  std::string name;
  std::function<Scene()> scene;
  int steps = 500;
  // Drift from the states at the end and those kCreepSteps before.
  std::function<double(const Scene&, const States& before, const States& end)> drift;
};

// One engine in its run.
struct Runner {
  std::unique_ptr<Engine> engine;
  std::vector<double> chunks_s;
  States before;
  Outcome outcome;

  double total_s() const {
    double sum = 0;
    for (const double chunk : chunks_s) sum += chunk;
    return sum;
  }
};

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

void SamplePenetration(const Scene& scene, const Yardstick& yardstick, Runner& runner) {
  const Penetration now = yardstick.Measure(StatesOf(*runner.engine, scene));
  runner.outcome.mean_m += now.mean_per_body_m / kSamples;
  runner.outcome.deepest_m = std::max(runner.outcome.deepest_m, now.deepest_m);
}

void Conclude(const Case& test, const Scene& scene, Runner& runner) {
  const States end = StatesOf(*runner.engine, scene);
  Outcome& outcome = runner.outcome;
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

void RunChunk(int steps, Runner& runner) {
  double time_s = 0;
  for (int i = 0; i < steps; ++i) time_s += TimedStep(*runner.engine, kDt_s);
  runner.chunks_s.push_back(time_s);
}

bool NoWorse(const Outcome& ours, const Outcome& theirs) {
  return ours.mean_m <= theirs.mean_m + kNoWorse_m && ours.deepest_m <= theirs.deepest_m + kNoWorse_m &&
         ours.drift_m <= theirs.drift_m + kNoWorse_m && ours.fallen <= theirs.fallen;
}

void ReportPair(const Case& test, std::size_t bodies, const Runner& tessera, const Runner& bullet, Report& report) {
  const std::string config = fmt::format("n={} steps={}", bodies, test.steps);
  const auto add = [&](const Runner& runner, const std::string& metric, double value, const std::string& unit) {
    report.Add(test.name, std::string(runner.engine->name()), config, metric, value, unit);
  };
  std::vector<double> ratios;
  for (std::size_t i = 0; i < tessera.chunks_s.size(); ++i) ratios.push_back(tessera.chunks_s[i] / bullet.chunks_s[i]);
  add(tessera, "time_ratio", Median(ratios), "1");
  add(tessera, "time_ratio_p10", Quantile(ratios, 0.1), "1");
  add(tessera, "time_ratio_p90", Quantile(ratios, 0.9), "1");
  add(tessera, "time_ratio_total", tessera.total_s() / bullet.total_s(), "1");
  add(tessera, "counts", NoWorse(tessera.outcome, bullet.outcome) ? 1 : 0, "1");
  for (const Runner* runner : {&tessera, &bullet}) {
    add(*runner, "step_ms", 1e3 * runner->total_s() / test.steps, "ms");
    add(*runner, "penetration_mean_m", runner->outcome.mean_m, "m");
    add(*runner, "penetration_deepest_m", runner->outcome.deepest_m, "m");
    add(*runner, "drift_m", runner->outcome.drift_m, "m");
    add(*runner, "mean_height_m", runner->outcome.mean_height_m, "m");
    add(*runner, "fallen_through", runner->outcome.fallen, "1");
  }
}

absl::Status RunCase(const Case& test, Report& report) {
  const Scene scene = test.scene();
  const std::size_t bodies = scene.bodies.size() - 1;  // but for the ground
  fmt::print(stderr, "speed: {}, {} bodies, {} steps\n", test.name, bodies, test.steps);
  Runner tessera{MakeEngine(EngineKind::kTessera, {}), {}, {}, {}},
      bullet{MakeEngine(EngineKind::kBullet, {}), {}, {}, {}};
  for (Runner* runner : {&tessera, &bullet}) {
    if (absl::Status status = runner->engine->Load(scene); !status.ok()) return status;
  }
  const Yardstick yardstick(scene);
  const int chunks = test.steps / kChunk, creep_from = chunks - kCreepSteps / kChunk;
  const int sample_every = std::max(1, chunks / 5 / kSamples),
            first_sample = chunks - 1 - (kSamples - 1) * sample_every;
  for (int chunk = 0; chunk < chunks; ++chunk) {
    std::array<Runner*, 2> order{&tessera, &bullet};
    if (chunk % 2 == 1) std::swap(order[0], order[1]);
    for (Runner* runner : order) {
      if (chunk == creep_from) runner->before = StatesOf(*runner->engine, scene);
    }
    for (Runner* runner : order) RunChunk(kChunk, *runner);
    if (chunk >= first_sample && (chunk - first_sample) % sample_every == 0) {
      for (Runner* runner : order) SamplePenetration(scene, yardstick, *runner);
    }
  }
  Conclude(test, scene, tessera);
  Conclude(test, scene, bullet);
  ReportPair(test, bodies, tessera, bullet, report);
  fmt::print(stderr, "speed: {}: {:.2f} ms a step against {:.2f}\n", test.name, 1e3 * tessera.total_s() / test.steps,
             1e3 * bullet.total_s() / test.steps);
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
      if (i % 2 == 0) full_s = TimedStep(*full, kDt_s);
      bare_s = TimedStep(*bare, kDt_s);
      if (i % 2 == 1) full_s = TimedStep(*full, kDt_s);
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

// --- Threads: what several threads make of a step, by the clock.

struct Timed {
  double wall_s = 0;
  long switches = 0;  // all threads of this process together, against their will
};

Timed TimeChunk(Engine& engine) {
  const auto switches = [] {
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    return usage.ru_nivcsw;
  };
  const long before = switches();
  const auto begin = std::chrono::steady_clock::now();
  for (int i = 0; i < kChunk; ++i) engine.Step(kDt_s);
  const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - begin;
  return {taken.count(), switches() - before};
}

// One world with one thread and the same with `threads`, in turns. A chunk counts only if both had their processors to
// themselves.
absl::Status RunThreads(const Case& test, int threads, Report& report) {
  const Scene scene = test.scene();
  fmt::print(stderr, "speed: {}, one thread and {}, {} steps\n", test.name, threads, test.steps);
  const auto alone = MakeEngine(EngineKind::kTessera, {}),
             together = MakeEngine(EngineKind::kTessera, {.threads = threads});
  for (Engine* engine : {alone.get(), together.get()}) {
    if (absl::Status status = engine->Load(scene); !status.ok()) return status;
  }
  std::vector<double> ratios;
  double alone_s = 0, together_s = 0;
  const int chunks = test.steps / kChunk;
  for (int chunk = 0; chunk < chunks; ++chunk) {
    Timed one, many;
    if (chunk % 2 == 0) one = TimeChunk(*alone);
    many = TimeChunk(*together);
    if (chunk % 2 == 1) one = TimeChunk(*alone);
    if (one.switches + many.switches > 0) continue;
    ratios.push_back(many.wall_s / one.wall_s);
    alone_s += one.wall_s;
    together_s += many.wall_s;
  }
  int unlike = 0;
  for (const BodyDef& body : scene.bodies) {
    if (alone->StateOf(body.id) != together->StateOf(body.id)) ++unlike;
  }
  const std::string config = fmt::format("threads={} steps={}", threads, test.steps);
  const auto add = [&](const std::string& metric, double value, const std::string& unit) {
    report.Add(test.name, std::string(EngineName(EngineKind::kTessera)), config, metric, value, unit);
  };
  add("threads_chunks", static_cast<double>(ratios.size()), "1");
  add("threads_unlike", unlike, "1");
  if (ratios.empty()) return absl::OkStatus();
  const double steps = static_cast<double>(ratios.size()) * kChunk;
  add("threads_ratio", Median(ratios), "1");
  add("threads_ratio_p10", Quantile(ratios, 0.1), "1");
  add("threads_ratio_p90", Quantile(ratios, 0.9), "1");
  add("threads_step_ms", 1e3 * together_s / steps, "ms");
  add("one_thread_step_ms", 1e3 * alone_s / steps, "ms");
  fmt::print(stderr, "speed: {}: {:.2f} of one thread's time, {} of {} chunks count\n", test.name, Median(ratios),
             ratios.size(), chunks);
  return absl::OkStatus();
}

}  // namespace

absl::Status RunSpeed(const SuiteOptions& options, Report& report) {
  const bool quick = options.quick;
  const int crowd = quick ? 1000 : 4000, steps = quick ? 300 : 500;
  const Case cases[] = {
      {"pyramid", [=] { return scenes::Pyramid(quick ? 9 : 15); }, steps, PyramidDrift},
      {"rain", [=] { return scenes::Rain(crowd, scenes::kRainSpacing_m); }, steps, BoxCreep},
      {"dense", [=] { return scenes::Rain(crowd, scenes::kDenseSpacing_m); }, steps, BoxCreep},
      {"mesh", [=] { return quick ? scenes::ConvexOnMesh(11, 2) : scenes::ConvexOnMesh(); }, steps, BoxCreep},
      {"many_pyramids", [=] { return quick ? scenes::ManyPyramids(5) : scenes::ManyPyramids(); }, quick ? 100 : 200,
       DriftFromStart},
  };
  for (const Case& test : cases) {
    if (test.name.find(options.only) == std::string::npos) continue;
    if (absl::Status status = RunCase(test, report); !status.ok()) return status;
  }
  for (const Case& test : cases) {
    const bool asked = options.only.empty() || options.only.starts_with("threads");
    if (!asked || fmt::format("threads_{}", test.name).find(options.only) == std::string::npos) continue;
    if (absl::Status status = RunThreads(test, 2, report); !status.ok()) return status;
  }
  if (std::string("asleep").find(options.only) == std::string::npos) return absl::OkStatus();
  return RunAsleep(quick, report);
}

}  // namespace tessera::bench
