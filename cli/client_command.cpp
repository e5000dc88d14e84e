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
#include "cli/keys.h"
#include "cli/playback.h"
#include "cli/signals.h"
#include "cli/ticket_argument.h"
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
  std::string ticket;
  std::string record_file;
  std::uint64_t record_mb = 1024;
  std::string play_file;
  double from_s = 0, speed = 1;  // place and speed in the recording that is played
  bool events = false;
};

constexpr char kKeysHelp[] =
    "space pauses, left and right go 5 s, comma and period one tick, Home and End to the ends, up and down set the "
    "speed, q ends\n";

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

void Show(const ClientOptions& options, local::Bot& bot) {
  for (const client::ClientEvent& event : bot.events()) {
    const bool must = event.kind == client::ClientEvent::Kind::kRecordingEnded;
    if (options.events || must) (must ? std::cerr : std::cout) << EventLine(bot.client(), event) << std::flush;
  }
}

void ShowEnd(const Globals& globals, local::Bot& bot) {
  if (globals.format == Format::kJson) std::cout << ClientJson(bot).dump(2) << "\n";
  if (Tables(globals)) std::cout << "\n" << ClientReport(bot);
}

// When the frames of a bot, and lines about them, are due.
class FrameClock {
 public:
  FrameClock(const ClientOptions& options, client::TimePoint start)
      : start_(start), frame_(std::llround(1e9 / options.rate_hz)), seconds_(options.seconds) {}

  client::TimePoint next() const { return next_frame_; }
  // Missed frames are not made up for.
  void Begin(client::TimePoint now) { next_frame_ = std::max(next_frame_ + frame_, now); }
  // Once a second.
  bool LineDue(client::TimePoint now) {
    if (now < next_line_) return false;
    next_line_ += 1s;
    return true;
  }
  bool Over(client::TimePoint now) const {
    return seconds_ > 0 && now - start_ >= std::chrono::duration<double>(seconds_);
  }

 private:
  client::TimePoint start_;
  std::chrono::nanoseconds frame_;
  double seconds_;
  client::TimePoint next_line_ = start_ + 1s, next_frame_ = start_;
};

// Until the time is over, somebody stops it, or the client ends.
void Watch(const Globals& globals, const ClientOptions& options, local::Bot& bot) {
  StopSignal stop;
  FrameClock clock(options, client::Clock::now());
  bool going = true;
  while (going && !stop.Wait(TimeUntil(clock.next()))) {
    const auto now = client::Clock::now();
    clock.Begin(now);
    going = bot.Frame(now);
    Show(options, bot);
    if (Tables(globals) && clock.LineDue(now)) std::cout << ClientLine(bot) << std::flush;
    if (clock.Over(now)) break;
  }
  if (!going) Check("client: ", bot.client().reason());
  ShowEnd(globals, bot);
}

// The same for a recording, whose time the keys of a terminal stop and set.
void WatchRecording(const Globals& globals, const ClientOptions& options, local::Bot& bot) {
  StopSignal stop;
  KeyReader keys;
  const auto start = client::Clock::now();
  FrameClock clock(options, start);
  Playback playback(*bot.client().length(), std::chrono::microseconds(std::llround(options.from_s * 1e6)),
                    options.speed, keys.reads());
  if (keys.reads() && Tables(globals)) std::cout << kKeysHelp << std::flush;
  bool going = true;
  while (going && !playback.ended() && !stop.Wait(TimeUntil(clock.next()))) {
    const auto now = client::Clock::now();
    clock.Begin(now);
    const std::vector<Key> pressed = keys.Take();
    for (const Key key : pressed) {
      if (const auto place = playback.Press(key)) Check("client: ", bot.client().Seek(*place));
    }
    playback.Advance(now);
    going = bot.Frame(start + std::chrono::duration_cast<client::Clock::duration>(playback.client_time()));
    Show(options, bot);
    const bool moves = !playback.paused() && clock.LineDue(now);
    if (Tables(globals) && (moves || !pressed.empty())) {
      std::cout << playback.Line() << ": " << ClientLine(bot) << std::flush;
    }
    if (clock.Over(now)) break;
  }
  if (!going) Check("client: ", bot.client().reason());
  ShowEnd(globals, bot);
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
  WatchRecording(globals, options, **playing);
}

void Run(const Globals& globals, const ClientOptions& options) {
  if (!options.play_file.empty()) return Play(globals, options);
  const bool has_file = !options.player_file.empty();
  std::string ticket;
  if (!options.ticket.empty()) {
    const std::vector<std::string> tickets = TicketsFrom(options.ticket);
    if (tickets.size() > 1) throw local::CommandError("--ticket " + options.ticket + ": has more than one");
    ticket = tickets.front();
  }
  auto joined = local::Bot::Join(ControlOf(globals), options.instance, options.name, options.seed,
                                 has_file ? ReadPlayer(options.player_file) : std::vector<std::uint8_t>(),
                                 options.predict, ticket);
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
  CLI::Option* name = client->add_option("--name", options->name, "Name of the player")->capture_default_str();
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
  CLI::Option* player_file = client->add_option(
      "--player-file", options->player_file,
      "Keep in this file who the player is, and come back as the one in it, wherever its body is now");
  client
      ->add_option("--ticket", options->ticket,
                   "A ticket, or a file with one: who the player is, where an instance takes no guests")
      ->excludes(name)
      ->excludes(player_file);
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
      ->check(CLI::Range(Playback::kSlowest, Playback::kFastest))
      ->needs(play);
  client->add_flag("--events", options->events, "Print each event: contacts, triggers, bodies that come and go");
  client->callback([&globals, options, id] {
    if (id->count() == 0 && options->play_file.empty()) throw CLI::RequiredError("id, or --play");
    Run(globals, *options);
  });
}

}  // namespace tessera::cli
