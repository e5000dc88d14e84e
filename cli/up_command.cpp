// tessera up: a local cluster in one process tree, until Ctrl-C.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "cli/commands.h"
#include "cli/signals.h"
#include "local_cluster/command_error.h"
#include "local_cluster/local_cluster.h"

namespace tessera::cli {
namespace {

struct UpOptions {
  std::string state_dir;
  std::string listen = "127.0.0.1:7700";
  std::string metrics_listen = "127.0.0.1:7701";
  std::string page_listen = "127.0.0.1:7710";
  std::uint32_t hosts = 1;
  std::uint32_t capacity = 0;
};

std::string DefaultStateDir() {
  const char* state = std::getenv("XDG_STATE_HOME");
  const char* home = std::getenv("HOME");
  if (state != nullptr && *state != '\0') return std::string(state) + "/tessera";
  return std::string(home != nullptr ? home : ".") + "/.local/state/tessera";
}

void Up(const Globals& globals, const UpOptions& options) {
  StopSignal stop;
  local::LocalClusterOptions cluster_options{
      .state_dir = options.state_dir.empty() ? DefaultStateDir() : options.state_dir,
      .listen = options.listen,
      .metrics_listen = options.metrics_listen,
      .hosts = options.hosts,
      .capacity = options.capacity,
      .page_listen = options.page_listen};
  std::error_code error;
  std::filesystem::create_directories(cluster_options.state_dir, error);
  if (error) throw local::CommandError(fmt::format("--state-dir {}: {}", cluster_options.state_dir, error.message()));
  local::LocalCluster cluster(cluster_options);
  if (globals.format == Format::kJson) {
    std::cout << nlohmann::ordered_json{{"page", fmt::format("http://{}/", cluster.page_address())},
                                        {"control", cluster.control_address()},
                                        {"http", cluster.http_address()},
                                        {"hosts", options.hosts},
                                        {"logs", cluster.log_dir()}}
              << std::endl;
  } else {
    std::cout
        << fmt::format(
               "page: http://{}/\ncontrol plane  {}\nmetrics        http://{}/metrics\nhosts          {}\nlogs         "
               "  {}\n\n"
               "Try: tessera --control {} instance create --scene plaza --regions 4 --wait\nCtrl-C ends it all.\n",
               cluster.page_address(), cluster.control_address(), cluster.http_address(), options.hosts,
               cluster.log_dir(), cluster.control_address())
        << std::flush;
  }
  while (!stop.Wait(std::chrono::milliseconds(200))) {
    const std::string death = cluster.WaitForDeath(std::chrono::milliseconds(0));
    if (!death.empty()) throw local::CommandError(death + "; its log is in " + cluster.log_dir());
  }
  if (globals.format != Format::kJson) std::cout << "\nstopping\n" << std::flush;
}

}  // namespace

void AddUpCommand(CLI::App& app, Globals& globals) {
  auto options = std::make_shared<UpOptions>();
  CLI::App* up = app.add_subcommand("up", "Run a cluster on this machine until Ctrl-C");
  up->add_option("--listen", options->listen, "gRPC address of the control plane")->capture_default_str();
  up->add_option("--metrics-listen", options->metrics_listen,
                 "HTTP address of the control plane: /metrics, /healthz, /sd/prometheus")
      ->capture_default_str();
  up->add_option("--page-listen", options->page_listen, "HTTP address of the page")->capture_default_str();
  up->add_option("--hosts", options->hosts, "Number of agents")->capture_default_str()->check(CLI::Range(1, 16));
  up->add_option("--capacity", options->capacity, "Regions that each agent takes (default: 8 a core)");
  up->add_option("--state-dir", options->state_dir, "State and logs (default: ~/.local/state/tessera)");
  up->callback([&globals, options] { Up(globals, *options); });
}

}  // namespace tessera::cli
