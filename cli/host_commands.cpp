// tessera host add | list | describe | drain | remove
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <iostream>
#include <memory>

#include "cli/checks.h"
#include "cli/commands.h"
#include "cli/contexts.h"
#include "cli/host_steps.h"
#include "cli/table.h"
#include "local_cluster/connection.h"

namespace tessera::cli {
namespace {

struct HostOptions {
  std::string name;
  bool dry_run = false;
  bool undo = false;
  double token_hours = 24;
  std::uint32_t max_regions = 64;
  bool force = false;
};

// Whoever speaks from its own machine does not know at which address other machines reach the control plane.
std::string AddressForHosts(const Globals& globals) {
  std::string address = ControlOf(globals).address;
  const bool local = address.starts_with("unix:") || address.starts_with("127.") || address.starts_with("localhost:");
  return local ? "CONTROL:7700" : address;
}

std::string StateOf(const v1::Host& host) { return ShortName(v1::HostState_Name(host.state()), "HOST_STATE_"); }

TableRow HostRow(const v1::Host& host) {
  return {host.name(),
          StateOf(host),
          std::to_string(host.regions()),
          std::to_string(std::min(host.resources().region_capacity(), host.max_regions())),
          host.advertise_address().empty() ? "-" : host.advertise_address(),
          host.version().empty() ? "-" : host.version(),
          FormatAge(AgeSeconds(host.create_time()))};
}

// "beta: advertises 127.0.0.1, ...", a line each; empty: nothing is wrong with any of them.
std::string Notes(const google::protobuf::RepeatedPtrField<v1::Host>& hosts) {
  std::string out;
  for (const v1::Host& host : hosts) {
    for (const std::string& note : host.notes()) out += fmt::format("\n{}: {}", host.name(), note);
  }
  return out.empty() ? "" : out + "\n";
}

const TableRow kHostHeader{"NAME", "STATE", "REGIONS", "CAPACITY", "ADDRESS", "VERSION", "AGE"};

// An agent of an earlier release lists games, and does not say whether they have a movement.
std::string PartsOf(const v1::GameModule& module) {
  if (!module.failure().empty()) return "-";
  if (module.no_game()) return "movement";
  return module.movement() ? "game+movement" : "game";
}

std::string ModuleTable(const v1::Host& host) {
  std::vector<TableRow> rows{{"GAME-MODULE", "HAS", "ABI", "SHA-256", "PROBLEM"}};
  for (const v1::GameModule& module : host.game_modules()) {
    rows.push_back({module.name(), PartsOf(module), module.abi() == 0 ? "-" : std::to_string(module.abi()),
                    module.hash().empty() ? "-" : module.hash(), module.failure().empty() ? "-" : module.failure()});
  }
  return FormatTable(rows);
}

void Add(const Globals& globals, const HostOptions& options) {
  local::Connection connection = Connect(globals);
  v1::AddHostRequest request;
  request.set_name(options.name);
  request.set_validate_only(options.dry_run);
  request.set_max_regions(options.max_regions);
  request.mutable_join_token_ttl()->set_seconds(std::llround(options.token_hours * 3600));
  const auto response = connection.Call("host add", connection.hosts(), &v1::HostService::Stub::AddHost, request);
  PrintChange(globals, "host", options.name, "added", options.dry_run, response);
  if (globals.format == Format::kTable && !options.dry_run) {
    std::cout << fmt::format("join token (shown once, good for {} h): {}\n", options.token_hours, response.join_token())
              << HostSteps(AddressForHosts(globals));
  }
}

void ListHosts(const Globals& globals) {
  local::Connection connection = Connect(globals);
  v1::ListHostsResponse all;
  v1::ListHostsRequest request;
  do {
    const auto page = connection.Call("host list", connection.hosts(), &v1::HostService::Stub::ListHosts, request);
    all.mutable_hosts()->MergeFrom(page.hosts());
    request.set_page_token(page.next_page_token());
  } while (!request.page_token().empty());
  if (globals.format == Format::kJson) {
    std::cout << ToJson(all);
    return;
  }
  std::vector<TableRow> rows{kHostHeader};
  for (const v1::Host& host : all.hosts()) {
    if (globals.format == Format::kName) std::cout << "host/" << host.name() << "\n";
    rows.push_back(HostRow(host));
  }
  if (globals.format == Format::kName) return;
  if (rows.size() == 1) {
    std::cerr << "no hosts; add one with 'tessera host add NAME'\n";
    return;
  }
  std::cout << FormatTable(rows) << Notes(all.hosts());
}

void Describe(const Globals& globals, const HostOptions& options) {
  local::Connection connection = Connect(globals);
  v1::GetHostRequest request;
  request.set_name(options.name);
  const auto response = connection.Call("host describe", connection.hosts(), &v1::HostService::Stub::GetHost, request);
  if (globals.format == Format::kJson) {
    std::cout << ToJson(response);
    return;
  }
  std::cout << FormatTable({kHostHeader, HostRow(response.host())});
  for (const std::string& note : response.host().notes()) std::cout << "\nNote: " << note << "\n";
  if (response.host().releases_size() > 1) {
    std::cout << fmt::format("\nWorker programs of releases {}\n", fmt::join(response.host().releases(), ", "));
  }
  if (!response.host().game_modules().empty()) std::cout << "\n" << ModuleTable(response.host());
  if (!response.host().unknown_workers().empty()) {
    std::vector<TableRow> unknown{{"UNKNOWN INSTANCE", "REGION"}};
    for (const v1::WorkerIdentity& worker : response.host().unknown_workers()) {
      unknown.push_back({worker.instance_id(), std::to_string(worker.region())});
    }
    std::cout << "\n" << FormatTable(unknown);
  }
  if (response.workers().empty()) return;
  std::vector<TableRow> rows{{"INSTANCE", "REGION", "PID", "PHASE", "TICK", "OWNED", "MEMORY"}};
  for (const v1::WorkerReport& worker : response.workers()) {
    rows.push_back({worker.identity().instance_id(), std::to_string(worker.identity().region()),
                    std::to_string(worker.identity().pid()),
                    ShortName(v1::WorkerPhase_Name(worker.phase()), "WORKER_PHASE_"), std::to_string(worker.tick()),
                    std::to_string(worker.owned()), FormatBytes(static_cast<double>(worker.resident_bytes()))});
  }
  std::cout << "\n" << FormatTable(rows);
}

void Drain(const Globals& globals, const HostOptions& options) {
  local::Connection connection = Connect(globals);
  v1::DrainHostRequest request;
  request.set_name(options.name);
  request.set_undo(options.undo);
  request.set_validate_only(options.dry_run);
  const auto response = connection.Call("host drain", connection.hosts(), &v1::HostService::Stub::DrainHost, request);
  PrintChange(globals, "host", options.name, options.undo ? "takes regions again" : "draining", options.dry_run,
              response);
}

void Remove(const Globals& globals, const HostOptions& options) {
  local::Connection connection = Connect(globals);
  v1::RemoveHostRequest request;
  request.set_name(options.name);
  request.set_validate_only(options.dry_run);
  request.set_force(options.force);
  const auto response = connection.Call("host remove", connection.hosts(), &v1::HostService::Stub::RemoveHost, request);
  PrintChange(globals, "host", options.name, options.force ? "evicted" : "removed", options.dry_run, response);
}

}  // namespace

void AddHostCommands(CLI::App& app, Globals& globals) {
  auto options = std::make_shared<HostOptions>();
  CLI::App* host = app.add_subcommand("host", "Machines that run an agent")->require_subcommand(1);
  const auto with_name = [&](CLI::App* command, bool changes) {
    command->add_option("name", options->name, "Name of the host")->required();
    if (changes) command->add_flag("--dry-run", options->dry_run, "Only check whether it could be done");
    return command;
  };
  CLI::App* add =
      with_name(host->add_subcommand("add", "Expect a new host; prints the join token that admits its agent"), true);
  add->add_option("--token-hours", options->token_hours, "Hours until the join token runs out")
      ->capture_default_str()
      ->check(CLI::Range(1.0 / 60, 720.0))
      ->check(Finite());
  add->add_option("--max-regions", options->max_regions, "Place no more regions on it, whatever capacity it claims")
      ->capture_default_str()
      ->check(CLI::Range(1, 1000));
  add->callback([&globals, options] { Add(globals, *options); });
  host->add_subcommand("list", "List the hosts")->callback([&globals] { ListHosts(globals); });
  with_name(host->add_subcommand("describe", "Show a host and its workers"), false)->callback([&globals, options] {
    Describe(globals, *options);
  });
  CLI::App* drain = with_name(
      host->add_subcommand("drain", "Move a host's regions elsewhere while their worlds run, and place no new ones"),
      true);
  drain->add_flag("--undo", options->undo, "Take regions again");
  drain->callback([&globals, options] { Drain(globals, *options); });
  CLI::App* remove = with_name(host->add_subcommand("remove", "Forget a host on which nothing runs"), true);
  remove->add_flag("--force", options->force,
                   "Evict it: accept nothing from it any more, and have its regions carried on elsewhere");
  remove->callback([&globals, options] { Remove(globals, *options); });
}

}  // namespace tessera::cli
