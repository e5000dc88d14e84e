// tessera instance create | list | describe | watch | delete; the others are in instance_change_commands.cpp.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <iostream>
#include <map>
#include <memory>

#include "cli/checks.h"
#include "cli/commands.h"
#include "cli/contexts.h"
#include "cli/instance_view.h"
#include "cli/table.h"
#include "core/world/limits.h"
#include "core/world/scene_warnings.h"
#include "local_cluster/connection.h"
#include "local_cluster/game_file.h"
#include "local_cluster/scene_file.h"
#include "local_cluster/scene_upload.h"
#include "local_cluster/visual_upload.h"

namespace tessera::cli {
namespace {

struct InstanceOptions {
  std::string id;
  std::string scene, visuals;
  std::string game, movement;
  std::uint32_t regions = 1;
  std::uint32_t players = 0, max_players = 0;
  std::uint32_t snapshot_rate_hz = 0;
  std::optional<std::uint32_t> bodies;
  double start_deadline_s = 0;
  double timeout_s = 30;
  std::optional<double> checkpoint_interval_s, leaver_grace_s;
  std::uint32_t keep_checkpoints = 0;
  v1::LeaverPolicy leaver = v1::LEAVER_POLICY_UNSPECIFIED;
  std::optional<bool> guests;
  std::optional<std::uint32_t> ghost_depth;
  std::optional<std::uint32_t> whole_up_to;
  std::uint32_t region_threads = 1;
  bool balance = false;
  bool lazy = false, wait = false, dry_run = false;
  std::string request_id;
};

void SetSpan(double seconds, google::protobuf::Duration& span) {
  const auto whole = static_cast<std::int64_t>(seconds);
  span.set_seconds(whole);
  span.set_nanos(static_cast<std::int32_t>((seconds - static_cast<double>(whole)) * 1e9));
}

v1::CreateInstanceRequest RequestOf(const InstanceOptions& options, const std::string& path) {
  v1::CreateInstanceRequest request;
  v1::InstanceSpec& spec = *request.mutable_spec();
  LoadedScene loaded = local::LoadScene(path, options.bodies);
  for (const std::string& warning : SceneWarnings(*loaded.scene)) {
    std::cerr << fmt::format("{}: warning: {}\n", path, warning);
  }
  *spec.mutable_scene() = std::move(loaded.message);
  if (!options.game.empty()) local::SetGame(options.game, spec);
  if (!options.movement.empty()) local::SetMovement(options.movement, spec);
  spec.set_regions(options.regions);
  spec.set_expected_players(options.players);
  spec.set_max_players(options.max_players);
  spec.set_snapshot_rate_hz(options.snapshot_rate_hz);
  spec.set_lazy(options.lazy);
  if (options.start_deadline_s > 0) SetSpan(options.start_deadline_s, *spec.mutable_start_deadline());
  if (options.checkpoint_interval_s) SetSpan(*options.checkpoint_interval_s, *spec.mutable_checkpoint_interval());
  if (options.leaver_grace_s) SetSpan(*options.leaver_grace_s, *spec.mutable_leaver_grace());
  spec.set_keep_checkpoints(options.keep_checkpoints);
  spec.set_leaver_policy(options.leaver);
  spec.set_balance(options.balance);
  if (options.guests) spec.set_guests(*options.guests);
  if (options.ghost_depth) spec.mutable_borders()->set_ghost_depth(*options.ghost_depth);
  if (options.whole_up_to) spec.mutable_borders()->set_whole_up_to(*options.whole_up_to);
  spec.set_region_threads(options.region_threads);
  request.set_request_id(options.request_id);
  request.set_validate_only(options.dry_run);
  return request;
}

void Create(const Globals& globals, const InstanceOptions& options) {
  local::Connection connection = Connect(globals);
  const std::string path =
      options.scene.find_first_of("/.") == std::string::npos ? local::FindScene(options.scene) : options.scene;
  const v1::CreateInstanceRequest request = RequestOf(options, path);
  const auto sending = options.dry_run ? local::VisualSending::kOnlyCheck : local::VisualSending::kSend;
  const std::string folder = options.visuals.empty() ? local::VisualsBeside(path) : options.visuals;
  for (const auto& [file, bytes] : local::SendVisuals(connection, request.spec().scene(), folder, sending)) {
    std::cerr << fmt::format("{}: {:.1f} MB {}\n", file, static_cast<double>(bytes) / 1e6,
                             options.dry_run ? "would be sent" : "sent");
  }
  auto response = local::CreateInstance(connection, request, [&path](std::size_t bytes) {
    std::cerr << fmt::format("{}: {:.1f} MB sent before the request\n", path, static_cast<double>(bytes) / 1e6);
  });
  const std::string id = response.instance().id();
  if (options.wait && !options.dry_run) {
    *response.mutable_instance() = local::WaitUntilSettled(connection, id, Seconds(options.timeout_s));
    const std::string state = local::InstanceStateName(response.instance());
    if (response.instance().state() == v1::INSTANCE_STATE_FAILED) {
      throw local::CommandError(fmt::format("instance/{} failed: {}", id, response.instance().reason()));
    }
    PrintChange(globals, "instance", id, "created, " + state, false, response.instance());
    return;
  }
  PrintChange(globals, "instance", options.dry_run ? request.spec().scene().name() : id, "created", options.dry_run,
              response.instance());
}

void ListInstances(const Globals& globals) {
  local::Connection connection = Connect(globals);
  const std::vector<v1::Instance> all = local::ListInstances(connection);
  if (globals.format == Format::kJson) {
    v1::ListInstancesResponse answer;
    answer.mutable_instances()->Assign(all.begin(), all.end());
    std::cout << ToJson(answer);
    return;
  }
  const bool wide = globals.format == Format::kWide;  // a reason holds spaces and log lines
  std::vector<TableRow> rows{{"NAME", "STATE", "SCENE", "GAME", "REGIONS", "PLAYERS", "AGE"}};
  if (wide) rows.front().push_back("REASON");
  for (const v1::Instance& instance : all) {
    if (globals.format == Format::kName) std::cout << "instance/" << instance.id() << "\n";
    rows.push_back({instance.id(), local::InstanceStateName(instance), instance.scene_name(), GameOf(instance),
                    std::to_string(instance.regions()), std::to_string(instance.players()),
                    FormatAge(AgeSeconds(instance.create_time()))});
    if (wide) rows.back().push_back(instance.reason().empty() ? "-" : instance.reason());
  }
  if (globals.format == Format::kName) return;
  if (rows.size() == 1) {
    std::cerr << "no instances; create one with 'tessera instance create --scene plaza --regions 4'\n";
    return;
  }
  std::cout << FormatTable(rows);
}

void Describe(const Globals& globals, const InstanceOptions& options) {
  local::Connection connection = Connect(globals);
  const v1::Instance instance = GetInstance(connection, "instance describe", options.id);
  std::cout << (globals.format == Format::kJson ? ToJson(instance) : DescribeInstance(instance));
}

void Watch(const Globals& globals, const InstanceOptions& options) {
  local::Connection connection = Connect(globals);
  v1::WatchInstanceRequest request;
  request.set_id(options.id);
  grpc::ClientContext context;
  const auto stream = connection.instances().WatchInstance(&context, request);
  v1::WatchInstanceResponse response;
  std::string last;
  while (stream->Read(&response)) {
    const std::string line =
        globals.format == Format::kJson ? ToJson(response.instance()) : SummaryLine(response.instance());
    if (line != last) std::cout << line << std::flush;
    last = line;
  }
  connection.Check(stream->Finish(), "instance watch");
}

void Delete(const Globals& globals, const InstanceOptions& options) {
  local::Connection connection = Connect(globals);
  v1::DeleteInstanceRequest request;
  request.set_id(options.id);
  request.set_validate_only(options.dry_run);
  auto response =
      connection.Call("instance delete", connection.instances(), &v1::InstanceService::Stub::DeleteInstance, request);
  if (options.wait && !options.dry_run) {
    *response.mutable_instance() = local::WaitUntilEnded(connection, options.id, Seconds(options.timeout_s));
  }
  PrintChange(globals, "instance", options.id, options.wait && !options.dry_run ? "deleted" : "stopping",
              options.dry_run, response.instance());
}

void AddWaitOptions(CLI::App* command, InstanceOptions& options, const std::string& until) {
  command->add_flag("--wait", options.wait, "Return only when it is " + until);
  command->add_option("--timeout", options.timeout_s, "Seconds that --wait waits")
      ->capture_default_str()
      ->check(CLI::PositiveNumber)
      ->check(Finite());
  command->add_flag("--dry-run", options.dry_run, "Only check whether it could be done");
}

}  // namespace

void AddInstanceCommands(CLI::App& app, Globals& globals) {
  auto options = std::make_shared<InstanceOptions>();
  CLI::App* instance = app.add_subcommand("instance", "Running worlds")->require_subcommand(1);

  CLI::App* create = instance->add_subcommand("create", "Start a world");
  create->add_option("--scene", options->scene, "Scene file, or the name of one that comes with tessera")->required();
  create->add_option("--game", options->game,
                     "Lua file that the world's regions run, or native:NAME[@SHA256], a shared library that hosts "
                     "have; left out: none");
  create->add_option("--movement", options->movement,
                     "native:NAME[@SHA256], a shared library that hosts have, with a movement for the players of a Lua "
                     "game; left out: none");
  create->add_option("--visuals", options->visuals,
                     "Folder of the meshes that the scene is drawn with; those that the control plane lacks are sent "
                     "(default: visuals, beside the scene)");
  create->add_option("--regions", options->regions, "Number of region workers, 1 to 1000")->capture_default_str();
  create->add_option("--players", options->players, "Start when so many players are in; 0: at once")
      ->capture_default_str();
  create->add_option("--max-players", options->max_players, "At most so many play at one time (default 1024)")
      ->check(CLI::Range(std::uint32_t{1}, kMaxPlayers));
  create->add_option("--bodies", options->bodies, "Number of scattered bodies, instead of the scene's own");
  create->add_option("--start-deadline", options->start_deadline_s, "Start anyway after so many seconds (default 30)")
      ->check(Finite());
  create->add_option("--snapshot-rate", options->snapshot_rate_hz, "Snapshots a second to each client (default 30)");
  create->add_option("--request-id", options->request_id, "The same id again gives the same instance");
  create->add_option("--checkpoint-interval", options->checkpoint_interval_s,
                     "Seconds between checkpoints, at least 5; 0: only those asked for (default 60)");
  create->add_option("--keep-checkpoints", options->keep_checkpoints, "How many are kept, 1 to 100 (default 3)");
  create->add_option(
      "--ghost-depth", options->ghost_depth,
      "How many bodies deep a neighbour sees of a pile that moves, beyond what may touch the border, 0 to "
      "64 (default 1)");
  create->add_option("--whole-up-to", options->whole_up_to,
                     "Piles of which a region has no more than so many bodies are relevant to neighbours as a whole "
                     "(0 to 100000, default 32)");
  create
      ->add_option("--region-threads", options->region_threads,
                   "Threads that work on each region's step, 1 to 32; each takes a place of its host")
      ->capture_default_str();
  create->add_flag("--balance", options->balance, "Move the borders by measured step time");
  const std::map<std::string, v1::LeaverPolicy> policies{
      {"stay", v1::LEAVER_POLICY_STAY}, {"park", v1::LEAVER_POLICY_PARK}, {"remove", v1::LEAVER_POLICY_REMOVE}};
  create->add_option("--leaver", options->leaver, "Body of a player who is gone: stay, park or remove (default stay)")
      ->transform(CLI::CheckedTransformer(policies))
      ->type_name("POLICY");
  create->add_option("--leaver-grace", options->leaver_grace_s, "Seconds until then (default 60)");
  create
      ->add_option_function<std::string>(
          "--guests", [options](const std::string& text) { options->guests = text == "on"; },
          "Whether players may join without a ticket: on or off (default on over the socket, else off)")
      ->check(CLI::IsMember({"on", "off"}))
      ->type_name("SWITCH");
  create->add_flag("--lazy", options->lazy, "Start the workers only when all expected players are there");
  AddWaitOptions(create, *options, "RUNNING, or waiting for players");
  create->callback([&globals, options] { Create(globals, *options); });

  instance->add_subcommand("list", "List the instances")->callback([&globals] { ListInstances(globals); });
  const auto with_id = [&](const char* name, const char* about) {
    CLI::App* command = instance->add_subcommand(name, about);
    command->add_option("id", options->id, "Id of the instance, as 'instance list' shows it")->required();
    return command;
  };
  with_id("describe", "Show an instance and its regions")->callback([&globals, options] {
    Describe(globals, *options);
  });
  with_id("watch", "Print an instance whenever it changes, until it ends")->callback([&globals, options] {
    Watch(globals, *options);
  });
  CLI::App* remove = with_id("delete", "End a world");
  AddWaitOptions(remove, *options, "ENDED");
  remove->callback([&globals, options] { Delete(globals, *options); });
  AddInstanceChangeCommands(*instance, globals);
  AddInstanceClockCommands(*instance, globals);
}

}  // namespace tessera::cli
