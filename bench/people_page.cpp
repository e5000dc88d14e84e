// The page in a headless Chromium with software GL, by web/testing/measure.ts: what it loads of a real gateway, and
// then, with the cluster off, its frames and script against a bare page of as many bodies.
#include <fmt/format.h>

#include <chrono>
#include <nlohmann/json.hpp>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "bench/people_scenes.h"
#include "bench/people_stage.h"
#include "host/files.h"
#include "host/last_lines.h"
#include "local_cluster/command_error.h"

namespace tessera::bench {
namespace {

constexpr std::uint32_t kLoadedBodies = 200;
constexpr std::chrono::minutes kBrowserPatience{10};
constexpr std::size_t kMaxFigures_bytes = 1 << 20;
// From the folder web, where its packages are.
constexpr const char* kInWeb = "cd \"$0\" && exec node \"$@\"";
constexpr const char* kBundles = "build/measure";

// Runs node in the folder web; what it says on standard output.
std::string RunNode(const std::vector<std::string>& arguments) {
  const host::TemporaryFolder folder;
  const std::string out = folder.path() + "/out", log = folder.path() + "/log";
  std::vector<std::string> argv{"/bin/sh", "-c", kInWeb, TESSERA_SOURCE_DIR "/web"};
  argv.insert(argv.end(), arguments.begin(), arguments.end());
  host::ChildProcess node =
      local::OrThrow(host::ChildProcess::Start({.argv = argv, .log_path = log, .output_path = out}));
  const auto ended = node.Wait(kBrowserPatience);
  if (!ended || !ended->Clean()) {
    throw local::CommandError(absl::StrCat("node ", arguments.front(), " ",
                                           ended ? ended->Describe() : "takes too long", host::LastLinesText(log, 8)));
  }
  return local::OrThrow(host::ReadFile(out, kMaxFigures_bytes));
}

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

void AddLoad(Report& report) {
  local::WorldRun run(PlazaOptions(kLoadedBodies));
  const GatewayProcess gateway(run.cluster().control_address());
  AddFigures(RunNode({absl::StrCat(kBundles, "/measure.mjs"), "--load",
                      absl::StrCat("http://", gateway.address(), "/#", run.instance_id())}),
             report);
}

}  // namespace

absl::Status RunPage(const PeopleSize& size, Report& report) {
  RunNode({"build.mjs", "--tests", kBundles});
  AddLoad(report);
  AddFigures(RunNode({absl::StrCat(kBundles, "/measure.mjs"), "--json", "--rounds", std::to_string(size.page_rounds)}),
             report);
  return absl::OkStatus();
}

}  // namespace tessera::bench
