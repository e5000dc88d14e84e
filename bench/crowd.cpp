#include "bench/crowd.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "bench/crowd_world.h"
#include "bench/statistics.h"

namespace tessera::bench {
namespace {

constexpr double kCrowd_m = 30, kSpread_m = 90;
constexpr Vec3d kSpot{50, 0, 50};  // the middle of one of four regions
constexpr std::uint64_t kTurnTicks = 20;

struct Case {
  const char* name;
  std::uint32_t regions;
  bool balanced;
  std::uint32_t threads;
};
constexpr Case kCases[] = {
    {"regions=1", 1, false, 1},
    {"regions=4", 4, false, 1},
    {"regions=4 balanced", 4, true, 1},
    {"threads=2", 1, false, 2},
};

std::unique_ptr<CrowdWorld> WorldOf(const Case& test, const CrowdPlan& plan) {
  auto scene = std::make_shared<const Scene>(CrowdScene(plan));
  const PartitionMap map =
      test.balanced ? BalancedCrowdMap(*scene, test.regions) : *MakeGridMap(scene->ground(), test.regions);
  region::RegionSettings settings;
  settings.threads = test.threads;
  return std::make_unique<CrowdWorld>(std::move(scene), plan.players, map, settings, test.threads > 1);
}

const CrowdWorld::Figures& BusiestOf(const CrowdWorld& world) {
  std::size_t busiest = 0;
  for (std::size_t region = 1; region < world.size(); ++region) {
    if (world.figures(region).busy_s > world.figures(busiest).busy_s) busiest = region;
  }
  return world.figures(busiest);
}

void ReportWorld(const CrowdWorld& world, const std::string& scene, const std::string& config, Report& report) {
  const auto add = [&](const char* metric, double value, const char* unit) {
    report.Add(scene, "tessera", config, metric, value, unit);
  };
  const CrowdWorld::Figures& busiest = BusiestOf(world);
  const auto ticks = static_cast<double>(busiest.ticks);
  add("busy_ms", busiest.busy_s / ticks * 1e3, "ms");
  add("step_ms", busiest.step_s / ticks * 1e3, "ms");
  add("write_ms", busiest.write_s / ticks * 1e3, "ms");
  add("write_us", busiest.write_s / static_cast<double>(busiest.snapshots) * 1e6, "us");
  std::uint64_t bodies = 0, deferred = 0, most = 0, near = 0, came = 0;
  for (std::size_t region = 0; region < world.size(); ++region) {
    bodies += world.figures(region).bodies;
    deferred += world.figures(region).deferred;
  }
  for (const CrowdWorld::ClientFigures& client : world.clients()) {
    most = std::max(most, client.bytes);
    near += client.near;
    came += client.near_came;
  }
  const double seconds = ticks / 60;
  const auto clients = static_cast<double>(world.clients().size());
  add("bodies_a_client_and_second", static_cast<double>(bodies) / clients / seconds, "1");
  add("deferred_share",
      static_cast<double>(deferred) / static_cast<double>(std::max<std::uint64_t>(1, bodies + deferred)), "1");
  add("client_budget_share", static_cast<double>(most) / seconds / world.view().bytes_per_s, "1");
  if (near > 0) add("near_rate_hz", 30 * static_cast<double>(came) / static_cast<double>(near), "Hz");
}

void RunCase(const Case& test, bool quick, Report& report) {
  const std::uint32_t players = quick ? 80 : 400, bodies = quick ? 400 : 2000;
  const std::uint64_t turns = quick ? 9 : 25, warm_up = quick ? 60 : 240;
  fmt::print(stderr, "crowd: {}, {} players, {} bodies\n", test.name, players, bodies);
  const auto spread = WorldOf(test, {players, bodies, kSpread_m, {}});
  const auto crowd = WorldOf(test, {players, bodies, kCrowd_m, kSpot});
  std::vector<double> ratios;
  for (std::uint64_t tick = 0; tick < warm_up; ++tick) {
    spread->Tick();
    crowd->Tick();
  }
  spread->Forget();
  crowd->Forget();
  double before[2] = {};
  for (std::uint64_t turn = 0; turn < turns; ++turn) {
    double took[2];
    CrowdWorld* const worlds[] = {spread.get(), crowd.get()};
    for (std::size_t i = 0; i < 2; ++i) {
      for (std::uint64_t tick = 0; tick < kTurnTicks; ++tick) worlds[i]->Tick();
      const double sum = BusiestOf(*worlds[i]).busy_s;
      took[i] = sum - std::exchange(before[i], sum);
    }
    ratios.push_back(took[1] / took[0]);
  }
  const std::string config = fmt::format("{} players={} bodies={}", test.name, players, bodies);
  ReportWorld(*spread, "spread", config, report);
  ReportWorld(*crowd, "crowd", config, report);
  const auto add = [&](const char* metric, double value) {
    report.Add("crowd", "tessera", config, metric, value, "1");
  };
  add("crowd_cpu_ratio", Median(ratios));
  add("crowd_cpu_ratio_p10", Quantile(ratios, 0.1));
  add("crowd_cpu_ratio_p90", Quantile(ratios, 0.9));
}

}  // namespace

absl::Status RunCrowd(const SuiteOptions& options, Report& report) {
  for (const Case& test : kCases) {
    if (std::string_view(test.name).find(options.only) == std::string_view::npos) continue;
    RunCase(test, options.quick, report);
    if (const absl::Status status = report.Save(); !status.ok()) return status;
  }
  return absl::OkStatus();
}

}  // namespace tessera::bench
