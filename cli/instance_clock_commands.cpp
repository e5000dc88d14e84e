// tessera instance pause | resume | step | pace | set-game
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <memory>

#include "cli/checks.h"
#include "cli/commands.h"
#include "cli/contexts.h"
#include "cli/instance_view.h"
#include "local_cluster/connection.h"
#include "local_cluster/game_file.h"
#include "local_cluster/instance_watch.h"

namespace tessera::cli {
namespace {

struct ClockOptions {
  std::string id, file;
  double ticks_per_second = 0;
  std::uint32_t ticks = 1;
  double timeout_s = 60;
  bool wait = false, dry_run = false;
};

using Holds = std::function<bool(const v1::Instance&)>;

void AwaitClock(local::Connection& connection, const ClockOptions& options, const std::string& what,
                const Holds& holds) {
  local::InstanceWatch watch(connection, options.id);
  const auto patience = std::chrono::milliseconds(static_cast<std::int64_t>(options.timeout_s * 1000));
  if (watch.WaitUntil(holds, patience)) return;
  const v1::Instance latest = watch.Latest();
  throw local::CommandError(fmt::format("instance/{} is not {} yet: {}", options.id, what,
                                        latest.changes().empty() ? latest.reason() : latest.changes(0).text()));
}

std::uint64_t TickOf(const v1::Instance& instance) {
  std::uint64_t tick = 0;
  for (const v1::RegionStatus& region : instance.region_status()) tick = std::max(tick, region.report().tick());
  return tick;
}

void Pause(const Globals& globals, const ClockOptions& options) {
  local::Connection connection = Connect(globals);
  v1::PauseInstanceRequest request;
  request.set_id(options.id);
  request.set_validate_only(options.dry_run);
  const auto response =
      connection.Call("instance pause", connection.instances(), &v1::InstanceService::Stub::PauseInstance, request);
  std::string done = "pausing";
  if (options.wait && !options.dry_run) {
    AwaitClock(connection, options, "paused",
               [](const v1::Instance& instance) { return instance.state() == v1::INSTANCE_STATE_PAUSED; });
    done = fmt::format("paused after tick {}", TickOf(GetInstance(connection, "instance pause", options.id)));
  }
  PrintChange(globals, "instance", options.id, done, options.dry_run, response.instance());
}

void Resume(const Globals& globals, const ClockOptions& options) {
  local::Connection connection = Connect(globals);
  v1::ResumeInstanceRequest request;
  request.set_id(options.id);
  request.set_validate_only(options.dry_run);
  const auto response =
      connection.Call("instance resume", connection.instances(), &v1::InstanceService::Stub::ResumeInstance, request);
  if (options.wait && !options.dry_run) {
    AwaitClock(connection, options, "resumed", [](const v1::Instance& instance) {
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
  request.set_id(options.id);
  request.set_ticks(options.ticks);
  request.set_validate_only(options.dry_run);
  const auto response =
      connection.Call("instance step", connection.instances(), &v1::InstanceService::Stub::ResumeInstance, request);
  const std::uint64_t end = TickOf(response.instance()) + options.ticks;
  std::string done = fmt::format("stepping to tick {}", end);
  if (options.wait && !options.dry_run) {
    AwaitClock(connection, options, fmt::format("at tick {}", end), [&](const v1::Instance& instance) {
      return instance.state() == v1::INSTANCE_STATE_PAUSED && TickOf(instance) >= end;
    });
    done = fmt::format("paused after tick {}", TickOf(GetInstance(connection, "instance step", options.id)));
  }
  PrintChange(globals, "instance", options.id, done, options.dry_run, response.instance());
}

void Pace(const Globals& globals, const ClockOptions& options) {
  local::Connection connection = Connect(globals);
  v1::SetPaceRequest request;
  request.set_id(options.id);
  request.set_ticks_per_second(options.ticks_per_second);
  request.set_validate_only(options.dry_run);
  const auto response =
      connection.Call("instance pace", connection.instances(), &v1::InstanceService::Stub::SetPace, request);
  if (options.wait && !options.dry_run) {
    AwaitClock(connection, options, "at that pace",
               [&](const v1::Instance& instance) { return instance.ticks_per_second() == options.ticks_per_second; });
  }
  PrintChange(globals, "instance", options.id, fmt::format("{} ticks a second", options.ticks_per_second),
              options.dry_run, response.instance());
}

void SetGame(const Globals& globals, const ClockOptions& options) {
  local::Connection connection = Connect(globals);
  v1::SetGameRequest request;
  request.set_id(options.id);
  *request.mutable_game() = local::LoadGame(options.file);
  request.set_validate_only(options.dry_run);
  const auto response =
      connection.Call("instance set-game", connection.instances(), &v1::InstanceService::Stub::SetGame, request);
  std::string done = "game on its way";
  if (options.wait && !options.dry_run) {
    const std::string& hash = response.game_hash();
    const auto over = [&](const v1::Instance& instance) { return instance.next_game_hash() != hash; };
    AwaitClock(connection, options, "running that game", over);
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
    CLI::App* command = instance.add_subcommand(name, about);
    command->add_option("id", options->id, "Id of the instance, as 'instance list' shows it")->required();
    command->add_option("--timeout", options->timeout_s, "Seconds to wait at most")
        ->capture_default_str()
        ->check(CLI::PositiveNumber)
        ->check(Finite());
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
