#include "bench/failover_faults.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <iostream>
#include <memory>
#include <optional>

#include "host/process.h"

namespace tessera::bench {
namespace {

constexpr double kBeforeFault_s = 0.2;  // that the watch has seen the bodies move
constexpr double kAgentAway_s = 1;
constexpr const char* kLateTicks = "tessera_region_late_ticks_total";

// Strikes by `strike` and waits until others carry the victims' areas on, in the players' eyes as well.
absl::Status StrikeWorkers(FailoverStage& stage, const std::vector<Worker>& victims,
                           const std::function<absl::Status()>& strike, FailoverOutcome& outcome) {
  std::set<RegionId> regions;
  for (const Worker& victim : victims) regions.insert(victim.region);
  const std::uint64_t before = stage.run().Latest().failovers();
  stage.players().Watch(regions);
  if (absl::Status status = stage.PlayFor(kBeforeFault_s); !status.ok()) return status;
  using Clock = std::chrono::steady_clock;
  const auto struck_at = Clock::now();
  std::optional<Clock::time_point> over_at;  // the failover, as the control plane reports it
  if (absl::Status status = strike(); !status.ok()) return status;
  const absl::Status carried_on = stage.PlayUntil("carried on by others", [&] {
    const v1::Instance instance = stage.run().Latest();
    const bool over = instance.failovers() > before && instance.state() == v1::INSTANCE_STATE_RUNNING;
    if (over && !over_at) over_at = Clock::now();
    return over && stage.players().SawOthers();
  });
  if (!carried_on.ok()) return carried_on;
  const auto ms = [&](Clock::time_point at) {
    return std::chrono::duration<double, std::milli>(at - struck_at).count();
  };
  std::cerr << fmt::format("failover: struck; over for the control plane after {:.0f} ms, for players after {:.0f}\n",
                           ms(*over_at), ms(Clock::now()));
  outcome.gaps_ms.push_back(stage.players().gap_s() * 1e3);
  outcome.worst_gaps_ms.push_back(stage.players().worst_gap_s() * 1e3);
  const std::vector<Worker> workers = stage.Workers();
  outcome.age_ticks = std::max(outcome.age_ticks, HighestOf(workers, "tessera_region_promotion_age_ticks"));
  outcome.server_gaps_ms.push_back(1e3 * HighestOf(workers, "tessera_region_failover_gap_seconds"));
  std::cerr << fmt::format("failover: gap of players {:.0f} ms, of the worst one {:.0f}, of regions {:.0f}\n",
                           outcome.gaps_ms.back(), outcome.worst_gaps_ms.back(), outcome.server_gaps_ms.back());
  return absl::OkStatus();
}

absl::Status SignalAll(const std::vector<Worker>& workers, int signal) {
  for (const Worker& worker : workers) kill(worker.pid, signal);
  return absl::OkStatus();
}

absl::Status KillWorker(FailoverStage& stage, std::uint32_t run, FailoverOutcome& outcome) {
  const std::vector<Worker> workers = stage.Workers();
  const std::vector<Worker> victim{workers[run % workers.size()]};
  return StrikeWorkers(
      stage, victim, [&] { return SignalAll(victim, SIGKILL); }, outcome);
}

// Both workers of a host, whose agent reports it.
absl::Status KillPair(FailoverStage& stage, std::uint32_t run, FailoverOutcome& outcome) {
  const std::vector<Worker> victims = stage.WorkersOn(run % 2);
  return StrikeWorkers(
      stage, victims, [&] { return SignalAll(victims, SIGKILL); }, outcome);
}

absl::Status KillHost(FailoverStage& stage, std::uint32_t run, FailoverOutcome& outcome) {
  const std::vector<Worker> victims = stage.WorkersOn(run % 2);
  const auto strike = [&] {
    stage.run().cluster().agent(run % 2).Signal(SIGKILL);
    return SignalAll(victims, SIGKILL);
  };
  const absl::Status struck = StrikeWorkers(stage, victims, strike, outcome);
  stage.run().cluster().RestartAgent(run % 2);
  return struck;
}

// Those who were taken for dead may go on only to hear that they are fenced.
absl::Status AwaitTheEndOf(const std::vector<Worker>& victims, FailoverStage& stage) {
  return stage.PlayUntil("those who were cut off end", [&] {
    return std::ranges::none_of(victims, [](const Worker& w) { return host::IsAlive(w.pid); });
  });
}

absl::Status FreezeHost(FailoverStage& stage, std::uint32_t run, FailoverOutcome& outcome) {
  const std::vector<Worker> victims = stage.WorkersOn(run % 2);
  host::ChildProcess& agent = stage.run().cluster().agent(run % 2);
  const auto strike = [&] {
    agent.Signal(SIGSTOP);
    return SignalAll(victims, SIGSTOP);
  };
  const absl::Status struck = StrikeWorkers(stage, victims, strike, outcome);
  (void)SignalAll(victims, SIGCONT);
  agent.Signal(SIGCONT);
  return struck.ok() ? AwaitTheEndOf(victims, stage) : struck;
}

absl::Status CutLink(FailoverStage& stage, std::uint32_t run, local::HostNetwork& network, FailoverOutcome& outcome) {
  const std::uint32_t host = run % 2;
  const std::vector<Worker> victims = stage.WorkersOn(host);
  const absl::Status struck = StrikeWorkers(
      stage, victims, [&] { return network.Cut(host); }, outcome);
  const absl::Status mended = network.Mend(host);
  if (!struck.ok()) return struck;
  return mended.ok() ? AwaitTheEndOf(victims, stage) : mended;
}

absl::Status KillAgent(FailoverStage& stage, std::uint32_t run, FailoverOutcome& outcome) {
  const std::vector<Worker> workers = stage.Workers();
  stage.run().cluster().KillAgent(run % 2);
  if (absl::Status status = stage.PlayFor(kAgentAway_s); !status.ok()) return status;
  stage.run().cluster().RestartAgent(run % 2);
  if (absl::Status status = stage.PlayOn(); !status.ok()) return status;
  const std::vector<Worker> after = stage.Workers();
  for (const Worker& worker : workers) {
    const bool kept = host::IsAlive(worker.pid) && std::ranges::any_of(after, [&](const Worker& other) {
                        return other.region == worker.region && other.pid == worker.pid;
                      });
    if (!kept) ++outcome.workers_lost;
  }
  return absl::OkStatus();
}

// The same time twice with it and once without.
absl::Status KillControl(FailoverStage& stage, double away_s, FailoverOutcome& outcome) {
  const std::vector<Worker> workers = stage.Workers();
  std::vector<double> late;
  late.reserve(3);
  for (const bool away : {false, false, true}) {
    if (away) stage.run().cluster().KillControl();
    const double before = SumOf(workers, kLateTicks);
    if (absl::Status status = stage.PlayFor(away_s); !status.ok()) return status;
    late.push_back(SumOf(workers, kLateTicks) - before);
  }
  outcome.late_ticks.push_back({late[0], late[1], late[2]});
  std::cerr << fmt::format("failover: late ticks {:.0f}, {:.0f}, and without control plane {:.0f}\n", late[0], late[1],
                           late[2]);
  stage.run().cluster().RestartControl();
  stage.run().WatchAnew();
  return absl::OkStatus();
}

}  // namespace

std::vector<Fault> AllFaults(const FailoverSize& size, local::HostNetwork* network) {
  std::vector<Fault> faults{
      {"worker", KillWorker},
      {"pair", KillPair},
      {"host", KillHost},
      {"freeze", FreezeHost},
      {"agent", KillAgent, [](local::RunOptions& options) { options.workers_outlive_agents = true; }}};
  if (network != nullptr) {
    faults.push_back({"link",
                      [network](FailoverStage& stage, std::uint32_t run, FailoverOutcome& outcome) {
                        return CutLink(stage, run, *network, outcome);
                      },
                      [network](local::RunOptions& options) { options.network = network; }});
  }
  faults.push_back(
      {"control", [away_s = size.control_away_s](FailoverStage& stage, std::uint32_t, FailoverOutcome& outcome) {
         return KillControl(stage, away_s, outcome);
       }});
  return faults;
}

namespace {

constexpr double kMostFailed = 5;  // then what is wrong is not the chance of a run
constexpr double kPaceSpan_s = 2;
constexpr int kPaceTries = 5;  // a burst of other work on the machine passes

// UNAVAILABLE: the stage is too slow to be struck.
absl::Status AwaitPace(FailoverStage& stage, FailoverOutcome& outcome) {
  StagePace pace;
  for (int tries = 0; tries < kPaceTries; ++tries) {
    const absl::StatusOr<StagePace> measured = stage.MeasurePace(kPaceSpan_s);
    if (!measured.ok()) return measured.status();
    pace = *measured;
    if (!IsInTime(pace)) continue;
    outcome.late_frames = std::max(outcome.late_frames, pace.late_frame_share());
    outcome.late_ticks_before_strike = std::max(outcome.late_ticks_before_strike, pace.late_tick_share());
    return absl::OkStatus();
  }
  return absl::UnavailableError(fmt::format("the stage is too slow: {:.0f} % of frames and {:.0f} % of ticks are late",
                                            100 * pace.late_frame_share(), 100 * pace.late_tick_share()));
}

// The world as it is, or a new one. `too_slow`: the stage was, and nothing was struck.
absl::Status StrikeOnce(const Fault& fault, const FailoverSize& size, std::uint32_t run,
                        std::unique_ptr<FailoverStage>& stage, FailoverOutcome& outcome, bool& too_slow) {
  try {
    if (stage == nullptr) {
      local::RunOptions options = StageOptions(size);
      if (fault.prepare) fault.prepare(options);
      stage = std::make_unique<FailoverStage>(options, FailoverStage::Players::kProcesses);
    }
    absl::Status status = stage->PlayUntilWell();
    if (status.ok()) status = AwaitPace(*stage, outcome);
    too_slow = absl::IsUnavailable(status);
    if (too_slow) return status;
    if (status.ok()) status = fault.strike(*stage, run, outcome);
    if (status.ok()) status = stage->PlayOn();
    stage->TakeCensus(outcome);
    return status;
  } catch (const std::exception& error) {  // a program could not be started
    return absl::InternalError(error.what());
  }
}

}  // namespace

absl::Status RunFault(const Fault& fault, const FailoverSize& size, Report& report) {
  using Clock = std::chrono::steady_clock;
  FailoverOutcome outcome;
  std::unique_ptr<FailoverStage> stage;
  std::uint32_t run = 0;  // those that count
  while (run < size.runs && outcome.runs_failed < kMostFailed && outcome.runs_too_slow < size.runs) {
    const auto begin = Clock::now();
    bool too_slow = false;
    const absl::Status status = StrikeOnce(fault, size, run, stage, outcome, too_slow);
    ++(too_slow ? outcome.runs_too_slow : status.ok() ? outcome.runs : outcome.runs_failed);
    std::cerr << fmt::format("failover: {} {} of {}: {:.0f} s{}{}, lost {}, doubled {}\n", fault.name, run + 1,
                             size.runs, std::chrono::duration<double>(Clock::now() - begin).count(),
                             outcome.gaps_ms.empty() ? "" : fmt::format(", gap {:.0f} ms", outcome.gaps_ms.back()),
                             status.ok() ? ""
                             : too_slow  ? ", does not count: " + std::string(status.message())
                                         : ", failed: " + std::string(status.message()),
                             outcome.lost, outcome.duplicated);
    if (!status.ok() && !too_slow) stage.reset();
    if (!too_slow) ++run;
    outcome.AddTo(fault.name, size, report);
    if (absl::Status saved = report.Save(); !saved.ok()) return saved;
  }
  if (outcome.runs_failed >= kMostFailed) {
    return absl::InternalError(fmt::format("{}: too many runs failed", fault.name));
  }
  if (run >= size.runs) return absl::OkStatus();
  return absl::UnavailableError(fmt::format("{}: the stage was too slow {} times; {} of {} runs count", fault.name,
                                            outcome.runs_too_slow, run, size.runs));
}

}  // namespace tessera::bench
