// tessera demo: one world on several workers on this machine, shown live, with a summary that proves itself.
#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdlib>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "cli/checks.h"
#include "cli/client_view.h"
#include "cli/commands.h"
#include "cli/instance_view.h"
#include "cli/signals.h"
#include "local_cluster/command_error.h"
#include "local_cluster/world_run.h"

namespace tessera::cli {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

struct DemoOptions {
  std::string scene = "arena";
  std::string game;
  std::uint32_t regions = 4;
  std::optional<std::uint32_t> bodies;
  std::uint32_t bots = 4;
  std::string page_listen = "127.0.0.1:0";
  double seconds = 60;
  bool json = false;
};

// Redraws its block in place on a terminal; elsewhere appends one block every ten seconds.
class LiveTable {
 public:
  void Show(const std::string& block) {
    const auto now = Clock::now();
    if (now < next_) return;
    next_ = now + (in_place_ ? 1s : 10s);
    if (in_place_ && lines_ > 0) std::cout << fmt::format("\x1b[{}A\x1b[J", lines_);
    std::cout << block << std::flush;
    lines_ = std::count(block.begin(), block.end(), '\n');
  }

 private:
  bool in_place_ = isatty(STDOUT_FILENO) == 1 && std::getenv("NO_COLOR") == nullptr;
  Clock::time_point next_;
  std::int64_t lines_ = 0;
};

std::string Block(local::WorldRun& run, double seconds) {
  const v1::Instance instance = run.Latest();
  return fmt::format("\n{:.0f} of {:.0f} s  {}{}\n{}", run.running_s(), seconds, SummaryLine(instance),
                     RegionTable(instance), ClientTable(run.bots()));
}

std::uint64_t Total(const local::RunSummary& summary, std::uint64_t (v1::WorkerReport::*figure)() const) {
  std::uint64_t total = 0;
  for (const local::RegionSummary& region : summary.regions) total += (region.last.*figure)();
  return total;
}

std::string SummaryText(const local::RunSummary& summary) {
  const local::ConservationResult found = summary.conservation.value_or(local::ConservationResult{});
  double slowest = summary.regions.empty() ? 0 : summary.regions.front().tick_rate_hz, p99 = 0;
  for (const local::RegionSummary& region : summary.regions) {
    slowest = std::min(slowest, region.tick_rate_hz);
    p99 = std::max(p99, region.worst_step_p99_s);
  }
  const std::uint64_t ticks = Total(summary, &v1::WorkerReport::tick);
  std::string out = "\nSummary\n";
  const auto line = [&out](const std::string& name, const std::string& value) {
    out += fmt::format("  {:<22}{}\n", name, value);
  };
  line("workers ready after", fmt::format("{:.0f} ms", summary.ready_s * 1e3));
  line("bodies at start", fmt::format("{}", summary.bodies_at_start));
  line("bodies at end",
       fmt::format("{} (tick {}; {} censuses at common ticks compared)", found.found, found.tick, found.censuses));
  line("lost", fmt::format("{}", found.lost));
  line("duplicated", fmt::format("{}", found.duplicated));
  line("non-finite", fmt::format("{}", summary.nonfinite));
  line("handovers", fmt::format("{}", Total(summary, &v1::WorkerReport::handovers_in)));
  line("tick rate", fmt::format("{:.2f} Hz (slowest region)", slowest));
  line("step p99", fmt::format("{:.2f} ms (slowest region, worst seconds)", p99 * 1e3));
  line("late ticks", fmt::format("{} of {}", Total(summary, &v1::WorkerReport::late_ticks), ticks));
  if (summary.comebacks > 0) line("bots that came back", fmt::format("{}", summary.comebacks));
  line("processes left", fmt::format("{}", summary.processes_left.size()));
  line("verdict", summary.failure.empty() ? "every body is accounted for" : "FAILED: " + summary.failure);
  return out;
}

nlohmann::ordered_json SummaryJson(const local::RunSummary& summary, const nlohmann::ordered_json& clients) {
  const local::ConservationResult found = summary.conservation.value_or(local::ConservationResult{});
  auto regions = nlohmann::ordered_json::array();
  for (const local::RegionSummary& region : summary.regions) {
    regions.push_back({{"region", region.region},
                       {"ticks", region.last.tick()},
                       {"tick_rate_hz", region.tick_rate_hz},
                       {"step_p50_s", region.last.step().p50_seconds()},
                       {"step_p99_worst_s", region.worst_step_p99_s},
                       {"late_ticks", region.last.late_ticks()},
                       {"owned", region.last.owned()},
                       {"ghosts", region.last.ghosts()},
                       {"handovers_in", region.last.handovers_in()},
                       {"handovers_out", region.last.handovers_out()},
                       {"resident_bytes", region.last.resident_bytes()}});
  }
  return {{"ready_s", summary.ready_s},
          {"running_s", summary.running_s},
          {"bodies_start", summary.bodies_at_start},
          {"bodies_end", found.found},
          {"censuses", found.censuses},
          {"lost", found.lost},
          {"duplicated", found.duplicated},
          {"nonfinite", summary.nonfinite},
          {"handovers", Total(summary, &v1::WorkerReport::handovers_in)},
          {"late_ticks", Total(summary, &v1::WorkerReport::late_ticks)},
          {"bot_comebacks", summary.comebacks},
          {"processes_left", summary.processes_left.size()},
          {"failure", summary.failure},
          {"regions", regions},
          {"clients", clients}};
}

// The page's address comes first: everything else can be seen there.
void ShowPage(const DemoOptions& options, const std::string& url) {
  std::cout << fmt::format(
                   "page: {}\nTry there: join and steer with the keys, end a worker and watch another take "
                   "over, scale.\nStarting {} on {} workers with {} bots. Ctrl-C ends it.\n",
                   url, options.scene, options.regions, options.bots)
            << std::flush;
}

void Demo(const DemoOptions& options) {
  StopSignal stop;
  const std::string scene =
      options.scene.find_first_of("/.") == std::string::npos ? local::FindScene(options.scene) : options.scene;
  local::WorldRun run({.scene = scene,
                       .game = options.game.empty() ? local::GameBeside(scene) : options.game,
                       .regions = options.regions,
                       .bodies = options.bodies,
                       .bots = options.bots,
                       .bots_come_back = true,
                       .page_listen = options.json ? "" : options.page_listen,
                       .on_cluster = [&options](const local::LocalCluster& cluster) {
                         if (!options.json) ShowPage(options, cluster.page_url());
                       }});
  LiveTable table;
  bool running = true;
  while (running && run.running_s() < options.seconds && !stop.Wait(kFrameTime)) {
    running = run.Frame();
    if (!options.json) table.Show(Block(run, options.seconds));
  }
  const std::string reason = running ? "" : fmt::format("the world ended by itself: {}", run.WhyOver());
  auto clients = nlohmann::ordered_json::array();
  for (local::Bot* bot : run.bots()) clients.push_back(ClientJson(*bot));
  if (!running) throw local::CommandError(reason);
  const local::RunSummary summary = run.Finish();
  std::cout << (options.json ? SummaryJson(summary, clients).dump(2) + "\n" : SummaryText(summary));
  if (!summary.failure.empty()) throw local::CommandError("demo: " + summary.failure);
}

}  // namespace

void AddDemoCommand(CLI::App& app, Globals& globals) {
  auto options = std::make_shared<DemoOptions>();
  CLI::App* demo = app.add_subcommand("demo", "Run one world on several workers on this machine and show it live");
  demo->add_option("--scene", options->scene,
                   "Scene file, or the name of one that comes with tessera: arena, plaza and others")
      ->capture_default_str();
  demo->add_option("--game", options->game,
                   "Lua file that the world's regions run (default: game.lua beside the scene's scene.json, or none)");
  demo->add_option("--regions", options->regions, "Number of region workers")
      ->capture_default_str()
      ->check(CLI::Range(1, 1000));
  demo->add_option("--bodies", options->bodies, "Number of scattered bodies (default: the scene's, 2000)");
  demo->add_option("--bots", options->bots, "Number of clients")->capture_default_str()->check(CLI::Range(0, 64));
  demo->add_option("--page-listen", options->page_listen, "HTTP address of the page; port 0 takes a free one")
      ->capture_default_str();
  demo->add_option("--seconds", options->seconds, "How long the world runs")
      ->capture_default_str()
      ->check(CLI::PositiveNumber)
      ->check(Finite());
  demo->callback([&globals, options] {
    options->json = globals.format == Format::kJson;
    Demo(*options);
  });
}

}  // namespace tessera::cli
