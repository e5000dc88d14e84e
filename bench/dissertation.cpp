#include "bench/dissertation.h"

#include <fmt/format.h>

#include <chrono>
#include <iostream>
#include <thread>
#include <vector>

#include "bench/scrape.h"
#include "cli/client_view.h"
#include "local_cluster/world_run.h"
#include "telemetry/http_get.h"

namespace tessera::bench {
namespace {

constexpr const char* kScene = "dissertation";
constexpr const char* kEngine = "tessera";

struct Layout {
  std::uint32_t regions, objects_per_region;
  std::string Config() const { return fmt::format("regions={} objects={}", regions, objects_per_region); }
};

// Frames of the bots for so long.
bool RunFor(local::WorldRun& run, double seconds) {
  const auto end = std::chrono::steady_clock::now() + std::chrono::duration<double>(seconds);
  while (std::chrono::steady_clock::now() < end) {
    if (!run.Frame()) return false;
    std::this_thread::sleep_for(cli::kFrameTime);  // the pace of a game's frames
  }
  return true;
}

absl::StatusOr<std::vector<Samples>> ScrapeRegions(const v1::Instance& instance) {
  std::vector<Samples> all;
  for (const v1::RegionStatus& region : instance.region_status()) {
    const v1::RegionAddress& address = region.report().address();
    const auto page = telemetry::HttpGet(fmt::format("{}:{}", address.host(), address.metrics_port()), "/metrics");
    if (!page.ok()) return page.status();
    all.push_back(ParseMetrics(page->body));
  }
  return all;
}

void ReportRegions(const std::string& config, const std::vector<Samples>& before, const std::vector<Samples>& after,
                   Report& report) {
  struct Metric {
    const char *name, *histogram;
    bool since_start = false;  // full snapshots go out when a client enters, before the time that is measured
  };
  const Metric kTimes[] = {{"physics_update", "tessera_region_physics_seconds"},
                           {"prediction", "tessera_region_prediction_seconds"},
                           {"snapshot_full", "tessera_region_snapshot_full_seconds", true},
                           {"snapshot_delta", "tessera_region_snapshot_delta_seconds"},
                           {"tick", "tessera_region_step_seconds"}};
  const Samples nothing;
  const auto n = static_cast<double>(after.size());
  for (const Metric& metric : kTimes) {
    HistogramReading sum;
    double p99 = 0;
    for (std::size_t i = 0; i < after.size(); ++i) {
      const Samples& from = metric.since_start ? nothing : before[i];
      const HistogramReading one = HistogramBetween(from, after[i], metric.histogram);
      sum.count += one.count;
      sum.sum += one.sum;
      p99 += QuantileBetween(from, after[i], metric.histogram, 0.99) / n;
    }
    report.Add(kScene, kEngine, config, fmt::format("{}_mean", metric.name), sum.mean(), "s");
    report.Add(kScene, kEngine, config, fmt::format("{}_p99", metric.name), p99, "s");
    report.Add(kScene, kEngine, config, fmt::format("{}_count", metric.name), sum.count, "1");
  }
  for (const auto& [name, first] : after.front()) {
    if (name.find("_memory_") == std::string::npos) continue;
    double mean = 0;
    for (const Samples& samples : after) mean += samples.at(name) / n;
    report.Add(kScene, kEngine, config, name, mean, "bytes");
  }
}

void ReportClients(const std::string& config, local::WorldRun& run, Report& report) {
  const auto bots = run.bots();
  const auto n = static_cast<double>(bots.size());
  const auto add = [&](const std::string& name, client::DurationSummary client::ClientStats::*time) {
    double mean = 0, p99 = 0;
    for (local::Bot* bot : bots) {
      const client::ClientStats stats = bot->client().Stats();
      mean += (stats.*time).mean_s / n;
      p99 += (stats.*time).p99_s / n;
    }
    report.Add(kScene, kEngine, config, name + "_mean", mean, "s");
    report.Add(kScene, kEngine, config, name + "_p99", p99, "s");
  };
  add("client_frame", &client::ClientStats::frame_time);
  add("client_network", &client::ClientStats::network_time);
  add("client_update", &client::ClientStats::update_time);
  double bytes = 0;
  for (local::Bot* bot : bots) bytes += bot->client().Stats().bytes_in_per_s / n;
  report.Add(kScene, kEngine, config, "client_received_per_second", bytes, "bytes");
}

absl::Status RunLayout(const Layout& layout, double seconds, Report& report) {
  std::cerr << fmt::format("dissertation: {} regions, {} objects each, 2 clients, {:.0f} s\n", layout.regions,
                           layout.objects_per_region, seconds);
  local::WorldRun run({.scene = local::FindScene(kScene),
                       .regions = layout.regions,
                       .bodies = layout.regions * layout.objects_per_region,
                       .bots = 2});
  if (!RunFor(run, 1)) return absl::InternalError("the world ended by itself");
  const auto before = ScrapeRegions(run.Latest());
  if (!before.ok()) return before.status();
  if (!RunFor(run, seconds)) return absl::InternalError("the world ended by itself");
  const auto after = ScrapeRegions(run.Latest());
  if (!after.ok()) return after.status();
  ReportRegions(layout.Config(), *before, *after, report);
  ReportClients(layout.Config(), run, report);
  const local::RunSummary summary = run.Finish();
  if (!summary.failure.empty()) return absl::InternalError(summary.failure);
  report.Add(kScene, kEngine, layout.Config(), "bodies_lost", static_cast<double>(summary.conservation->lost), "1");
  report.Add(kScene, kEngine, layout.Config(), "bodies_duplicated",
             static_cast<double>(summary.conservation->duplicated), "1");
  return absl::OkStatus();
}

}  // namespace

absl::Status RunDissertation(const DissertationOptions& options, Report& report) {
  for (const std::uint32_t regions : {2u, 3u}) {
    for (const std::uint32_t objects : {1u, 100u}) {
      if (const absl::Status status = RunLayout({regions, objects}, options.seconds, report); !status.ok())
        return status;
    }
  }
  return absl::OkStatus();
}

}  // namespace tessera::bench
