// tessera client: a bot that joins a world and reports what it sees.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "cli/checks.h"
#include "cli/client_view.h"
#include "cli/commands.h"
#include "cli/contexts.h"
#include "cli/signals.h"
#include "host/files.h"
#include "local_cluster/bot.h"
#include "local_cluster/command_error.h"

namespace tessera::cli {
namespace {

using namespace std::chrono_literals;

constexpr std::size_t kMaxTokenBytes = 1 << 16;

struct ClientOptions {
  std::string instance;
  std::string name = "bot";
  double seconds = 0;
  double rate_hz = 60;
  bool predict = false;
  std::uint64_t seed = 1;
  bool leave = true;
  std::string player_file;
  std::string record_file;
  std::uint64_t record_mb = 1024;
  std::string play_file;
  double from_s = 0, speed = 1;  // place and speed in the recording that is played
  bool events = false;
};

// The return token in the player's file; empty if there is none yet.
std::vector<std::uint8_t> ReadPlayer(const std::string& path) {
  const auto token = host::ReadFile(path, kMaxTokenBytes);
  if (absl::IsNotFound(token.status())) return {};
  local::OrThrow(token.status());
  return {token->begin(), token->end()};
}

// The token is a secret: whoever reads it is this player.
void WritePlayer(const std::string& path, const std::vector<std::uint8_t>& token) {
  const std::string_view text(reinterpret_cast<const char*>(token.data()), token.size());
  local::OrThrow(host::WriteFile(path, text, host::Durability::kSurvivesProcess));
}

bool Tables(const Globals& globals) { return globals.format == Format::kTable || globals.format == Format::kWide; }

void Check(const char* what, const absl::Status& status) {
  if (!status.ok()) throw local::CommandError(what + std::string(status.message()));
}

std::chrono::milliseconds TimeUntil(client::TimePoint at) {
  return std::max(0ms, std::chrono::ceil<std::chrono::milliseconds>(at - client::Clock::now()));
}

// Until the time is over, somebody stops it, or the client ends.
void Watch(const Globals& globals, const ClientOptions& options, local::Bot& bot) {
  StopSignal stop;
  const auto start = client::Clock::now();
  const std::chrono::nanoseconds frame(std::llround(1e9 / options.rate_hz));
  auto next_line = start + 1s, next_frame = start;
  bool going = true;
  while (going && !stop.Wait(TimeUntil(next_frame))) {
    const auto now = client::Clock::now();
    next_frame = std::max(next_frame + frame, now);  // missed frames are not made up for
    going = bot.Frame(start + std::chrono::duration_cast<client::Clock::duration>((now - start) * options.speed));
    for (const client::ClientEvent& event : bot.events()) {
      const bool must = event.kind == client::ClientEvent::Kind::kRecordingEnded;
      if (options.events || must) (must ? std::cerr : std::cout) << EventLine(bot.client(), event) << std::flush;
    }
    if (Tables(globals) && now >= next_line) {
      next_line += 1s;
      std::cout << ClientLine(bot) << std::flush;
    }
    if (options.seconds > 0 && now - start >= std::chrono::duration<double>(options.seconds)) break;
  }
  if (!going) Check("client: ", bot.client().reason());
  if (globals.format == Format::kJson) std::cout << ClientJson(bot).dump(2) << "\n";
  if (Tables(globals)) std::cout << "\n" << ClientReport(bot);
}

void Play(const Globals& globals, const ClientOptions& options) {
  auto playing = local::Bot::Play(options.play_file);
  Check("client: ", playing.status());
  client::Client& client = (*playing)->client();
  if (const double length_s = std::chrono::duration<double>(*client.length()).count(); options.from_s > length_s) {
    throw local::CommandError(
        fmt::format("client: --from {:g}: {} is {:.1f} s long", options.from_s, options.play_file, length_s));
  }
  if (options.from_s > 0) {
    Check("client: ", client.Seek(std::chrono::microseconds(std::llround(options.from_s * 1e6))));
  }
  if (Tables(globals)) std::cout << fmt::format("playing {}\n", options.play_file) << std::flush;
  Watch(globals, options, **playing);
}

void Run(const Globals& globals, const ClientOptions& options) {
  if (!options.play_file.empty()) return Play(globals, options);
  const bool has_file = !options.player_file.empty();
  auto joined =
      local::Bot::Join(ControlOf(globals), options.instance, options.name, options.seed,
                       has_file ? ReadPlayer(options.player_file) : std::vector<std::uint8_t>(), options.predict);
  Check("client: ", joined.status());
  local::Bot& bot = **joined;
  if (has_file) WritePlayer(options.player_file, bot.client().return_token());
  if (!options.record_file.empty()) {
    Check("client: --record: ", bot.client().Record(options.record_file, options.record_mb * 1'000'000));
  }
  if (Tables(globals))
    std::cout << fmt::format("joined {} as player {}\n", options.instance, bot.client().player().value()) << std::flush;
  Watch(globals, options, bot);
  Check("client: --record: ", bot.client().StopRecording());
  if (options.leave) {
    if (const absl::Status left = bot.client().Leave(); !left.ok())
      throw local::CommandError("client: " + std::string(left.message()));
    if (has_file) std::filesystem::remove(options.player_file);
  }
}

}  // namespace

void AddClientCommand(CLI::App& app, Globals& globals) {
  auto options = std::make_shared<ClientOptions>();
  CLI::App* client = app.add_subcommand("client", "Join a world as a bot that wanders, and report what it sees");
  CLI::Option* id = client->add_option("id", options->instance, "Id of the instance, as 'instance list' shows it");
  client->add_option("--name", options->name, "Name of the player")->capture_default_str();
  client->add_option("--seconds", options->seconds, "End after so many seconds (default: on Ctrl-C)")
      ->check(CLI::NonNegativeNumber)
      ->check(Finite());
  client->add_option("--rate", options->rate_hz, "Frames a second")
      ->capture_default_str()
      ->check(CLI::Range(1.0, 240.0))
      ->check(Finite());
  client->add_option("--seed", options->seed, "Seed of its way through the world, from 1")
      ->capture_default_str()
      ->check(CLI::PositiveNumber);
  client->add_flag("!--stay", options->leave, "Leave the player's body in the world at the end");
  client->add_option("--player-file", options->player_file,
                     "Keep in this file who the player is, and come back as the one in it, wherever its body is now");
  CLI::Option* record = client->add_option("--record", options->record_file, "Write what it receives into this file");
  client->add_option("--record-mb", options->record_mb, "At most so large, megabytes")
      ->capture_default_str()
      ->check(CLI::Range(1, 1'000'000))
      ->needs(record);
  CLI::Option* play =
      client->add_option("--play", options->play_file, "Instead of joining, play what such a file holds")
          ->excludes(id)
          ->excludes(record);
  client->add_flag("--predict", options->predict, "Show the own body where the inputs already made will bring it")
      ->excludes(play);
  client->add_option("--from", options->from_s, "Play from this time of the file on, seconds")
      ->capture_default_str()
      ->check(CLI::NonNegativeNumber)
      ->check(Finite())
      ->needs(play);
  client->add_option("--speed", options->speed, "Play so many times as fast")
      ->capture_default_str()
      ->check(CLI::Range(0.1, 16.0))
      ->needs(play);
  client->add_flag("--events", options->events, "Print each event: contacts, triggers, bodies that come and go");
  client->callback([&globals, options, id] {
    if (id->count() == 0 && options->play_file.empty()) throw CLI::RequiredError("id, or --play");
    Run(globals, *options);
  });
}

}  // namespace tessera::cli
