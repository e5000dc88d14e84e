// tessera swarm: many players in one process, to load a world.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "cli/checks.h"
#include "cli/commands.h"
#include "cli/contexts.h"
#include "cli/signals.h"
#include "cli/table.h"
#include "cli/ticket_argument.h"
#include "local_cluster/command_error.h"
#include "local_cluster/swarm.h"

namespace tessera::cli {
namespace {

using namespace std::chrono_literals;

struct SwarmCommand {
  std::string instance;
  std::string name = "swarm";
  std::size_t players = 10;
  double rate_hz = 30;
  double seconds = 0;
  std::uint64_t seed = 1;
  std::string ticket;
};

double LateShare(const local::SwarmReport& report) {
  const std::uint64_t wanted = report.polls + report.late_polls;
  return wanted == 0 ? 0 : static_cast<double>(report.late_polls) / static_cast<double>(wanted);
}

double Ratio(double part, double whole) { return whole > 0 ? part / whole : 0; }

// Says how the time between two reports went.
std::string Line(const local::SwarmReport& before, const local::SwarmReport& now) {
  const double seconds = now.seconds - before.seconds;
  local::SwarmReport since;
  since.polls = now.polls - before.polls;
  since.late_polls = now.late_polls - before.late_polls;
  return fmt::format(
      "{:>4} of {} players  {:>6.0f} polls/s  {:>5.1f} % late  {:>5.2f} cores  {:>9}/s in  {:>9}/s out  "
      "{:>5.0f} bodies in view\n",
      now.in, now.wanted, Ratio(static_cast<double>(since.polls), seconds), 100 * LateShare(since),
      Ratio(now.cpu_seconds - before.cpu_seconds, seconds),
      FormatBytes(Ratio(static_cast<double>(now.bytes_in - before.bytes_in), seconds)),
      FormatBytes(Ratio(static_cast<double>(now.bytes_out - before.bytes_out), seconds)), now.mean_bodies);
}

std::string Summary(const local::SwarmReport& report) {
  const auto per_player_s = [&](double amount) { return Ratio(amount, report.player_seconds); };
  return FormatTable({
      {"players", fmt::format("{} of {}", report.joined, report.wanted)},
      {"polls", fmt::format("{}, {:.2f} % late", report.polls, 100 * LateShare(report))},
      {"a poll", fmt::format("{} p50, {} p99", FormatMillis(report.poll_p50_s), FormatMillis(report.poll_p99_s))},
      {"CPU a player", fmt::format("{:.4f} of a core", per_player_s(report.cpu_seconds))},
      {"traffic a player", fmt::format("{}/s in, {}/s out", FormatBytes(per_player_s(double(report.bytes_in))),
                                       FormatBytes(per_player_s(double(report.bytes_out))))},
      {"corrections", fmt::format("{:.2f} a player and second", per_player_s(double(report.corrections)))},
  });
}

nlohmann::ordered_json Json(const local::SwarmReport& report) {
  return {{"players_wanted", report.wanted},
          {"players_joined", report.joined},
          {"seconds", report.seconds},
          {"player_seconds", report.player_seconds},
          {"cpu_seconds", report.cpu_seconds},
          {"polls", report.polls},
          {"late_polls", report.late_polls},
          {"late_share", LateShare(report)},
          {"poll_p50_s", report.poll_p50_s},
          {"poll_p99_s", report.poll_p99_s},
          {"bytes_in", report.bytes_in},
          {"bytes_out", report.bytes_out},
          {"corrections", report.corrections},
          {"extrapolations", report.extrapolations},
          {"mean_bodies", report.mean_bodies},
          {"join_error", std::string(report.join_error.message())},
          {"end_reason", std::string(report.end_reason.message())}};
}

// One for each player, or none at all.
std::vector<std::string> TicketsOf(const SwarmCommand& command) {
  if (command.ticket.empty()) return {};
  std::vector<std::string> tickets = TicketsFrom(command.ticket);
  if (tickets.size() < command.players) {
    throw local::CommandError(fmt::format("--ticket {}: {} for {} players; each needs one of its own", command.ticket,
                                          tickets.size(), command.players));
  }
  return tickets;
}

void Run(const Globals& globals, const SwarmCommand& command) {
  StopSignal stop;
  const bool tables = globals.format == Format::kTable || globals.format == Format::kWide;
  local::Swarm swarm({.control = ControlOf(globals),
                      .instance_id = command.instance,
                      .name = command.name,
                      .players = command.players,
                      .rate_hz = command.rate_hz,
                      .seed = command.seed,
                      .tickets = TicketsOf(command)});
  local::SwarmReport before;
  const auto start = client::Clock::now();
  auto next_line = start + 1s;
  bool over = false;
  for (bool going = true; going && !over;) {
    going = swarm.Run(100ms);
    over = stop.Wait(0ms) ||
           (command.seconds > 0 && client::Clock::now() - start >= std::chrono::duration<double>(command.seconds));
    if (!tables || client::Clock::now() < next_line) continue;
    next_line += 1s;
    const local::SwarmReport now = swarm.Report();
    std::cout << Line(before, now) << std::flush;
    before = now;
  }
  const local::SwarmReport report = swarm.Report();
  if (report.joined == 0 && !report.join_error.ok()) {
    throw local::CommandError("swarm: " + std::string(report.join_error.message()));
  }
  if (globals.format == Format::kJson) std::cout << Json(report).dump(2) << "\n";
  if (tables) std::cout << "\n" << Summary(report);
  const absl::Status left = swarm.Leave();
  if (!report.join_error.ok()) {
    throw local::CommandError(fmt::format("swarm: {} of {} players came in: {}", report.joined, report.wanted,
                                          std::string(report.join_error.message())));
  }
  for (const absl::Status& status : {report.end_reason, left}) {
    if (!status.ok()) throw local::CommandError("swarm: " + std::string(status.message()));
  }
}

}  // namespace

void AddSwarmCommand(CLI::App& app, Globals& globals) {
  auto command = std::make_shared<SwarmCommand>();
  CLI::App* swarm = app.add_subcommand("swarm", "Load a world with many players in one process");
  swarm->add_option("id", command->instance, "Id of the instance, as 'instance list' shows it")->required();
  swarm->add_option("--players", command->players, "How many")->capture_default_str()->check(CLI::Range(1, 10'000));
  swarm->add_option("--rate", command->rate_hz, "Frames of a player a second")
      ->capture_default_str()
      ->check(CLI::Range(1.0, 240.0))
      ->check(Finite());
  swarm->add_option("--seconds", command->seconds, "End after so many seconds (default: on Ctrl-C)")
      ->check(CLI::NonNegativeNumber)
      ->check(Finite());
  swarm->add_option("--seed", command->seed, "Seed of the players' ways through the world, from 1")
      ->capture_default_str()
      ->check(CLI::PositiveNumber);
  CLI::Option* name =
      swarm->add_option("--name", command->name, "Names of the players begin so")->capture_default_str();
  swarm->add_option("--ticket", command->ticket, "A file with a ticket a line, one for each player")->excludes(name);
  swarm->callback([&globals, command] { Run(globals, *command); });
}

}  // namespace tessera::cli
