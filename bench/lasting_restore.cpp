#include "bench/lasting_restore.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <functional>
#include <future>
#include <iostream>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "bench/failover_stage.h"
#include "bench/statistics.h"
#include "local_cluster/bot.h"
#include "local_cluster/connection.h"
#include "local_cluster/instance_watch.h"
#include "local_cluster/local_cluster.h"

namespace tessera::bench {
namespace {

using Clock = std::chrono::steady_clock;
using std::chrono::milliseconds;

constexpr const char* kRestoreEngine = "tessera";
constexpr const char* kRestoreScene = "plaza";
constexpr std::chrono::seconds kRestorePatience{120};
constexpr double kPlayed_s = 2;  // between two things that are done to a world
constexpr const char* kLongestTickOfUpgrade = "tessera_region_longest_tick_seconds";
constexpr const char* kLongestWorkOfUpgrade = "tessera_region_longest_tick_cpu_seconds";
constexpr double kLongestTickSpan_s = 10;        // it is of the last 5 to 10 s, in which no world is to begin
constexpr double kTicksPerSecondOfUpgrade = 60;  // as the scene has it
constexpr double kStood_ms = 300;                // longer than a failover, after which nobody has to come back

double MillisecondsBetween(Clock::time_point from, Clock::time_point to) {
  return std::max(0.0, std::chrono::duration<double, std::milli>(to - from).count());
}

FailoverSize StageSize(const RestoreSize& size) {
  return {.runs = 1,
          .bodies = size.bodies,
          .bots = size.players,
          .control_away_s = 0,
          .scale_rounds = 0,
          .restored_bodies = 0};
}

std::set<pid_t> PidsOf(FailoverStage& stage) {
  std::set<pid_t> pids;
  for (const Worker& worker : stage.Workers()) pids.insert(worker.pid);
  return pids;
}

// All regions step, none of them in one of these processes.
bool RunsAnew(const v1::Instance& latest, const std::set<pid_t>& before, std::size_t regions) {
  return latest.state() == v1::INSTANCE_STATE_RUNNING && latest.region_status_size() == static_cast<int>(regions) &&
         std::ranges::all_of(latest.region_status(), [&](const v1::RegionStatus& status) {
           return status.report().phase() == v1::WORKER_PHASE_RUNNING &&
                  !before.contains(static_cast<pid_t>(status.report().identity().pid()));
         });
}

bool SeesItself(local::Bot& bot) {
  return bot.client().state() == client::ClientState::kPlaying &&
         bot.client().World().contains(bot.client().own_body());
}

// The longest time in which a player saw the world at no newer tick, from its making on.
class LongestGap {
 public:
  explicit LongestGap(const std::vector<local::Bot*>& bots) : bots_(bots), seen_(bots.size()) {}
  void Look() {
    const Clock::time_point now = Clock::now();
    for (std::size_t i = 0; i < bots_.size(); ++i) {
      Seen& seen = seen_[i];
      const Tick tick = bots_[i]->client().tick();
      if (seen.at != Clock::time_point() && tick == seen.tick) {
        longest_ms_ = std::max(longest_ms_, MillisecondsBetween(seen.at, now));
      } else {
        seen = {tick, now};
      }
    }
  }
  double longest_ms() const { return longest_ms_; }

 private:
  struct Seen {
    Tick tick;
    Clock::time_point at{};
  };
  std::vector<local::Bot*> bots_;
  std::vector<Seen> seen_;
  double longest_ms_ = 0;
};

// Until a call that blocks is over; others go on meanwhile. An error of it is thrown here.
absl::Status AwaitBeside(FailoverStage& stage, const std::string& what, std::future<void>& call,
                         const std::function<void()>& look) {
  const absl::Status played = stage.PlayUntil(what, [&] {
    look();
    return call.wait_for(std::chrono::seconds(0)) == std::future_status::ready;
  });
  call.get();
  return played;
}

template <class Add>
void AddWorst(const Add& add, const std::string& metric, std::vector<double> values, const char* unit) {
  add(metric + "_p50", Median(values), unit);
  add(metric, Quantile(values, 1), unit);
}

}  // namespace

// --- Restored --------------------------------------------------------------------------------------------------------

absl::Status RunRestored(const RestoreSize& size, Report& report) {
  std::vector<double> back_ms, gap_ms;
  for (unsigned run = 0; run < size.runs; ++run) {
    // One player: it waits for the control plane's answer while it asks for a grant, and others would wait with it.
    local::RunOptions options = StageOptions(StageSize(size));
    options.bots = 1;
    FailoverStage stage(options);
    if (absl::Status status = stage.PlayUntilWell(); !status.ok()) return status;
    v1::CheckpointInstanceRequest checkpoint;
    checkpoint.set_id(stage.run().instance_id());
    local::Connection& connection = stage.run().connection();
    connection.Call("instance checkpoint", connection.instances(), &v1::InstanceService::Stub::CheckpointInstance,
                    checkpoint, milliseconds(kRestorePatience));
    if (absl::Status status = stage.PlayFor(kPlayed_s); !status.ok()) return status;
    const std::set<pid_t> before = PidsOf(stage);
    for (const pid_t pid : before) kill(pid, SIGKILL);
    const Clock::time_point struck = Clock::now();
    std::atomic<Clock::time_point> runs_again{Clock::time_point()};
    const local::InstanceWatch watch(connection, stage.run().instance_id(), [&](const v1::Instance& latest) {
      const bool first = runs_again.load() == Clock::time_point();
      if (first && RunsAnew(latest, before, options.regions)) runs_again = Clock::now();
    });
    // It stands still for the player, and then goes on.
    LongestGap gap(stage.run().bots());
    double stood_ms = 0;
    Clock::time_point back;
    const absl::Status is_back = stage.PlayUntil("the player is back", [&] {
      gap.Look();
      const bool grows = gap.longest_ms() > stood_ms;
      stood_ms = gap.longest_ms();
      const bool has_stood = stood_ms > kStood_ms;
      if (has_stood && !grows && back == Clock::time_point() && SeesItself(*stage.run().bots().front())) {
        back = Clock::now();
      }
      return runs_again.load() != Clock::time_point() && back != Clock::time_point();
    });
    if (!is_back.ok()) return is_back;
    back_ms.push_back(MillisecondsBetween(runs_again, back));
    gap_ms.push_back(MillisecondsBetween(struck, back));
    std::cerr << fmt::format("lasting: restored {}: runs again after {:.0f} ms, the player is back {:.0f} ms later\n",
                             run + 1, MillisecondsBetween(struck, runs_again), back_ms.back());
  }
  const auto add = [&](const std::string& metric, double value, const char* unit) {
    report.Set(kRestoreScene, kRestoreEngine, "restored", metric, value, unit);
  };
  add("runs", size.runs, "1");
  AddWorst(add, "restored_players_back_ms", back_ms, "ms");
  AddWorst(add, "restored_gap_ms", gap_ms, "ms");
  return report.Save();
}

// --- Upgrades --------------------------------------------------------------------------------------------------------

namespace {

absl::Status UpgradeInstance(const RestoreSize& size, Report& report) {
  std::vector<double> pause_ms;
  double back = 0, lost_ticks = 0;
  for (unsigned run = 0; run < size.runs; ++run) {
    const local::RunOptions options = StageOptions(StageSize(size));
    FailoverStage stage(options);
    if (absl::Status status = stage.PlayUntilWell(); !status.ok()) return status;
    const std::set<pid_t> before = PidsOf(stage);
    LongestGap gap(stage.run().bots());
    auto call = std::async(std::launch::async, [&] {
      v1::UpgradeInstanceRequest request;
      request.set_id(stage.run().instance_id());
      local::Connection& connection = stage.run().connection();
      connection.Call("instance upgrade", connection.instances(), &v1::InstanceService::Stub::UpgradeInstance, request,
                      milliseconds(kRestorePatience));
    });
    absl::Status status = AwaitBeside(stage, "upgraded", call, [&] { gap.Look(); });
    if (status.ok()) {
      // Before the new processes step a player sees the old world, which stands: a later tick is of the new one.
      std::vector<Tick> stood;
      status = stage.PlayUntil("every player is back", [&] {
        gap.Look();
        const std::vector<local::Bot*>& bots = stage.run().bots();
        if (stood.empty()) {
          if (!RunsAnew(stage.run().Latest(), before, options.regions)) return false;
          for (local::Bot* bot : bots) stood.push_back(bot->client().tick());
        }
        for (std::size_t i = 0; i < bots.size(); ++i) {
          if (bots[i]->client().tick() == stood[i] || !SeesItself(*bots[i])) return false;
        }
        return true;
      });
    }
    if (!status.ok()) return status;
    pause_ms.push_back(gap.longest_ms());
    back += static_cast<double>(stage.run().bots().size());
    lost_ticks += static_cast<double>(stage.run().Latest().lost_ticks());
    std::cerr << fmt::format("lasting: upgraded {}: players saw it stand for {:.0f} ms\n", run + 1, pause_ms.back());
  }
  const auto add = [&](const std::string& metric, double value, const char* unit) {
    report.Set(kRestoreScene, kRestoreEngine, "upgrade", metric, value, unit);
  };
  add("runs", size.runs, "1");
  AddWorst(add, "upgrade_pause_ms", pause_ms, "ms");
  add("upgrade_back", back / (size.runs * size.players), "1");
  add("upgrade_lost_ticks", lost_ticks, "1");
  return report.Save();
}

// Programs of the release before, from which a cluster is upgraded; empty: it is restarted with its own ones.
std::string OtherRelease() {
  const char* folder = std::getenv("TESSERA_OTHER_RELEASE");
  return folder == nullptr ? "" : folder;
}

// The longest tick of any region, and the most time that one took of a processor, as its figures of the last ticks had
// them at each look.
class LongestTicks {
 public:
  void Look(const std::vector<Worker>& workers) {
    whole_s_ = std::max(whole_s_, HighestOf(workers, kLongestTickOfUpgrade));
    worked_s_ = std::max(worked_s_, HighestOf(workers, kLongestWorkOfUpgrade));
  }
  double ticks() const { return whole_s_ * kTicksPerSecondOfUpgrade; }
  double worked_ticks() const { return worked_s_ * kTicksPerSecondOfUpgrade; }

 private:
  double whole_s_ = 0, worked_s_ = 0;
};

struct UpgradeFigures {
  std::vector<double> gaps_ms, longest_ticks, longest_work_ticks;
  std::vector<double> ticks_before, work_ticks_before;  // looked at as often, while nothing was done
};

// Looks as often while nothing is done: these ticks come by themselves, or with the looks, on this machine.
absl::Status LookBefore(FailoverStage& stage, std::size_t hosts, UpgradeFigures& figures) {
  const std::vector<Worker> workers = stage.Workers();
  LongestTicks longest;
  for (std::size_t look = 0; look <= hosts; ++look) {
    if (absl::Status status = stage.PlayFor(kPlayed_s); !status.ok()) return status;
    longest.Look(workers);
  }
  figures.ticks_before.push_back(longest.ticks());
  figures.work_ticks_before.push_back(longest.worked_ticks());
  return absl::OkStatus();
}

// One program after the other, as packages are installed; the control plane first.
absl::Status RestartOnce(FailoverStage& stage, std::size_t hosts, UpgradeFigures& figures) {
  local::LocalCluster& cluster = stage.run().cluster();
  const std::vector<Worker> workers = stage.Workers();
  // Nobody plays for the moment in which the control plane begins anew; regions do not wait for it.
  cluster.KillControl();
  cluster.UseControlPrograms("");
  cluster.RestartControl();
  stage.run().WatchAnew();
  LongestGap gap(stage.run().bots());
  const Clock::time_point until = Clock::now() + milliseconds(static_cast<int>(1000 * kPlayed_s));
  const absl::Status began = stage.PlayUntil("the control plane begins anew", [&] {
    gap.Look();
    return Clock::now() >= until;
  });
  if (!began.ok()) return began;
  LongestTicks longest;
  longest.Look(workers);
  // Agents end with the thread that starts them, so players are on another one meanwhile.
  std::atomic<bool> restarted = false;
  auto played = std::async(std::launch::async, [&] {
    return stage.PlayUntil("the agents begin anew", [&] {
      gap.Look();
      return restarted.load();
    });
  });
  for (std::size_t host = 0; host < hosts; ++host) {
    cluster.KillAgent(host);
    cluster.UseAgentPrograms(host, "");
    cluster.RestartAgent(host);
    std::this_thread::sleep_for(std::chrono::duration<double>(kPlayed_s));
    longest.Look(workers);
  }
  restarted = true;
  if (absl::Status status = played.get(); !status.ok()) return status;
  figures.gaps_ms.push_back(gap.longest_ms());
  figures.longest_ticks.push_back(longest.ticks());
  figures.longest_work_ticks.push_back(longest.worked_ticks());
  return stage.PlayOn();
}

absl::Status RestartCluster(const RestoreSize& size, Report& report) {
  FailoverOutcome outcome;
  UpgradeFigures figures;
  const std::string other = OtherRelease();
  for (unsigned run = 0; run < size.runs; ++run) {
    local::RunOptions options = StageOptions(StageSize(size));
    options.hosts = 3;
    options.regions = 6;
    options.workers_outlive_agents = true;
    options.control_programs = other;
    options.agent_programs = other;
    FailoverStage stage(options);
    if (absl::Status status = stage.PlayUntilWell(); !status.ok()) return status;
    if (absl::Status status = stage.PlayFor(kLongestTickSpan_s); !status.ok()) return status;
    if (absl::Status status = LookBefore(stage, options.hosts, figures); !status.ok()) return status;
    if (absl::Status status = RestartOnce(stage, options.hosts, figures); !status.ok()) return status;
    stage.TakeCensus(outcome);
    outcome.runs += 1;
    std::cerr << fmt::format(
        "lasting: {} {}: players saw the world stand for {:.0f} ms at the longest; longest tick {:.2f}, work {:.2f}, "
        "before it {:.2f}, {:.2f}\n",
        other.empty() ? "restarted" : "upgraded the cluster", run + 1, figures.gaps_ms.back(),
        figures.longest_ticks.back(), figures.longest_work_ticks.back(), figures.ticks_before.back(),
        figures.work_ticks_before.back());
  }
  const auto add = [&](const std::string& metric, double value, const char* unit) {
    report.Set(kRestoreScene, kRestoreEngine, other.empty() ? "restarts" : "upgrades", metric, value, unit);
  };
  add("runs", outcome.runs, "1");
  add("upgrade_dropped", outcome.clients_dropped, "1");
  add("upgrade_lost", outcome.lost + outcome.duplicated, "1");
  AddWorst(add, "upgrade_gap_ms", figures.gaps_ms, "ms");
  AddWorst(add, "upgrade_longest_tick_ticks", figures.longest_ticks, "1");
  AddWorst(add, "upgrade_longest_work_ticks", figures.longest_work_ticks, "1");
  AddWorst(add, "upgrade_longest_tick_before_ticks", figures.ticks_before, "1");
  AddWorst(add, "upgrade_longest_work_before_ticks", figures.work_ticks_before, "1");
  return report.Save();
}

}  // namespace

absl::Status RunUpgrades(const RestoreSize& size, Report& report) {
  if (absl::Status status = UpgradeInstance(size, report); !status.ok()) return status;
  return RestartCluster(size, report);
}

}  // namespace tessera::bench
