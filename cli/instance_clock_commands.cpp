// tessera instance pause | resume | step | pace | set-game
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <memory>

#include "cli/commands.h"
#include "cli/contexts.h"
#include "cli/instance_change.h"
#include "cli/instance_view.h"
#include "local_cluster/connection.h"
#include "local_cluster/game_file.h"

namespace tessera::cli {
namespace {

struct ClockOptions : InstanceChange {
  std::string file;
  double ticks_per_second = 0;
  std::uint32_t ticks = 1;
};

std::uint64_t TickOf(const v1::Instance& instance) {
  std::uint64_t tick = 0;
  for (const v1::RegionStatus& region : instance.region_status()) tick = std::max(tick, region.report().tick());
  return tick;
}

void Pause(const Globals& globals, const ClockOptions& options) {
  local::Connection connection = Connect(globals);
  const auto response =
      SendChange(connection, options, "instance pause", &Instances::PauseInstance, v1::PauseInstanceRequest());
  std::string done = "pausing";
  if (options.waits()) {
    AwaitChange(connection, options, "paused",
                [](const v1::Instance& instance) { return instance.state() == v1::INSTANCE_STATE_PAUSED; });
    done = fmt::format("paused after tick {}", TickOf(GetInstance(connection, "instance pause", options.id)));
  }
  PrintChange(globals, "instance", options.id, done, options.dry_run, response.instance());
}

void Resume(const Globals& globals, const ClockOptions& options) {
  local::Connection connection = Connect(globals);
  const auto response =
      SendChange(connection, options, "instance resume", &Instances::ResumeInstance, v1::ResumeInstanceRequest());
  if (options.waits()) {
    AwaitChange(connection, options, "resumed", [](const v1::Instance& instance) {
      return instance.state() == v1::INSTANCE_STATE_RUNNING &&
             std::all_of(instance.region_status().begin(), instance.region_status().end(),
                         [](const auto& region) { return !region.report().world_paused(); });
    });
  }
  PrintChange(globals, "instance", options.id, options.wait ? "resumed" : "resuming", options.dry_run,
              response.instance());
}

// The world stands, so the tick at which it will stand again is known before.
void Step(const Globals& globals, const ClockOptions& options) {
  local::Connection connection = Connect(globals);
  v1::ResumeInstanceRequest request;
  request.set_ticks(options.ticks);
  const auto response = SendChange(connection, options, "instance step", &Instances::ResumeInstance, request);
  const std::uint64_t end = TickOf(response.instance()) + options.ticks;
  std::string done = fmt::format("stepping to tick {}", end);
  if (options.waits()) {
    AwaitChange(connection, options, fmt::format("at tick {}", end), [&](const v1::Instance& instance) {
      return instance.state() == v1::INSTANCE_STATE_PAUSED && TickOf(instance) >= end;
    });
    done = fmt::format("paused after tick {}", TickOf(GetInstance(connection, "instance step", options.id)));
  }
  PrintChange(globals, "instance", options.id, done, options.dry_run, response.instance());
}

void Pace(const Globals& globals, const ClockOptions& options) {
  local::Connection connection = Connect(globals);
  v1::SetPaceRequest request;
  request.set_ticks_per_second(options.ticks_per_second);
  const auto response = SendChange(connection, options, "instance pace", &Instances::SetPace, request);
  if (options.waits()) {
    AwaitChange(connection, options, "at that pace",
                [&](const v1::Instance& instance) { return instance.ticks_per_second() == options.ticks_per_second; });
  }
  PrintChange(globals, "instance", options.id, fmt::format("{} ticks a second", options.ticks_per_second),
              options.dry_run, response.instance());
}

void SetGame(const Globals& globals, const ClockOptions& options) {
  local::Connection connection = Connect(globals);
  v1::SetGameRequest request;
  *request.mutable_game() = local::LoadGame(options.file);
  const auto response = SendChange(connection, options, "instance set-game", &Instances::SetGame, request);
  std::string done = "game on its way";
  if (options.waits()) {
    const std::string& hash = response.game_hash();
    const auto over = [&](const v1::Instance& instance) { return instance.next_game_hash() != hash; };
    AwaitChange(connection, options, "running that game", over);
    const v1::Instance now = GetInstance(connection, "instance set-game", options.id);
    if (now.game_hash() != hash) {
      throw local::CommandError(fmt::format(
          "instance/{}: {}", options.id, now.game_refused().empty() ? "the game was not taken" : now.game_refused()));
    }
    done = fmt::format("game from tick {} on", now.game_since_tick());
  }
  PrintChange(globals, "instance", options.id, done, options.dry_run, response.instance());
}

}  // namespace

void AddInstanceClockCommands(CLI::App& instance, Globals& globals) {
  auto options = std::make_shared<ClockOptions>();
  const auto add = [&](const char* name, const char* about) {
    CLI::App* command = AddChange(instance, *options, name, about);
    command->add_flag("--wait", options->wait, "Return only when it is done");
    command->add_flag("--dry-run", options->dry_run, "Only check whether it could be done");
    return command;
  };
  add("pause", "Let the world stand still; players stay connected")->callback([&globals, options] {
    Pause(globals, *options);
  });
  add("resume", "Let a paused world go on")->callback([&globals, options] { Resume(globals, *options); });
  CLI::App* step = add("step", "Let a paused world make some ticks, the same in all regions, and stand again");
  step->add_option("--ticks", options->ticks, "Ticks that it makes, 1 to 36000")
      ->capture_default_str()
      ->check(CLI::Range(1, 36'000));
  step->callback([&globals, options] { Step(globals, *options); });
  CLI::App* pace = add("pace", "Let the world make fewer ticks a second: slow motion");
  pace->add_option("--ticks-per-second", options->ticks_per_second, "1 to the scene's tick rate, which is full speed")
      ->required();
  pace->callback([&globals, options] { Pace(globals, *options); });
  CLI::App* game = add("set-game", "Put another game in the place of the one that runs, while it runs");
  game->add_option("file", options->file, "The game: a Lua file")->required();
  game->callback([&globals, options] { SetGame(globals, *options); });
}

}  // namespace tessera::cli
