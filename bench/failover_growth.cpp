#include "bench/failover_growth.h"

#include <fmt/format.h>

#include <algorithm>
#include <iostream>
#include <map>

#include "bench/scrape.h"
#include "local_cluster/connection.h"
#include "telemetry/http_get.h"

namespace tessera::bench {
namespace {

using Clock = std::chrono::steady_clock;

constexpr double kTickRate_hz = 60;  // tick rate of the scenes used here
// The gauge of the longest tick speaks of the last 5 to 10 s.
constexpr double kGaugeSpan_s = 10;
constexpr const char* kLongestTick = "tessera_region_longest_tick_seconds";
constexpr const char* kLongestTickCpu = "tessera_region_longest_tick_cpu_seconds";
constexpr const char* kStep = "tessera_region_step_seconds";
// The corner of scenes/rush into which they run, and how many of 100 are to be in it.
constexpr double kCornerEdge_m = -10, kCornerShare = 0.8;
constexpr double kBalancing_s = 10, kWindow_s = 2;

bool HasSettled(const v1::Instance& instance, std::uint32_t regions) {
  return instance.state() == v1::INSTANCE_STATE_RUNNING && instance.changes().empty() &&
         instance.map().regions_size() == static_cast<int>(regions) &&
         instance.region_status_size() == static_cast<int>(regions) &&
         std::ranges::all_of(instance.region_status(), [&](const auto& status) {
           return status.report().map_version() == instance.map().version() && status.report().bodies_outside() == 0;
         });
}

// The longest tick of any region: by the clock, and in CPU time of the stepping thread.
struct LongestTicks {
  double clock_s = 0, cpu_s = 0;

  void Look(FailoverStage& stage) {
    const std::vector<Worker> workers = stage.Workers();
    clock_s = std::max(clock_s, HighestOf(workers, kLongestTick));
    cpu_s = std::max(cpu_s, HighestOf(workers, kLongestTickCpu));
  }
};

// Until all regions run by a map of so many; the longest tick meanwhile, as any of them saw it.
absl::Status ScaleTo(FailoverStage& stage, std::uint32_t regions, LongestTicks& longest) {
  v1::ScaleInstanceRequest request;
  request.set_id(stage.run().instance_id());
  request.set_regions(regions);
  stage.run().connection().Call("instance scale", stage.run().connection().instances(),
                                &v1::InstanceService::Stub::ScaleInstance, request);
  auto next_look = Clock::now();
  const auto look = [&] {
    if (Clock::now() < next_look) return;
    next_look = Clock::now() + std::chrono::milliseconds(500);
    longest.Look(stage);
  };
  absl::Status status = stage.PlayUntil(fmt::format("{} regions", regions), [&] {
    look();
    return HasSettled(stage.run().Latest(), regions);
  });
  if (status.ok()) status = stage.PlayOn();
  longest.Look(stage);
  return status;
}

double ShareInCorner(FailoverStage& stage) {
  double all = 0, there = 0;
  for (const auto& [id, body] : stage.run().bots().front()->client().World()) {
    if (id.value() < 1000) continue;  // walls
    ++all;
    if (body.state.position.x < kCornerEdge_m && body.state.position.z < kCornerEdge_m) ++there;
  }
  return all > 0 ? there / all : 0;
}

std::map<RegionId, Samples> Scrape(FailoverStage& stage) {
  std::map<RegionId, Samples> pages;
  for (const Worker& worker : stage.Workers()) {
    if (const auto page = telemetry::HttpGet(worker.metrics, "/metrics"); page.ok()) {
      pages[worker.region] = ParseMetrics(page->body);
    }
  }
  return pages;
}

// The busiest region's mean step over the mean of all, over some time from now on.
absl::Status MeasureImbalance(FailoverStage& stage, double seconds, double& imbalance) {
  const auto before = Scrape(stage);
  if (absl::Status status = stage.PlayFor(seconds); !status.ok()) return status;
  const auto after = Scrape(stage);
  double busiest = 0, sum = 0, count = 0;
  for (const auto& [region, samples] : after) {
    const auto old = before.find(region);
    if (old == before.end()) continue;
    const double mean = HistogramBetween(old->second, samples, kStep).mean();
    busiest = std::max(busiest, mean);
    sum += mean;
    ++count;
  }
  imbalance = sum > 0 ? busiest * count / sum : 0;
  return absl::OkStatus();
}

}  // namespace

absl::Status RunScale(const FailoverSize& size, Report& report) {
  local::RunOptions options = StageOptions(size);
  options.regions = 2;
  FailoverStage stage(options);
  FailoverOutcome outcome;
  if (absl::Status status = stage.PlayUntilWell(); !status.ok()) return status;
  if (absl::Status status = stage.PlayFor(kGaugeSpan_s); !status.ok()) return status;
  LongestTicks before, longest;
  before.Look(stage);
  for (std::uint32_t round = 0; round < size.scale_rounds; ++round) {
    std::cerr << fmt::format("failover: scale {} of {}\n", round + 1, size.scale_rounds);
    for (const std::uint32_t regions : {4, 2}) {
      if (absl::Status status = ScaleTo(stage, regions, longest); !status.ok()) return status;
    }
  }
  stage.TakeCensus(outcome);
  const auto add = [&](const char* metric, double value) {
    report.Add("plaza", kFailoverEngine, "scale=2-4-2", metric, value, "1");
  };
  add("runs", size.scale_rounds);
  outcome.TellKept("plaza", "scale=2-4-2", report);
  add("longest_tick_ticks_before", before.clock_s * kTickRate_hz);
  add("longest_tick_cpu_ticks_before", before.cpu_s * kTickRate_hz);
  add("scale_longest_tick_ticks", longest.clock_s * kTickRate_hz);
  add("scale_longest_tick_cpu_ticks", longest.cpu_s * kTickRate_hz);
  return absl::OkStatus();
}

absl::Status RunHotSpot(const FailoverSize& size, Report& report) {
  std::cerr << "failover: hot spot\n";
  local::RunOptions options = StageOptions(size);
  options.scene = local::FindScene("rush");
  options.bots = std::min<std::uint32_t>(size.bots, 2);
  options.adjust = [](v1::InstanceSpec& spec) { spec.set_balance(true); };
  FailoverStage stage(options);
  absl::Status status =
      stage.PlayUntil("most bodies are in the corner", [&] { return ShareInCorner(stage) >= kCornerShare; });
  if (!status.ok()) return status;
  const std::uint64_t map_before = stage.run().Latest().map().version();
  double at_first = 0, imbalance = 0;
  status = MeasureImbalance(stage, kWindow_s, at_first);
  if (status.ok()) status = stage.PlayFor(kBalancing_s - kWindow_s);
  const std::uint64_t map_after = stage.run().Latest().map().version();
  if (status.ok()) status = MeasureImbalance(stage, kWindow_s, imbalance);
  if (status.ok()) status = stage.PlayOn();
  if (!status.ok()) return status;
  FailoverOutcome outcome;
  stage.TakeCensus(outcome);
  const auto add = [&](const char* metric, double value) {
    report.Add("rush", kFailoverEngine, "balance=on", metric, value, "1");
  };
  outcome.TellKept("rush", "balance=on", report);
  add("maps", static_cast<double>(map_after - map_before));
  add("imbalance_at_first", at_first);
  add("imbalance", imbalance);
  return absl::OkStatus();
}

}  // namespace tessera::bench
