// tessera client: a bot that joins a world and reports what it sees.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <filesystem>
#include <fstream>
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
  std::string player_file;
};

// What is in the player's file; empty if there is none yet.
std::vector<std::uint8_t> ReadPlayer(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

// Secret: whoever reads it is this player.
void WritePlayer(const std::string& path, const std::vector<std::uint8_t>& token) {
  std::ofstream out(path, std::ios::binary | std::ios::trunc);
  std::error_code ignored;
  std::filesystem::permissions(path, std::filesystem::perms::owner_read | std::filesystem::perms::owner_write, ignored);
  out.write(reinterpret_cast<const char*>(token.data()), static_cast<std::streamsize>(token.size()));
  if (!out.flush()) throw local::CommandError(path + " cannot be written");
}

void Run(const Globals& globals, const Options& options) {
  StopSignal stop;
  const bool has_file = !options.player_file.empty();
  auto joined = local::Bot::Join(globals.control, options.instance, options.name, options.seed,
                                 has_file ? ReadPlayer(options.player_file) : std::vector<std::uint8_t>());
  if (!joined.ok()) throw local::CommandError("client: " + std::string(joined.status().message()));
  local::Bot& bot = **joined;
  if (has_file) WritePlayer(options.player_file, bot.client().return_token());
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
    if (has_file) std::filesystem::remove(options.player_file);
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
  client->add_option("--player-file", options->player_file,
                     "Keep in this file who the player is, and come back as the one in it, wherever its body is now");
  client->callback([&globals, options] { Run(globals, *options); });
}

}  // namespace tessera::cli
