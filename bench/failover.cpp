#include "bench/failover.h"

#include <fmt/format.h>
#include <sys/types.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <functional>
#include <iostream>
#include <thread>
#include <vector>

#include "bench/failover_watch.h"
#include "bench/scrape.h"
#include "local_cluster/world_run.h"
#include "telemetry/http_get.h"

namespace tessera::bench {
namespace {

using Clock = std::chrono::steady_clock;

constexpr const char* kScene = "plaza";
constexpr const char* kEngine = "tessera";
constexpr double kPatience_s = 120;
constexpr std::uint64_t kCensusesAfter = 2;

struct Size {
  std::uint32_t runs, bodies, bots;
  double control_away_s;
};
constexpr Size kFull{20, 2000, 8, 30}, kQuick{1, 300, 2, 4};

// One world, from its start to its end, and what befell it.
class Trial {
 public:
  explicit Trial(const Size& size)
      : run_({.scene = local::FindScene(kScene),
              .regions = 4,
              .bodies = size.bodies,
              .bots = size.bots,
              .hosts = 2,
              .capacity = 4}) {}

  // False when the world ended or time is up.
  bool PlayUntil(const std::function<bool()>& holds) {
    const auto deadline = Clock::now() + std::chrono::duration<double>(kPatience_s);
    while (!holds()) {
      if (!run_.Frame() || Clock::now() > deadline) return false;
      if (watch_) watch_->Look(Clock::now());
      std::this_thread::sleep_for(std::chrono::milliseconds(4));  // the pace of a game's frames, and finer
    }
    return true;
  }
  bool PlayFor(double seconds) {
    const auto end = Clock::now() + std::chrono::duration<double>(seconds);
    return PlayUntil([end] { return Clock::now() > end; });
  }
  bool IsWell() {
    const v1::Instance instance = run_.Latest();
    return instance.state() == v1::INSTANCE_STATE_RUNNING && instance.unprotected_regions().empty() &&
           std::ranges::all_of(instance.region_status(),
                               [](const auto& status) { return status.report().acknowledged_tick() > 120; });
  }
  bool PlayOn() {
    const auto counted = [&] { return run_.conservation() ? run_.conservation()->censuses : 0; };
    const std::uint64_t before = counted();
    return PlayUntil([&] { return counted() >= before + kCensusesAfter; });
  }
  void WatchRegions(const std::set<RegionId>& regions) { watch_.emplace(regions, run_.bots()); }
  bool SeesThemMoveAgain() const { return watch_->found() * 2 > watch_->watched(); }

  local::WorldRun& run() { return run_; }
  const GapWatch& watch() const { return *watch_; }

 private:
  local::WorldRun run_;
  std::optional<GapWatch> watch_;
};

struct Worker {
  RegionId region;
  pid_t pid = 0;
  std::string metrics;  // host:port
  std::string host;
};

std::vector<Worker> WorkersOf(const v1::Instance& instance) {
  std::vector<Worker> workers;
  workers.reserve(static_cast<std::size_t>(instance.region_status_size()));
  for (const v1::RegionStatus& status : instance.region_status()) {
    const v1::WorkerReport& report = status.report();
    workers.push_back({RegionId(status.region()), static_cast<pid_t>(report.identity().pid()),
                       fmt::format("{}:{}", report.address().host(), report.address().metrics_port()), status.host()});
  }
  return workers;
}

// The sum over workers, or the highest, of one sample.
double Scraped(const std::vector<Worker>& workers, const std::string& name, bool highest) {
  double result = 0;
  for (const Worker& worker : workers) {
    const auto page = telemetry::HttpGet(worker.metrics, "/metrics");
    if (!page.ok()) continue;  // it is dead
    const Samples samples = ParseMetrics(page->body);
    const auto found = samples.find(name);
    if (found == samples.end()) continue;
    result = highest ? std::max(result, found->second) : result + found->second;
  }
  return result;
}

// What all runs of a fault came to.
struct Outcome {
  std::vector<double> gaps_ms;
  double lost = 0, duplicated = 0, age_ticks = 0, clients_dropped = 0, workers_lost = 0, late_ticks = 0;
  double server_gap_ms = 0;
};

absl::Status Died(const char* when) { return absl::InternalError(fmt::format("the world ended, or never: {}", when)); }

void TakeCensus(Trial& trial, Outcome& outcome) {
  const auto found = trial.run().conservation();
  if (!found) return;
  outcome.lost += static_cast<double>(found->lost);
  outcome.duplicated += static_cast<double>(found->duplicated);
  for (local::Bot* bot : trial.run().bots()) {
    if (bot->client().state() != client::ClientState::kPlaying) ++outcome.clients_dropped;
  }
}

// Kills or freezes `victims` and waits until others carry their areas on.
absl::Status StrikeWorkers(Trial& trial, const std::vector<Worker>& victims, int signal, Outcome& outcome) {
  std::set<RegionId> regions;
  for (const Worker& victim : victims) regions.insert(victim.region);
  trial.WatchRegions(regions);
  if (!trial.PlayFor(0.2)) return Died("before the fault");
  for (const Worker& victim : victims) kill(victim.pid, signal);
  const bool carried_on = trial.PlayUntil([&] {
    const v1::Instance instance = trial.run().Latest();
    return instance.failovers() > 0 && instance.state() == v1::INSTANCE_STATE_RUNNING && trial.SeesThemMoveAgain();
  });
  if (!carried_on) return Died("carried on by others");
  outcome.gaps_ms.push_back(trial.watch().gap_s() * 1e3);
  const std::vector<Worker> workers = WorkersOf(trial.run().Latest());
  outcome.age_ticks = std::max(outcome.age_ticks, Scraped(workers, "tessera_region_takeover_age_ticks", true));
  outcome.server_gap_ms =
      std::max(outcome.server_gap_ms, 1e3 * Scraped(workers, "tessera_region_failover_gap_seconds", true));
  return absl::OkStatus();
}

using Strike = std::function<absl::Status(Trial&, std::uint32_t run, Outcome&)>;

absl::Status KillWorker(Trial& trial, std::uint32_t run, Outcome& outcome) {
  const std::vector<Worker> workers = WorkersOf(trial.run().Latest());
  return StrikeWorkers(trial, {workers[run % workers.size()]}, SIGKILL, outcome);
}

std::vector<Worker> OnHost(const std::vector<Worker>& workers, const std::string& host) {
  std::vector<Worker> there;
  std::ranges::copy_if(workers, std::back_inserter(there), [&](const Worker& worker) { return worker.host == host; });
  return there;
}

absl::Status KillHost(Trial& trial, std::uint32_t run, Outcome& outcome) {
  const std::size_t index = run % 2;
  const auto victims = OnHost(WorkersOf(trial.run().Latest()), fmt::format("local-{}", index + 1));
  trial.run().cluster().KillAgent(index);
  return StrikeWorkers(trial, victims, SIGKILL, outcome);
}

absl::Status FreezeHost(Trial& trial, std::uint32_t run, Outcome& outcome) {
  const std::size_t index = run % 2;
  const auto victims = OnHost(WorkersOf(trial.run().Latest()), fmt::format("local-{}", index + 1));
  local::ChildProcess& agent = trial.run().cluster().agent(index);
  agent.Signal(SIGSTOP);
  const absl::Status struck = StrikeWorkers(trial, victims, SIGSTOP, outcome);
  for (const Worker& victim : victims) kill(victim.pid, SIGCONT);
  agent.Signal(SIGCONT);
  return struck;
}

absl::Status KillAgent(Trial& trial, std::uint32_t run, Outcome& outcome) {
  const std::vector<Worker> workers = WorkersOf(trial.run().Latest());
  trial.run().cluster().KillAgent(run % 2);
  if (!trial.PlayFor(1)) return Died("without the agent");
  trial.run().cluster().RestartAgent(run % 2);
  if (!trial.PlayOn()) return Died("with the new agent");
  for (const Worker& worker : workers) {
    if (kill(worker.pid, 0) != 0) ++outcome.workers_lost;
  }
  return absl::OkStatus();
}

absl::Status KillControl(Trial& trial, double away_s, Outcome& outcome) {
  const std::vector<Worker> workers = WorkersOf(trial.run().Latest());
  const std::string late = "tessera_region_late_ticks_total";
  const double first = Scraped(workers, late, false);
  if (!trial.PlayFor(away_s)) return Died("before the fault");
  const double second = Scraped(workers, late, false);
  trial.run().cluster().KillControl();
  if (!trial.PlayFor(away_s)) return Died("without the control plane");
  const double third = Scraped(workers, late, false);
  outcome.late_ticks += (third - second) - (second - first);
  trial.run().cluster().RestartControl();
  trial.run().WatchAnew();
  return absl::OkStatus();
}

absl::Status RunFault(const std::string& fault, const Size& size, const Strike& strike, Report& report) {
  Outcome outcome;
  for (std::uint32_t i = 0; i < size.runs; ++i) {
    std::cerr << fmt::format("failover: {} {} of {}\n", fault, i + 1, size.runs);
    Trial trial(size);
    if (!trial.PlayUntil([&] { return trial.IsWell(); })) return Died("all regions protected");
    if (const absl::Status struck = strike(trial, i, outcome); !struck.ok()) {
      return absl::InternalError(
          fmt::format("{}: {}; {}", fault, std::string(struck.message()), trial.run().Latest().ShortDebugString()));
    }
    if (!trial.PlayOn()) return Died("further censuses");
    TakeCensus(trial, outcome);
  }
  const std::string config = "fault=" + fault;
  const auto add = [&](const char* metric, double value, const char* unit) {
    report.Add(kScene, kEngine, config, metric, value, unit);
  };
  add("runs", size.runs, "1");
  add("bodies_lost", outcome.lost, "1");
  add("bodies_duplicated", outcome.duplicated, "1");
  add("clients_dropped", outcome.clients_dropped, "1");
  if (fault == "agent") add("workers_lost", outcome.workers_lost, "1");
  if (fault == "control") add("late_ticks_added", outcome.late_ticks, "1");
  if (!outcome.gaps_ms.empty()) {
    std::ranges::sort(outcome.gaps_ms);
    add("gap_ms_p50", outcome.gaps_ms[outcome.gaps_ms.size() / 2], "ms");
    add("gap_ms_max", outcome.gaps_ms.back(), "ms");
    add("gap_without_a_step_ms_max", outcome.server_gap_ms, "ms");
    add("state_age_ticks_max", outcome.age_ticks, "1");
  }
  return absl::OkStatus();
}

}  // namespace

absl::Status RunFailover(const SuiteOptions& options, Report& report) {
  const Size& size = options.quick ? kQuick : kFull;
  const std::pair<const char*, Strike> kFaults[] = {{"worker", KillWorker},
                                                    {"host", KillHost},
                                                    {"freeze", FreezeHost},
                                                    {"agent", KillAgent},
                                                    {"control", [&size](Trial& trial, std::uint32_t, Outcome& outcome) {
                                                       return KillControl(trial, size.control_away_s, outcome);
                                                     }}};
  for (const auto& [name, strike] : kFaults) {
    if (std::string(name).find(options.only) == std::string::npos) continue;
    if (absl::Status status = RunFault(name, size, strike, report); !status.ok()) return status;
  }
  return absl::OkStatus();
}

}  // namespace tessera::bench
