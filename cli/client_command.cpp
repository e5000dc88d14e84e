// tessera client: a bot that joins a world and reports what it sees.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "cli/client_view.h"
#include "cli/commands.h"
#include "cli/signals.h"
#include "local_cluster/bot.h"
#include "local_cluster/connection.h"

namespace tessera::cli {
namespace {

using namespace std::chrono_literals;

struct Options {
  std::string instance;
  std::string name = "bot";
  double seconds = 0;
  std::uint64_t seed = 1;
  bool leave = true;
};

void Run(const Globals& globals, const Options& options) {
  StopSignal stop;
  auto joined = local::Bot::Join(globals.control, options.instance, options.name, options.seed);
  if (!joined.ok()) throw local::CommandError("client: " + std::string(joined.status().message()));
  local::Bot& bot = **joined;
  const bool table = globals.format == Format::kTable || globals.format == Format::kWide;
  if (table)
    std::cout << fmt::format("joined {} as player {}\n", options.instance, bot.client().player().value()) << std::flush;
  const auto start = client::Clock::now();
  auto next_line = start + 1s;
  bool going = true;
  while (going && !stop.Wait(kFrameTime)) {
    const auto now = client::Clock::now();
    going = bot.Frame(now);
    if (table && now >= next_line) {
      next_line += 1s;
      std::cout << ClientLine(bot) << std::flush;
    }
    if (options.seconds > 0 && now - start >= std::chrono::duration<double>(options.seconds)) break;
  }
  if (!going && !bot.client().reason().ok())
    throw local::CommandError("client: " + std::string(bot.client().reason().message()));
  if (globals.format == Format::kJson) std::cout << ClientJson(bot).dump(2) << "\n";
  if (table) std::cout << "\n" << ClientReport(bot);
  if (options.leave) {
    if (const absl::Status left = bot.client().Leave(); !left.ok())
      throw local::CommandError("client: " + std::string(left.message()));
  }
}

}  // namespace

void AddClientCommand(CLI::App& app, Globals& globals) {
  auto options = std::make_shared<Options>();
  CLI::App* client = app.add_subcommand("client", "Join a world as a bot that wanders, and report what it sees");
  client->add_option("id", options->instance, "Id of the instance, as 'instance list' shows it")->required();
  client->add_option("--name", options->name, "Name of the player")->capture_default_str();
  client->add_option("--seconds", options->seconds, "End after so many seconds (default: on Ctrl-C)")
      ->check(CLI::NonNegativeNumber);
  client->add_option("--seed", options->seed, "Of its way through the world, from 1")
      ->capture_default_str()
      ->check(CLI::PositiveNumber);
  client->add_flag("!--stay", options->leave, "Leave the player's body in the world at the end");
  client->callback([&globals, options] { Run(globals, *options); });
}

}  // namespace tessera::cli
