// tessera up: a local cluster in one process tree, until Ctrl-C.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <deque>
#include <filesystem>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>
#include <vector>

#include "cli/commands.h"
#include "cli/output.h"
#include "cli/signals.h"
#include "cli/table.h"
#include "local_cluster/command_error.h"
#include "local_cluster/connection.h"
#include "local_cluster/instance_state.h"
#include "local_cluster/local_cluster.h"
#include "trust/control_address.h"

namespace tessera::cli {
namespace {

struct UpOptions {
  std::string state_dir;
  std::string socket, listen, players_listen, players_https;
  std::string metrics_listen = "127.0.0.1:7701", metrics_token_file;
  std::string page_listen = "127.0.0.1:7710";
  std::uint32_t hosts = 1;
  std::uint32_t capacity = 0;
  std::string game_modules, visuals;
};

std::string DefaultStateDir() {
  const char* state = std::getenv("XDG_STATE_HOME");
  const char* home = std::getenv("HOME");
  if (state != nullptr && *state != '\0') return std::string(state) + "/tessera";
  return std::string(home != nullptr ? home : ".") + "/.local/state/tessera";
}

// For the checkpoints of all worlds together, when the cluster ends.
constexpr std::chrono::seconds kLastCheckpoints{20};

bool IsUnderWay(const v1::Instance& instance) {
  return instance.state() != v1::INSTANCE_STATE_STOPPING && instance.state() != v1::INSTANCE_STATE_ENDED &&
         instance.state() != v1::INSTANCE_STATE_FAILED;
}

std::vector<v1::Instance> InstancesUnderWay(local::Connection& control) {
  std::vector<v1::Instance> instances = local::ListInstances(control);
  std::erase_if(instances, [](const v1::Instance& instance) { return !IsUnderWay(instance); });
  return instances;
}

// Instances that an earlier run left, which begin again by themselves: one line each, with the moment they go back to.
std::vector<std::string> DescribeLeftOver(local::Connection& control) {
  std::vector<std::string> lines;
  for (const v1::Instance& instance : InstancesUnderWay(control)) {
    v1::ListCheckpointsRequest request;
    request.set_id(instance.id());
    const auto listed =
        control.Call("instance list", control.instances(), &v1::InstanceService::Stub::ListCheckpoints, request);
    const std::string name = fmt::format("{} ({})", instance.id(), instance.scene_name());
    const auto newest = std::find_if(listed.checkpoints().rbegin(), listed.checkpoints().rend(),
                                     [](const v1::Checkpoint& checkpoint) { return !checkpoint.taken_back(); });
    if (newest == listed.checkpoints().rend()) {
      lines.push_back(fmt::format("{} has no checkpoint to begin again with", name));
      continue;
    }
    lines.push_back(fmt::format("{} begins again with its checkpoint of tick {}, made {} ago", name, newest->tick(),
                                FormatAge(AgeSeconds(newest->create_time()))));
  }
  return lines;
}

// So that the next run begins where this one ended. Says what it did; a world that cannot be kept is named.
void KeepWorlds(local::Connection& control, std::ostream& out) {
  const auto end = std::chrono::steady_clock::now() + kLastCheckpoints;
  // The connection may still believe that a control plane which died and was started again is away.
  const auto under_way = [&] {
    while (true) {
      try {
        return InstancesUnderWay(control);
      } catch (const local::CommandError&) {
        if (std::chrono::steady_clock::now() > end) throw;
        std::this_thread::sleep_for(std::chrono::milliseconds(100));
      }
    }
  };
  for (const v1::Instance& instance : under_way()) {
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(end - std::chrono::steady_clock::now());
    if (left <= std::chrono::milliseconds(0)) {
      out << fmt::format("{}: no time was left for a checkpoint\n", instance.id());
      continue;
    }
    v1::CheckpointInstanceRequest request;
    request.set_id(instance.id());
    try {
      const auto answer = control.Call("last checkpoint", control.instances(),
                                       &v1::InstanceService::Stub::CheckpointInstance, request, left);
      out << fmt::format("{}: checkpoint of tick {}\n", instance.id(), answer.checkpoint().tick()) << std::flush;
    } catch (const local::CommandError& error) {
      out << fmt::format("{}: {}\n", instance.id(), error.what()) << std::flush;
    }
  }
}

// Until Ctrl-C. A program that dies is started again, as systemd does on a host, so that it can be tried what a world
// does meanwhile; too many deaths within a minute have a cause that another start does not mend.
void KeepUp(local::LocalCluster& cluster, StopSignal& stop, std::ostream& out) {
  constexpr std::size_t kMostDeaths = 5;
  constexpr std::chrono::minutes kWithin{1};
  std::deque<std::chrono::steady_clock::time_point> deaths;
  while (!stop.Wait(std::chrono::milliseconds(200))) {
    const std::string death = cluster.WaitForDeath(std::chrono::milliseconds(0));
    if (death.empty()) continue;
    const auto now = std::chrono::steady_clock::now();
    while (!deaths.empty() && deaths.front() + kWithin < now) deaths.pop_front();
    if (deaths.size() >= kMostDeaths) throw local::CommandError(death + "; its log is in " + cluster.log_dir());
    for (const std::string& one : cluster.Revive()) {
      deaths.push_back(now);
      out << fmt::format("{}; it was started again\n", one) << std::flush;
    }
  }
}

void Up(const Globals& globals, const UpOptions& options) {
  StopSignal stop;
  local::LocalClusterOptions cluster_options{
      .state_dir = options.state_dir.empty() ? DefaultStateDir() : options.state_dir,
      .socket = options.socket.empty() ? trust::DefaultControlSocket() : options.socket,
      .listen = options.listen,
      .players_listen = options.players_listen,
      .players_https = options.players_https,
      .metrics_listen = options.metrics_listen,
      .metrics_token_file = options.metrics_token_file,
      .hosts = options.hosts,
      .capacity = options.capacity,
      .page_listen = options.page_listen,
      .visuals = options.visuals,
      .game_modules = options.game_modules};
  std::error_code error;
  std::filesystem::create_directories(cluster_options.state_dir, error);
  if (error) throw local::CommandError(fmt::format("--state-dir {}: {}", cluster_options.state_dir, error.message()));
  local::LocalCluster cluster(cluster_options);
  local::Connection control(cluster.control_address());
  const std::vector<std::string> left_over = DescribeLeftOver(control);
  if (globals.format == Format::kJson) {
    std::cout << nlohmann::ordered_json{{"page", cluster.page_url()},
                                        {"control", cluster.control_address()},
                                        {"operators", cluster.operators_address()},
                                        {"players", cluster.players_address()},
                                        {"players_https", cluster.players_https_address()},
                                        {"http", cluster.http_address()},
                                        {"hosts", options.hosts},
                                        {"logs", cluster.log_dir()},
                                        {"left_over", left_over}}
              << std::endl;
  } else {
    std::cout << fmt::format("page: {}\n", cluster.page_url());
    for (const std::string& line : left_over) std::cout << line << "\n";
    std::cout << fmt::format(
                     "control plane  {}\nmetrics        http://{}/metrics\nhosts          {}\nlogs         "
                     "  {}\n\n"
                     "Try: tessera {}instance create --scene plaza --regions 4 --wait\nCtrl-C ends it all.\n",
                     cluster.control_address(), cluster.http_address(), options.hosts, cluster.log_dir(),
                     options.socket.empty() ? "" : "--control " + cluster.control_address() + " ")
              << std::flush;
  }
  KeepUp(cluster, stop, globals.format == Format::kJson ? std::cerr : std::cout);
  if (globals.format != Format::kJson) std::cout << "\nstopping\n" << std::flush;
  std::ostream discarded(nullptr);
  KeepWorlds(control, globals.format == Format::kJson ? discarded : std::cout);
}

}  // namespace

void AddUpCommand(CLI::App& app, Globals& globals) {
  auto options = std::make_shared<UpOptions>();
  CLI::App* up = app.add_subcommand("up", "Run a cluster on this machine until Ctrl-C");
  up->add_option("--socket", options->socket,
                 "Path of the control plane's socket (default: where commands of this user look for it)");
  up->add_option("--listen", options->listen, "Address for operators and agents elsewhere, by TLS (default: none)");
  up->add_option("--players-listen", options->players_listen, "Address for players elsewhere, by TLS (default: none)");
  up->add_option(
      "--players-https", options->players_https,
      "Address for players and games' backends: HTTPS with JSON, by the cluster's authority (default: none)");
  up->add_option("--metrics-listen", options->metrics_listen,
                 "HTTP address of the control plane: /metrics, /healthz, /sd/prometheus")
      ->capture_default_str();
  up->add_option("--metrics-token-file", options->metrics_token_file,
                 "File with a token that scrapers must show to every program (default: none)");
  up->add_option("--page-listen", options->page_listen, "HTTP address of the page")->capture_default_str();
  up->add_option("--hosts", options->hosts, "Number of agents")->capture_default_str()->check(CLI::Range(1, 16));
  up->add_option("--capacity", options->capacity, "Regions that each agent takes (default: 8 a core)");
  up->add_option("--game-modules", options->game_modules,
                 "Folder of shared libraries that worlds may run as games, which are trusted (default: none)")
      ->check(CLI::ExistingDirectory);
  up->add_option("--visuals", options->visuals,
                 "Folder of the meshes that tessera scene import wrote, for the page to draw (default: none)")
      ->check(CLI::ExistingDirectory);
  up->add_option("--state-dir", options->state_dir, "State and logs (default: ~/.local/state/tessera)");
  up->callback([&globals, options] { Up(globals, *options); });
}

}  // namespace tessera::cli
