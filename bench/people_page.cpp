// The page in a headless Chromium with software GL, by web/testing/measure.ts: what it loads of a real gateway, and
// then, with the cluster off, its frames and script against a bare page of as many bodies, as a feed that was recorded
// of a real gateway moves them.
#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "absl/strings/str_cat.h"
#include "bench/people_node.h"
#include "bench/people_scenes.h"
#include "bench/people_stage.h"
#include "host/temporary_folder.h"

namespace tessera::bench {
namespace {

constexpr std::uint32_t kLoadedBodies = 200, kDrawnBodies = 5000;

// `{"metric": {"unit": "ms", "p50": 1, ...}}` by metric; what has no spread has a value alone.
void AddFigures(const std::string& json, Report& report) {
  const nlohmann::json figures = nlohmann::json::parse(json);
  for (const auto& [metric, figure] : figures.items()) {
    const std::string unit = figure.at("unit");
    report.Add("page", kPeopleEngine, "", metric, figure.at("value"), unit);
    for (const char* spread : {"p10", "p90"}) {
      if (figure.contains(spread)) {
        report.Add("page", kPeopleEngine, "", absl::StrCat(metric, "_", spread), figure.at(spread), unit);
      }
    }
  }
}

std::string PageOf(const GatewayProcess& gateway, const local::WorldRun& run) {
  return absl::StrCat("http://", gateway.address(), "/#", run.instance_id());
}

void AddLoad(Report& report) {
  local::WorldRun run(PlazaOptions(kLoadedBodies));
  const GatewayProcess gateway(run.cluster().control_address());
  AddFigures(RunNode({Bundled("measure.mjs"), "--load", PageOf(gateway, run)}), report);
}

// As long as the rounds take.
void RecordFeed(const std::string& file, const std::string& rounds) {
  local::WorldRun run(PlazaOptions(kDrawnBodies));
  SettlePlaza(run);
  const GatewayProcess gateway(run.cluster().control_address());
  RunNode({Bundled("measure.mjs"), "--record", PageOf(gateway, run), "--feed", file, "--rounds", rounds});
  RequireRunning(run);
}

}  // namespace

absl::Status RunPage(const PeopleSize& size, Report& report) {
  BundlePrograms();
  AddLoad(report);
  const host::TemporaryFolder folder;
  const std::string feed = folder.path() + "/feed", rounds = std::to_string(size.page_rounds);
  RecordFeed(feed, rounds);
  AddFigures(RunNode({Bundled("measure.mjs"), "--json", "--feed", feed, "--rounds", rounds}), report);
  return absl::OkStatus();
}

}  // namespace tessera::bench
