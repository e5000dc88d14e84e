#include "bench/soak.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <optional>
#include <string>
#include <vector>

#include "bench/soak_figures.h"
#include "bench/soak_stage.h"
#include "bench/soak_turns.h"

namespace tessera::bench {
namespace {

constexpr const char *kSoakScene = "plaza", *kSoakEngine = "tessera";
constexpr double kSoakMinutes = 60, kQuickSoakMinutes = 2;
constexpr double kTurn_s = 15, kLine_s = 60;
// A short run has samples closer by, so that its windows hold some.
constexpr double kSample_s = 10, kShortestSample_s = 1, kSamplesAtLeast = 60;
constexpr std::uint64_t kSoakSeed = 25;
constexpr SoakSize kFullSoak{.bodies = 2000, .groups = 8}, kQuickSoak{.bodies = 500, .groups = 2};

std::string Percent(const std::optional<double>& share) {
  return share ? fmt::format("{:+.2f} %", 100 * *share) : "not known yet";
}

void AddCounts(const SoakStage& stage, double run_s, Report& report) {
  const auto add = [&](const char* metric, std::uint64_t value) {
    report.Set(kSoakScene, kSoakEngine, "all", metric, static_cast<double>(value), "1");
  };
  const SoakCounts& counts = stage.counts();
  report.Set(kSoakScene, kSoakEngine, "all", "soak_run", run_s, "s");
  add("soak_turns", counts.turns);
  add("soak_failed", counts.failed);
  add("soak_deaths", counts.deaths);
  add("soak_joins", stage.joins());
  add("soak_scales", counts.scales);
  add("soak_checkpoints", counts.checkpoints);
  add("soak_properties", counts.properties);
  add("soak_spawned", counts.spawned);
  add("soak_lost_bodies", counts.lost);
  add("soak_duplicated_bodies", counts.duplicated);
  add("soak_taken_out_bodies", counts.taken_out);
  add("soak_groups_failed", stage.players_failed());
  add("soak_left_running", counts.left_running);
}

void AddFigures(const SoakFigures& figures, const SoakSteps& steps, Report& report) {
  const auto add = [&](const std::string& config, const char* metric, const std::optional<double>& value,
                       const char* unit = "1") {
    if (value) report.Set(kSoakScene, kSoakEngine, config, metric, *value, unit);
  };
  add("all", "soak_counts", figures.windows.counts ? 1 : 0);
  add("all", "soak_memory_growth", figures.memory_growth());
  add("all", "soak_handles_growth", figures.handles_growth());
  add("all", "soak_step_p99_ratio", figures.step_p99_ratio);
  for (const auto& [process, growth] : figures.throughout) {
    // As a rule one worker lives throughout: the oldest one is not killed.
    const std::string config = process.starts_with(kSoakWorker) ? "process=oldest-worker" : "process=" + process;
    add(config, "soak_memory", growth.memory->late, "bytes");
    add(config, "soak_memory_growth", growth.memory->Share());
    add(config, "soak_descriptors_growth", growth.descriptors->Difference());
    add(config, "soak_threads_growth", growth.threads->Difference());
  }
  add("process=workers", "soak_workers", figures.workers_measured);
  add("process=workers", "soak_memory_growth_an_hour", figures.worker_memory_slope);
  add("process=workers", "soak_descriptors_growth_an_hour", figures.worker_descriptors_slope);
  for (const int regions : steps.loads()) {
    const std::string config = fmt::format("regions={}", regions);
    const SoakWindows& windows = figures.windows;
    add(config, "soak_step_p99_early", steps.P99(regions, windows.early_begin_s, windows.early_end_s), "s");
    add(config, "soak_step_p99_late", steps.P99(regions, windows.late_begin_s, windows.late_end_s), "s");
  }
}

// Each process with all that it holds now, in a line.
std::string NewestOf(const std::vector<SoakSeries>& all) {
  std::string text;
  double newest_s = 0, workers = 0, memory_bytes = 0, descriptors = 0;
  for (const SoakSeries& series : all) newest_s = std::max(newest_s, series.samples.back().at_s);
  for (const SoakSeries& series : all) {
    const SoakSample& last = series.samples.back();
    if (last.at_s < newest_s) continue;
    if (!series.process.starts_with(kSoakWorker)) {
      text += fmt::format("; {} {} in {} descriptors, {} threads", series.process, Human(last.memory_bytes, "bytes"),
                          last.descriptors, last.threads);
      continue;
    }
    ++workers;
    memory_bytes += last.memory_bytes;
    descriptors += last.descriptors;
  }
  if (workers == 0) return text;
  return text + fmt::format("; {} workers {} in {:.0f} descriptors on average", workers,
                            Human(memory_bytes / workers, "bytes"), descriptors / workers);
}

absl::Status TellSoak(const SoakStage& stage, double run_s, double minutes, Report& report) {
  const std::vector<SoakSeries> all = stage.meter().series();
  const SoakFigures figures = FiguresOf(all, stage.meter().steps(), run_s);
  const SoakCounts& counts = stage.counts();
  std::cerr << fmt::format(
      "soak: minute {:.0f} of {:g}: {} turns, {} deaths, {} scales, {} joins, {} failed, {} lost; "
      "memory {}, workers {} an hour, p99 of a step {}{}\n",
      run_s / 60, minutes, counts.turns, counts.deaths, counts.scales, stage.joins(), counts.failed, counts.lost,
      Percent(figures.memory_growth()), Percent(figures.worker_memory_slope),
      figures.step_p99_ratio ? fmt::format("{:.2f} x", *figures.step_p99_ratio) : "not known yet", NewestOf(all));
  AddCounts(stage, run_s, report);
  AddFigures(figures, stage.meter().steps(), report);
  return report.Save();
}

absl::Status PlaySoak(SoakStage& stage, double minutes, Report& report) {
  const double run_s = 60 * minutes;
  // More than there can be.
  const auto turns = DrawSoakTurns(kSoakSeed, static_cast<std::size_t>(std::ceil(run_s / kTurn_s)) + 1);
  double next_turn_s = 0, next_line_s = kLine_s;
  for (const SoakTurn& turn : turns) {
    if (absl::Status status = stage.RestUntil(std::min(next_turn_s, run_s)); !status.ok()) return status;
    if (stage.run_s() >= run_s) return absl::OkStatus();
    next_turn_s = std::max(next_turn_s, stage.run_s()) + kTurn_s;
    if (absl::Status status = stage.Take(turn); !status.ok()) return status;
    if (stage.run_s() < next_line_s) continue;
    while (next_line_s <= stage.run_s()) next_line_s += kLine_s;
    if (absl::Status status = TellSoak(stage, stage.run_s(), minutes, report); !status.ok()) return status;
  }
  return stage.RestUntil(run_s);
}

}  // namespace

absl::Status RunSoak(const SuiteOptions& options, Report& report) {
  const double minutes = options.minutes > 0 ? options.minutes : options.quick ? kQuickSoakMinutes : kSoakMinutes;
  SoakSize size = options.quick ? kQuickSoak : kFullSoak;
  size.interval_s = std::clamp(60 * minutes / kSamplesAtLeast, kShortestSample_s, kSample_s);
  if (!WindowsOf(60 * minutes).counts) {
    std::cerr << "soak: so short a run holds windows of a fifth of it against each other, and does not count\n";
  }
  cli::StopSignal stop;  // before there are other threads
  SoakStage stage(size, stop);
  absl::Status status = stage.Begin();
  if (status.ok()) status = PlaySoak(stage, minutes, report);
  const double run_s = stage.run_s();
  stage.End();
  status.Update(TellSoak(stage, run_s, minutes, report));
  return status;
}

}  // namespace tessera::bench
