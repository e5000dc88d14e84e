// Cost of a player of `tessera swarm`, against a process of `tessera client` for each: both 30 frames a second, with
// prediction, with all bodies read in each frame. CPU time counts from when all are in.
#include <fmt/format.h>

#include <chrono>
#include <csignal>
#include <iostream>
#include <nlohmann/json.hpp>
#include <thread>

#include "bench/people_scenes.h"
#include "bench/people_stage.h"
#include "bench/statistics.h"
#include "host/files.h"
#include "local_cluster/command_error.h"

namespace tessera::bench {
namespace {

using Clock = std::chrono::steady_clock;
using namespace std::chrono_literals;

constexpr std::uint32_t kBodiesInView = 200;  // with the players' own
constexpr const char* kPlayerRate_hz = "30";
constexpr auto kJoining = 60s;
constexpr std::size_t kMaxReport_bytes = 1 << 20;

// Programs that play together.
class Crowd {
 public:
  explicit Crowd(local::WorldRun& run) : run_(run) {}

  void Start(std::vector<std::string> arguments) {
    std::vector<std::string> argv{local::ProgramPath("tessera"), "--control", run_.cluster().control_address(), "-o",
                                  "json"};
    argv.insert(argv.end(), arguments.begin(), arguments.end());
    const std::string log = fmt::format("{}/{}", folder_.path(), programs_.size());
    programs_.push_back(
        local::OrThrow(host::ChildProcess::Start({.argv = argv, .log_path = log, .output_path = log + ".json"})));
  }

  // CPU time that they take in so many seconds, all players in.
  double CpuOver(double seconds, std::uint32_t players) {
    AwaitPlayers(players);
    const double before = CpuSeconds();
    std::this_thread::sleep_for(std::chrono::duration<double>(seconds));
    const double took = CpuSeconds() - before;
    RequireRunning(run_);
    return took;
  }

  // All leave; what the first of them has measured.
  nlohmann::json End() {
    for (const host::ChildProcess& program : programs_) program.Signal(SIGTERM);
    for (host::ChildProcess& program : programs_) {
      const auto ended = program.Wait(30s);
      if (!ended || !ended->Clean())
        throw local::CommandError("a player's program " + (ended ? ended->Describe() : "did not end"));
    }
    AwaitPlayers(0);
    return nlohmann::json::parse(local::OrThrow(host::ReadFile(folder_.path() + "/0.json", kMaxReport_bytes)));
  }

 private:
  void AwaitPlayers(std::uint32_t players) {
    if (!run_.PlayUntil([&] { return run_.Latest().players() == players; }, kJoining)) {
      throw local::CommandError(fmt::format("{} players are in instead of {}", run_.Latest().players(), players));
    }
    std::this_thread::sleep_for(1s);  // that what a beginning costs is over
  }
  double CpuSeconds() const {
    double sum = 0;
    for (const host::ChildProcess& program : programs_) sum += ProcessCpuSeconds(program.pid());
    return sum;
  }

  local::WorldRun& run_;
  host::TemporaryFolder folder_;
  std::vector<host::ChildProcess> programs_;
};

struct SwarmOutcome {
  std::vector<double> ratio, swarm, clients, late, bodies;
};

void SwarmRound(const PeopleSize& size, local::WorldRun& run, SwarmOutcome& outcome) {
  const double player_seconds = size.players * size.swarm_span_s;
  Crowd swarm(run);
  swarm.Start({"swarm", run.instance_id(), "--players", std::to_string(size.players), "--rate", kPlayerRate_hz});
  const double together = swarm.CpuOver(size.swarm_span_s, size.players);
  const nlohmann::json told = swarm.End();
  Crowd clients(run);
  for (std::uint32_t i = 1; i <= size.players; ++i) {
    clients.Start({"client", run.instance_id(), "--name", fmt::format("client-{}", i), "--seed", std::to_string(i),
                   "--rate", kPlayerRate_hz, "--predict"});
  }
  const double apart = clients.CpuOver(size.swarm_span_s, size.players);
  clients.End();
  outcome.ratio.push_back(apart / together);
  outcome.swarm.push_back(player_seconds / together);
  outcome.clients.push_back(player_seconds / apart);
  outcome.late.push_back(told.at("late_share").get<double>());
  outcome.bodies.push_back(told.at("mean_bodies").get<double>());
}

}  // namespace

absl::Status RunSwarm(const PeopleSize& size, Report& report) {
  local::WorldRun run(PlazaOptions(kBodiesInView - size.players));
  SettlePlaza(run);
  SwarmOutcome outcome;
  for (std::uint32_t round = 0; round < size.swarm_rounds; ++round) {
    SwarmRound(size, run, outcome);
    std::cerr << fmt::format("people: swarm {} of {}: {:.0f} players a CPU second, {:.2f} x, late {:.4f}\n", round + 1,
                             size.swarm_rounds, outcome.swarm.back(), outcome.ratio.back(), outcome.late.back());
  }
  const std::string config = fmt::format("players={}", size.players);
  report.Add("swarm", kPeopleEngine, config, "rounds", size.swarm_rounds, "1");
  report.Add("swarm", kPeopleEngine, config, "bodies_in_view", Median(outcome.bodies), "1");
  AddSpread(report, "swarm", config, "swarm_ratio", outcome.ratio, "1");
  AddSpread(report, "swarm", config, "swarm_players_a_cpu_second", outcome.swarm, "1");
  AddSpread(report, "swarm", config, "client_players_a_cpu_second", outcome.clients, "1");
  AddSpread(report, "swarm", config, "swarm_late_share", outcome.late, "1");
  return absl::OkStatus();
}

}  // namespace tessera::bench
