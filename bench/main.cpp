// tessera-bench: runs a suite, prints its table and writes its figures as CSV. Exit status 0, 1 when it could not be
// run, 2 for usage.
#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <iostream>
#include <string>

#include "bench/accuracy.h"
#include "bench/attack_seat.h"
#include "bench/borders.h"
#include "bench/crowd.h"
#include "bench/dissertation.h"
#include "bench/failover.h"
#include "bench/flood_seat.h"
#include "bench/games.h"
#include "bench/lasting.h"
#include "bench/lean.h"
#include "bench/people.h"
#include "bench/player_seat.h"
#include "bench/report.h"
#include "bench/sdk.h"
#include "bench/snapshots.h"
#include "bench/soak.h"
#include "bench/speed.h"
#include "bench/stability.h"
#include "bench/suite.h"
#include "bench/trust.h"

namespace tessera::bench {
namespace {

absl::Status Dissertation(const SuiteOptions& options, Report& report) {
  return RunDissertation({.seconds = options.quick ? 3.0 : 20.0}, report);
}

struct Suite {
  const char* name;
  const char* about;
  absl::Status (*run)(const SuiteOptions&, Report&);
};

constexpr Suite kSuites[] = {
    {"accuracy", "Error against CPU time over step lengths and solver settings, against Bullet, ODE and MuJoCo",
     RunAccuracy},
    {"stability", "What must stand, hold, roll, swing, rebound or be refused, and by how much it does not",
     RunStability},
    {"speed", "Many bodies: CPU time, penetration and drift against stock Bullet, runs interleaved", RunSpeed},
    {"lean", "What a scene does not need: its cost where it is present but unneeded", RunLean},
    {"borders", "1, 2, 4, 9 regions against one world: errors, momentum, outcomes, prediction, and what they cost",
     RunBorders},
    {"crowd",
     "All players and bodies in one spot against the same ones spread out: the busiest region's CPU, clients' bytes "
     "and "
     "rates; --only takes regions=1, regions=4, balanced or threads",
     RunCrowd},
    {"games", "Game code: a callback against bare Lua and against a step, and bodies that come and go", RunGames},
    {"snapshots", "Bits and time to show 901 cubes: a bit packer step by step, the fast and the dense coder",
     RunSnapshots},
    {"failover",
     "What the death of workers, hosts, agents and of the control plane costs a world of four regions, and growth, "
     "balancing and restoring. About 50 minutes; --only takes worker, pair, host, freeze, agent, link, control, scale, "
     "hot-spot, restore or standby",
     RunFailover},
    {"lasting",
     "Three control planes, three members of etcd and three hosts under faults: what is lost, doubled or misstated, "
     "and "
     "how long each takes. About 20 minutes; --only takes kill-leader, stop-leader, cut-leader, lose-leader, "
     "cut-leader-with-host, kill-store, stop-store, kill-worker, kill-agent, freeze-host, cut-host, orphan, "
     "slow-store, full-store, full-disk, restored, upgrade or takeover",
     RunLastingSuite},
    {"soak",
     "An hour at full load with scalings, deaths and joins in turns: growth of memory and handles, and how long steps "
     "take at the end against the beginning",
     RunSoak},
    {"people",
     "What it costs to show a world to people: gateway, viewers, page and swarm. About 20 minutes; --only takes ready, "
     "viewers, slow, gap, swarm or page",
     RunPeople},
    {"trust",
     "What attackers get, and what they cost: doors of the control plane, floods at a region, an eviction, much coming "
     "and going. --only takes attacks, create, ticks, evict or churn",
     RunTrust},
    {"sdk",
     "What a game ships with the client library and what it costs: files, memory, first polls of a large scene, polls "
     "after a pause; --only takes ship, first_polls, late_polls, throws or frame",
     RunSdk},
    {"dissertation", "The dissertation's evaluation: 2 and 3 regions, 1 and 100 objects each, two clients",
     Dissertation},
};

int Run(const Suite& suite, const SuiteOptions& options) {
  Report report(suite.name);
  report.SaveTo(options.csv);
  absl::Status status;
  try {
    status = suite.run(options, report);
  } catch (const std::exception& error) {
    status = absl::InternalError(error.what());
  }
  std::cout << report.Table();  // as far as it is, even if a part failed
  if (status.ok()) status = report.Save();
  if (!status.ok()) {
    std::cerr << fmt::format("tessera-bench: {}\n", std::string(status.message()));
    return 1;
  }
  return 0;
}

int Main(int argc, char** argv) {
  CLI::App app{"Benchmarks of Tessera"};
  app.require_subcommand(1);
  SuiteOptions options;
  for (const Suite& suite : kSuites) {
    CLI::App* command = app.add_subcommand(suite.name, suite.about);
    command->add_option("--csv", options.csv, "Also write the figures to this file");
    command->add_flag("--quick", options.quick, "Smaller and shorter: a look, not a measurement");
    command->add_option("--only", options.only, "Run only scenes whose names contain this");
    if (suite.run == RunLean) {
      command->add_option("--part", options.part, "Measure nothing: run one side of each pair alone, for a profiler")
          ->check(CLI::IsMember({"without", "with", "needed"}));
    }
    if (suite.run == RunFailover) {
      command->add_option("--runs", options.runs, "How often each fault strikes, if not 20 times (--quick: twice)");
    }
    if (suite.run == RunSoak) {
      command->add_option("--minutes", options.minutes, "How long it runs, if not 60 minutes (--quick: 2)")
          ->check(CLI::Range(0.5, 10'000.0));
    }
    if (suite.run == RunLastingSuite) {
      command->add_option("--runs", options.runs, "How many faults strike, if not 60 (--quick: 15)");
    }
  }
  // The suites start this program anew as a player and as an attacker.
  PlayerSeat seat;
  CLI::App* player = app.add_subcommand("player", "Play in a world")->group("");
  player->add_option("control", seat.control)->required();
  player->add_option("instance", seat.instance)->required();
  player->add_option("seed", seat.seed)->required();
  AttackSeat attack;
  CLI::App* attacker = app.add_subcommand("attacker", "Attack a control plane")->group("");
  attacker->add_option("name", attack.name)->required();
  attacker->add_option("socket", attack.target.socket)->required();
  attacker->add_option("operators", attack.target.operators)->required();
  attacker->add_option("players", attack.target.players)->required();
  attacker->add_option("world", attack.world)->required();
  attacker->add_option("import_mb", attack.size.import_mb)->required();
  attacker->add_option("lease_requests", attack.size.lease_requests)->required();
  attacker->add_option("join_threads", attack.size.join_threads)->required();
  attacker->add_option("joins_each", attack.size.joins_each)->required();
  FloodSeat flood;
  CLI::App* flooder = app.add_subcommand("flooder", "Flood a region")->group("");
  flooder->add_option("kind", flood.kind)->required();
  flooder->add_option("port", flood.port)->required();
  flooder->add_option("control", flood.control)->required();
  flooder->add_option("instance", flood.instance)->required();
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  if (app.got_subcommand(player)) return PlayInSeat(seat);
  if (app.got_subcommand(attacker)) return AttackFromSeat(attack);
  if (app.got_subcommand(flooder)) return FloodFromSeat(flood);
  for (const Suite& suite : kSuites) {
    if (app.got_subcommand(suite.name)) return Run(suite, options);
  }
  return 2;
}

}  // namespace
}  // namespace tessera::bench

int main(int argc, char** argv) {
  const int exit_code = tessera::bench::Main(argc, argv);
  std::cout.flush();
  _exit(exit_code);  // not by return, as in cli/main.cpp
}
