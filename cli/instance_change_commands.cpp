// tessera instance scale | restart-workers | set-property | checkpoint | checkpoints | restore | upgrade | export |
// import
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <iostream>
#include <map>
#include <memory>
#include <string>

#include "cli/commands.h"
#include "cli/contexts.h"
#include "cli/instance_change.h"
#include "cli/instance_view.h"
#include "cli/property_argument.h"
#include "cli/table.h"
#include "local_cluster/checkpoint_file.h"
#include "local_cluster/connection.h"
#include "local_cluster/instance_watch.h"

namespace tessera::cli {
namespace {

struct ChangeOptions : InstanceChange {
  std::string file, request_id, property, value;
  std::uint64_t body = 0;
  std::uint32_t regions = 0;
  std::uint64_t tick = 0;
};

// All is as wanted, and nothing is under way: what waits for room may wait for days.
bool Settled(const v1::Instance& instance) {
  const bool stands = instance.state() == v1::INSTANCE_STATE_PAUSED;
  const bool under_way = std::any_of(instance.changes().begin(), instance.changes().end(),
                                     [](const v1::InstanceChange& change) { return !change.lacks_room(); });
  return (stands || instance.state() == v1::INSTANCE_STATE_RUNNING) && !under_way &&
         instance.regions() == instance.wanted_regions();
}

void WaitUntilSettled(local::Connection& connection, const ChangeOptions& options) {
  AwaitChange(connection, options, "there", Settled);
}

void Scale(const Globals& globals, const ChangeOptions& options) {
  local::Connection connection = Connect(globals);
  v1::ScaleInstanceRequest request;
  request.set_regions(options.regions);
  const auto response = SendChange(connection, options, "instance scale", &Instances::ScaleInstance, request);
  if (options.waits()) WaitUntilSettled(connection, options);
  PrintChange(globals, "instance", options.id,
              fmt::format("{} to {} regions", options.wait ? "scaled" : "scaling", options.regions), options.dry_run,
              response.instance());
}

// All are of a later life than any was before.
bool AllReplaced(const v1::Instance& before, const v1::Instance& now) {
  std::uint64_t newest = 0;
  for (const v1::RegionStatus& region : before.region_status()) {
    newest = std::max<std::uint64_t>(newest, region.report().identity().incarnation());
  }
  return Settled(now) && std::all_of(now.region_status().begin(), now.region_status().end(), [&](const auto& region) {
           return region.report().identity().incarnation() > newest;
         });
}

void RestartWorkers(const Globals& globals, const ChangeOptions& options) {
  local::Connection connection = Connect(globals);
  const auto response = SendChange(connection, options, "instance restart-workers", &Instances::RestartWorkers,
                                   v1::RestartWorkersRequest());
  if (options.waits()) {
    local::InstanceWatch watch(connection, options.id);
    const auto replaced = [&](const v1::Instance& now) { return AllReplaced(response.instance(), now); };
    if (!watch.WaitUntil(replaced, options.patience())) {
      throw local::CommandError(fmt::format("instance/{}: not all workers are replaced yet", options.id));
    }
  }
  PrintChange(globals, "instance", options.id, options.wait ? "workers replaced" : "replacing workers", options.dry_run,
              response.instance());
}

void SetProperty(const Globals& globals, const ChangeOptions& options) {
  local::Connection connection = Connect(globals);
  const v1::Instance instance = GetInstance(connection, "instance set-property", options.id);
  v1::SetPropertyRequest request;
  request.set_id(options.id);
  request.set_body(options.body);
  *request.mutable_property() = ReadProperty(instance, options.body == 0, options.property, options.value);
  request.set_validate_only(options.dry_run);
  connection.Call("instance set-property", connection.instances(), &Instances::SetProperty, request,
                  options.patience());
  PrintChange(globals, "instance", options.id,
              fmt::format("{}: {} = {}", options.body == 0 ? "world" : fmt::format("body {}", options.body),
                          options.property, options.value),
              options.dry_run, request);
}

void Checkpoint(const Globals& globals, const ChangeOptions& options) {
  local::Connection connection = Connect(globals);
  const auto response = SendChange(connection, options, "instance checkpoint", &Instances::CheckpointInstance,
                                   v1::CheckpointInstanceRequest(), options.patience());
  PrintChange(globals, "instance", options.id,
              options.dry_run ? "checkpointed" : fmt::format("checkpointed at tick {}", response.checkpoint().tick()),
              options.dry_run, response.checkpoint());
}

void Checkpoints(const Globals& globals, const ChangeOptions& options) {
  local::Connection connection = Connect(globals);
  v1::ListCheckpointsRequest request;
  request.set_id(options.id);
  const auto response = connection.Call("instance checkpoints", connection.instances(),
                                        &v1::InstanceService::Stub::ListCheckpoints, request);
  if (globals.format == Format::kJson) {
    std::cout << ToJson(response);
    return;
  }
  std::vector<TableRow> rows{{"TICK", "REGIONS", "SIZE", "AGE", "NOTE"}};
  for (const v1::Checkpoint& checkpoint : response.checkpoints()) {
    if (globals.format == Format::kName) std::cout << checkpoint.tick() << "\n";
    rows.push_back({std::to_string(checkpoint.tick()), std::to_string(checkpoint.regions()),
                    FormatBytes(static_cast<double>(checkpoint.size_bytes())),
                    FormatAge(AgeSeconds(checkpoint.create_time())), checkpoint.taken_back() ? "taken back" : ""});
  }
  if (globals.format == Format::kName) return;
  if (rows.size() == 1) {
    std::cerr << fmt::format("no checkpoints; make one with 'tessera instance checkpoint {}'\n", options.id);
    return;
  }
  std::cout << FormatTable(rows);
}

void Restore(const Globals& globals, const ChangeOptions& options) {
  local::Connection connection = Connect(globals);
  v1::RestoreInstanceRequest request;
  request.set_tick(options.tick);
  const auto response =
      SendChange(connection, options, "instance restore", &Instances::RestoreInstance, request, options.patience());
  for (const std::string& damaged : response.damaged()) std::cerr << fmt::format("passed over: {}\n", damaged);
  if (options.waits()) WaitUntilSettled(connection, options);
  PrintChange(globals, "instance", options.id, fmt::format("restored from tick {}", response.checkpoint().tick()),
              options.dry_run, response.instance());
}

void Upgrade(const Globals& globals, const ChangeOptions& options) {
  local::Connection connection = Connect(globals);
  const auto response = SendChange(connection, options, "instance upgrade", &Instances::UpgradeInstance,
                                   v1::UpgradeInstanceRequest(), options.patience());
  if (options.waits()) WaitUntilSettled(connection, options);
  const std::string what =
      options.dry_run ? "upgraded" : fmt::format("upgraded: it begins anew after tick {}", response.tick());
  PrintChange(globals, "instance", options.id, what, options.dry_run, response.instance());
}

void Export(const Globals& globals, const ChangeOptions& options) {
  local::Connection connection = Connect(globals);
  local::ExportCheckpoint(connection, options.id, options.tick, options.file, options.patience());
  v1::Checkpoint checkpoint;
  checkpoint.set_tick(options.tick);
  PrintChange(globals, "instance", options.id, "exported to " + options.file, false, checkpoint);
}

void Import(const Globals& globals, const ChangeOptions& options) {
  local::Connection connection = Connect(globals);
  const v1::Instance made = local::ImportCheckpoint(
      connection, options.file,
      {.request_id = options.request_id, .validate_only = options.dry_run, .timeout = options.patience()});
  PrintChange(globals, "instance", options.dry_run ? options.file : made.id(), "imported", options.dry_run, made);
}

}  // namespace

void AddInstanceChangeCommands(CLI::App& instance, Globals& globals) {
  auto options = std::make_shared<ChangeOptions>();
  const auto add = [&](const char* name, const char* about, bool with_id = true) {
    return AddChange(instance, *options, name, about, with_id);
  };
  const auto add_dry_run = [&](CLI::App* command) {
    command->add_flag("--dry-run", options->dry_run, "Only check whether it could be done");
  };
  const auto add_tick = [&](CLI::App* command) {
    command->add_option("--tick", options->tick, "Which checkpoint; left out: the newest that is whole");
  };

  CLI::App* scale = add("scale", "Change the number of regions while the world runs");
  scale->add_option("--regions", options->regions, "Number of region workers, 1 to 1000")->required();
  scale->add_flag("--wait", options->wait, "Return only when it is done");
  add_dry_run(scale);
  scale->callback([&globals, options] { Scale(globals, *options); });

  CLI::App* restart = add("restart-workers", "Replace one worker after the other while the world runs");
  restart->add_flag("--wait", options->wait, "Return only when it is done");
  add_dry_run(restart);
  restart->callback([&globals, options] { RestartWorkers(globals, *options); });

  CLI::App* set =
      add("set-property", "Change a property of a body or of the world while it runs; returns when it is safe");
  set->add_option("body", options->body, "Id of the body, of the scene or a player's; world: the world's own property")
      ->required()
      ->transform(CLI::Transformer(std::map<std::string, std::uint64_t>{{"world", 0}}).description(""));
  set->add_option("key", options->property, "Name of the property, as the scene declares it")->required();
  set->add_option("value", options->value, "true or false, a number or a text, as the scene declares it")->required();
  add_dry_run(set);
  set->callback([&globals, options] { SetProperty(globals, *options); });

  CLI::App* checkpoint = add("checkpoint", "Keep the state of all regions at one tick; returns when it is on disk");
  add_dry_run(checkpoint);
  checkpoint->callback([&globals, options] { Checkpoint(globals, *options); });

  add("checkpoints", "List the checkpoints of an instance")->callback([&globals, options] {
    Checkpoints(globals, *options);
  });

  CLI::App* restore = add("restore", "Start all workers again from a checkpoint; what came after it is lost");
  add_tick(restore);
  restore->add_flag("--wait", options->wait, "Return only when it is RUNNING");
  add_dry_run(restore);
  restore->callback([&globals, options] { Restore(globals, *options); });

  CLI::App* upgrade =
      add("upgrade", "Start all workers again with the programs that their hosts have now; no tick is lost");
  upgrade->add_flag("--wait", options->wait, "Return only when it is RUNNING");
  add_dry_run(upgrade);
  upgrade->callback([&globals, options] { Upgrade(globals, *options); });

  CLI::App* save = add("export", "Write a checkpoint to a file, for any cluster");
  save->add_option("file", options->file, "File to write")->required();
  add_tick(save);
  save->callback([&globals, options] { Export(globals, *options); });

  CLI::App* load = add("import", "Start a new instance from such a file", false);
  load->add_option("file", options->file, "File to read")->required();
  load->add_option("--request-id", options->request_id, "The same id again gives the same instance");
  add_dry_run(load);
  load->callback([&globals, options] { Import(globals, *options); });
}

}  // namespace tessera::cli
