// tessera-sim: instances under faults, one a seed, until a seed fails or time is up. ./dev sim builds and runs it.
#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <fstream>
#include <iostream>
#include <mutex>
#include <optional>
#include <thread>

#include "CLI/CLI.hpp"
#include "spdlog/spdlog.h"
#include "tests/simulation/deployment_scenario.h"
#include "tests/simulation/leader_sums.h"
#include "tests/simulation/scenario.h"

namespace tessera::simulation {
namespace {

using Clock = std::chrono::steady_clock;

struct SimFlags {
  std::uint64_t seeds = 0, first = 1, seed = 0;
  double minutes = 0;
  unsigned jobs = 2;
  std::string world, csv;
  bool faults = true, figure = false;
};

// The figure: so many handovers, and of them so many of each kind, with no body lost or doubled.
constexpr std::uint64_t kHandovers = 1'000'000, kUnderEach = 50'000, kAssemblies = kHandovers / 5,
                        kCorners = kHandovers / 20, kCutShort = 10'000;

struct SeedSums {
  std::uint64_t runs = 0, failed = 0, steps = 0, handovers = 0, assembly = 0, corner = 0, lost = 0, doubled = 0;
  std::uint64_t cut_short = 0, kills = 0, closings = 0, inputs = 0, packets = 0, dropped = 0;
  double worst_drift = 0;
  std::array<std::uint64_t, kFaultKinds> under{};
  std::array<std::uint64_t, kDeploymentFaultKinds> deployment_faults{};  // that were drawn
  LeaderSums leaders;

  struct Row {
    std::string kind;
    std::uint64_t handovers, goal;
  };
  std::vector<Row> Rows() const {
    std::vector<Row> rows = {{"all", handovers, kHandovers},
                             {"assemblies", assembly, kAssemblies},
                             {"corners", corner, kCorners},
                             {"death_before_confirmation", cut_short, kCutShort}};
    for (std::size_t i = 0; i < kFaultKinds; ++i) {
      // A broken connection is no fault of its own in the figure; it holds up two regions only.
      const bool counts = static_cast<FaultKind>(i) != FaultKind::kBreak;
      rows.push_back({std::string("fault=") + kFaultNames[i], under[i], counts ? kUnderEach : 0});
    }
    return rows;
  }
  bool FigureReached() const {
    return std::ranges::all_of(Rows(), [](const Row& row) { return row.handovers >= row.goal; });
  }

  void Add(const ScenarioOutcome& outcome) {
    ++runs;
    failed += outcome.problems.empty() ? 0 : 1;
    steps += outcome.totals.steps;
    handovers += outcome.totals.handovers;
    assembly += outcome.totals.assembly_handovers;
    corner += outcome.totals.corner_handovers;
    cut_short += outcome.cut_short;
    kills += outcome.totals.kills;
    lost += outcome.lost;
    doubled += outcome.doubled;
    closings += outcome.closings;
    packets += outcome.network.packets;
    dropped += outcome.network.lost;
    worst_drift = std::max(worst_drift, outcome.momentum_drift);
    for (std::size_t i = 0; i < kFaultKinds; ++i) under[i] += outcome.handovers_under[i];
  }
};

DrawOptions OptionsOf(const SimFlags& flags) {
  DrawOptions options;
  options.faults = flags.faults;
  for (std::size_t i = 0; i < kWorlds; ++i) {
    if (flags.world == kWorldNames[i]) options.world = static_cast<WorldKind>(i);
  }
  return options;
}

// Every eighth of the seeds that are not asked for a world is one of a deployment.
constexpr std::uint64_t kSeedsPerDeployment = 8;
constexpr char kDeployment[] = "deployment";
// Deployments with several control planes: worlds of their own, and with each seed whose world is asked to be a
// deployment.
constexpr char kLeaders[] = "leaders";

bool IsDeployment(const SimFlags& flags, std::uint64_t seed) {
  return flags.world == kDeployment || (flags.world.empty() && flags.faults && seed % kSeedsPerDeployment == 0);
}

bool HasLeaders(const SimFlags& flags) { return flags.world == kDeployment || flags.world == kLeaders; }

std::string DescribeSeed(const SimFlags& flags, std::uint64_t seed) {
  if (flags.world == kLeaders) return Describe(DrawLeaders(seed));
  if (flags.world == kDeployment) return Describe(DrawDeployment(seed)) + "; " + Describe(DrawLeaders(seed));
  return IsDeployment(flags, seed) ? Describe(DrawDeployment(seed)) : Describe(DrawScenario(seed, OptionsOf(flags)));
}

std::string Replay(const SimFlags& flags, std::uint64_t seed) {
  return "./dev sim --seed " + std::to_string(seed) + (flags.world.empty() ? "" : " --world " + flags.world) +
         (flags.faults ? "" : " --no-faults");
}

// With nothing but bad network conditions, the world is the same whatever the network does: another network must give
// the same hash.
void CompareNetworks(const Scenario& scenario, ScenarioOutcome& outcome) {
  const ScenarioOutcome again = Run(scenario, scenario.seed + 0x5eed);
  if (again.hash != outcome.hash) outcome.problems.push_back("another network gave another world");
}

ScenarioOutcome RunWorld(const SimFlags& flags, std::uint64_t seed) {
  if (IsDeployment(flags, seed)) return Run(DrawDeployment(seed));
  const Scenario scenario = DrawScenario(seed, OptionsOf(flags));
  ScenarioOutcome outcome = Run(scenario);
  if (scenario.faults.empty() && scenario.players == 0) CompareNetworks(scenario, outcome);
  return outcome;
}

struct SeedOutcome {
  std::optional<ScenarioOutcome> world;
  std::optional<LeaderOutcome> leaders;

  std::vector<std::string> problems() const {
    std::vector<std::string> all;
    if (world) all = world->problems;
    if (leaders) all.insert(all.end(), leaders->problems.begin(), leaders->problems.end());
    return all;
  }
};

SeedOutcome RunSeed(const SimFlags& flags, std::uint64_t seed) {
  SeedOutcome outcome;
  if (flags.world != kLeaders) outcome.world = RunWorld(flags, seed);
  if (HasLeaders(flags)) outcome.leaders = Run(DrawLeaders(seed));
  return outcome;
}

void Add(const SimFlags& flags, std::uint64_t seed, const SeedOutcome& outcome, SeedSums& sums) {
  if (outcome.world) sums.Add(*outcome.world);
  if (outcome.leaders) sums.leaders.Add(*outcome.leaders);
  if (!outcome.world || !IsDeployment(flags, seed)) return;
  for (const DeploymentFault& fault : DrawDeployment(seed).faults) {
    ++sums.deployment_faults[static_cast<std::size_t>(fault.kind)];
  }
}

void Report(const SimFlags& flags, std::uint64_t seed, const SeedOutcome& outcome) {
  std::printf("seed %lu FAILED: %s\n", static_cast<unsigned long>(seed), DescribeSeed(flags, seed).c_str());
  for (const std::string& problem : outcome.problems()) std::printf("  %s\n", problem.c_str());
  std::printf("  replay: %s\n", Replay(flags, seed).c_str());
  std::fflush(stdout);
}

void PrintFigures(const SeedSums& sums, double seconds) {
  const auto n = [](std::uint64_t v) { return static_cast<unsigned long>(v); };
  std::printf("%lu seeds in %.0f s, %lu failed; %lu steps of regions, %lu closings, %lu of %lu packets lost\n",
              n(sums.runs), seconds, n(sums.failed), n(sums.steps), n(sums.closings), n(sums.dropped), n(sums.packets));
  std::printf("%-32s %12s %12s\n", "handovers", "made", "goal");
  for (const SeedSums::Row& row : sums.Rows()) {
    std::printf("  %-30s %12lu %12lu\n", row.kind.c_str(), n(row.handovers), n(row.goal));
  }
  for (std::size_t i = 0; i < kDeploymentFaultKinds; ++i) {
    if (sums.deployment_faults[i] == 0) continue;
    std::printf("  drawn: %-30s %12lu\n", kDeploymentFaultNames[i], n(sums.deployment_faults[i]));
  }
  std::printf("bodies lost %lu, doubled %lu; %lu deaths; worst drift of momentum %.1e\n", n(sums.lost), n(sums.doubled),
              n(sums.kills), sums.worst_drift);
  std::fflush(stdout);
}

void PrintSums(const SeedSums& sums, double seconds) {
  if (sums.runs > 0) PrintFigures(sums, seconds);
  sums.leaders.Print(std::cout);
}

void WriteCsv(const std::string& path, const SeedSums& sums) {
  std::ofstream out(path);
  out << "suite,scene,engine,config,metric,value,unit\n";
  const auto line = [&](const std::string& config, const char* metric, std::uint64_t value) {
    out << "borders,simulator,tessera," << config << ',' << metric << ',' << value << ",bodies\n";
  };
  for (const SeedSums::Row& row : sums.Rows()) line(row.kind, "handovers", row.handovers);
  line("all", "bodies_lost", sums.lost + sums.leaders.lost_bodies);
  line("all", "bodies_duplicated", sums.doubled);
  for (std::size_t i = 0; i < kDeploymentFaultKinds; ++i) {
    if (sums.deployment_faults[i] == 0) continue;
    out << "lasting,simulator,tessera,one_control fault=" << kDeploymentFaultNames[i] << ",faults,"
        << sums.deployment_faults[i] << ",faults\n";
  }
  sums.leaders.WriteCsv(out);
}

int RunOne(const SimFlags& flags) {
  std::printf("seed %lu: %s\n", static_cast<unsigned long>(flags.seed), DescribeSeed(flags, flags.seed).c_str());
  const SeedOutcome outcome = RunSeed(flags, flags.seed);
  SeedSums sums;
  Add(flags, flags.seed, outcome, sums);
  PrintSums(sums, 0);
  if (outcome.world) std::printf("hash %016lx\n", static_cast<unsigned long>(outcome.world->hash));
  if (outcome.leaders) std::printf("leaders' hash %016lx\n", static_cast<unsigned long>(outcome.leaders->hash));
  if (!outcome.problems().empty()) Report(flags, flags.seed, outcome);
  return outcome.problems().empty() ? 0 : 1;
}

int RunMany(const SimFlags& flags) {
  const auto begin = Clock::now();
  const auto seconds = [&] { return std::chrono::duration<double>(Clock::now() - begin).count(); };
  std::atomic<std::uint64_t> next{flags.first};
  std::mutex mutex;
  SeedSums sums;
  double told = 0;
  const auto work = [&] {
    while (true) {
      const std::uint64_t seed = next++;
      if (flags.seeds > 0 && seed >= flags.first + flags.seeds) return;
      if (flags.minutes > 0 && seconds() >= flags.minutes * 60) return;
      if (flags.figure) {
        const std::lock_guard lock(mutex);
        if (sums.FigureReached()) return;
      }
      const SeedOutcome outcome = RunSeed(flags, seed);
      const std::lock_guard lock(mutex);
      Add(flags, seed, outcome, sums);
      if (!outcome.problems().empty()) Report(flags, seed, outcome);
      if (seconds() - told < 30) continue;
      told = seconds();
      PrintSums(sums, told);
    }
  };
  std::vector<std::thread> threads;
  for (unsigned i = 0; i < flags.jobs; ++i) threads.emplace_back(work);
  for (std::thread& thread : threads) thread.join();
  PrintSums(sums, seconds());
  if (!flags.csv.empty()) WriteCsv(flags.csv, sums);
  return sums.failed + sums.leaders.failed == 0 ? 0 : 1;
}

}  // namespace
}  // namespace tessera::simulation

int main(int argc, char** argv) {
  using tessera::simulation::kWorldNames;
  using tessera::simulation::SimFlags;
  using tessera::simulation::WorldKind;
  SimFlags flags;
  std::vector<std::string> worlds(kWorldNames.begin(), kWorldNames.end());
  worlds.emplace_back(tessera::simulation::kDeployment);
  worlds.emplace_back(tessera::simulation::kLeaders);
  CLI::App app{"Runs whole instances in virtual time, each from one seed, under faults drawn from it."};
  app.add_option("--seeds", flags.seeds, "how many seeds (1000, unless --minutes is given)");
  app.add_option("--minutes", flags.minutes, "stop after so many minutes");
  app.add_option("--first", flags.first, "the first seed")->capture_default_str();
  app.add_option("--seed", flags.seed, "run this seed alone and tell all of it");
  app.add_option("--world", flags.world, "only worlds of this kind")->check(CLI::IsMember(worlds));
  app.add_flag("--figure", flags.figure,
               "worlds of the kind stream until a million handovers of all kinds are made, or --minutes are up");
  app.add_flag("!--no-faults", flags.faults, "without faults");
  app.add_option("--jobs", flags.jobs, "threads")->capture_default_str();
  app.add_option("--csv", flags.csv, "write the counts there, in the form of the benchmarks");
  CLI11_PARSE(app, argc, argv);
  spdlog::set_level(spdlog::level::off);  // workers, agents and control planes say what they do
  if (flags.figure && flags.world.empty()) flags.world = kWorldNames[static_cast<std::size_t>(WorldKind::kStream)];
  if (flags.seed != 0) return tessera::simulation::RunOne(flags);
  if (flags.seeds == 0 && flags.minutes == 0 && !flags.figure) flags.seeds = 1000;
  return tessera::simulation::RunMany(flags);
}
