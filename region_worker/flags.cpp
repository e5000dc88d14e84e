#include "region_worker/flags.h"

#include <filesystem>

#include "CLI/CLI.hpp"
#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "core/world/limits.h"
#include "host/renamed_options.h"
#include "host/socket_address.h"
#include "region_worker/standalone.h"
#include "telemetry/metrics_tls.h"
#include "telemetry/metrics_token.h"

namespace tessera::worker {
namespace {

constexpr std::uint32_t kPortsPerRegion = 3;

struct RawFlags {
  Standalone standalone;
  double seconds = 0;
  std::uint32_t region = 0;
  std::uint64_t incarnation = 0;
  WorkerOptions options;
  std::string metrics_listen, metrics_token_file, sandbox = "off";
  telemetry::MetricsTlsFiles metrics_tls;
};

void Declare(CLI::App& app, RawFlags& raw) {
  WorkerOptions& options = raw.options;
  const auto port = CLI::Range(0, 65535);
  app.set_version_flag("--version", "tessera-region " TESSERA_VERSION);
  app.add_option("--region", raw.region, "which region of the instance this is, from 1; required");
  app.add_option("--bind-address", options.bind_address, "IPv4 address to listen on")->capture_default_str();
  app.add_option("--metrics-listen", raw.metrics_listen,
                 "ADDRESS:PORT of /metrics; port 0 takes a free one; left out: 127.0.0.1, alone at the third port");
  app.add_option("--metrics-token-file", raw.metrics_token_file,
                 "file with a token that scrapers must show; left out: whoever reaches the address may ask");
  telemetry::AddMetricsTlsOptions(app, raw.metrics_tls);
  app.add_option("--log-level", options.log_level,
                 "trace, debug, info, warning, error or off; else TESSERA_LOG, else info")
      ->check(CLI::IsMember({"trace", "debug", "info", "warning", "error", "off"}));
  app.add_option("--log-file", options.log_file, "append the log to this file instead of stderr");
  app.add_option("--describe-game-module", options.describe_game_module,
                 "load this shared library, say on one line which game it is, and end");

  const char* alone = "Standalone, without a control plane";
  app.add_option("--scene", raw.standalone.scene_path, "scene file, textproto or JSON")->group(alone);
  app.add_option("--game", raw.standalone.game_path, "Lua file that the region runs; left out: none")->group(alone);
  app.add_option("--game-module", raw.standalone.game_module_path,
                 "shared library of a game that the region runs, which is trusted; left out: none")
      ->group(alone);
  app.add_option("--movement", raw.standalone.movement_path,
                 "shared library with a movement for the players of --game, which is trusted; left out: none")
      ->group(alone);
  app.add_option("--regions", raw.standalone.regions, "how many regions the world is cut into")
      ->capture_default_str()
      ->group(alone);
  app.add_option("--base-port", raw.standalone.base_port, "region r listens on base + 3 (r - 1): game, links, metrics")
      ->capture_default_str()
      ->group(alone);
  app.add_option("--players", raw.standalone.players, "start when so many clients are connected; 0: at once")
      ->capture_default_str()
      ->group(alone);
  app.add_option("--seconds", raw.seconds, "end after so many seconds of running; left out: on a signal")->group(alone);
  app.add_option("--snapshot-rate", raw.standalone.snapshot_rate_hz, "snapshots a second to each client")
      ->capture_default_str()
      ->group(alone);

  app.add_option("--ghost-depth", raw.standalone.borders.ghost_depth,
                 "how many bodies deep a neighbour sees of a pile that moves")
      ->capture_default_str()
      ->group(alone);
  app.add_option("--whole-up-to", raw.standalone.borders.whole_up_to,
                 "piles of which a region has no more than so many bodies are relevant as a whole")
      ->capture_default_str()
      ->group(alone);

  app.add_option("--region-threads", raw.standalone.borders.threads, "threads that work on each region's step, 1 to 32")
      ->capture_default_str()
      ->group(alone);

  const char* agent = "Under an agent";
  app.add_option("--agent-socket", options.agent_socket, "Unix socket of the agent that gives the orders")
      ->group(agent);
  app.add_option("--instance", options.identity.instance_id, "id of the instance")->group(agent);
  app.add_option("--incarnation", raw.incarnation, "which life of the worker this is")->group(agent);
  app.add_option("--advertise-address", options.advertise_address,
                 "where others reach this host; left out: the bind address")
      ->group(agent);
  app.add_option("--game-port", options.game_port, "UDP port for clients; 0: any")->check(port)->group(agent);
  app.add_option("--link-port", options.link_port, "UDP port for other regions; 0: any")->check(port)->group(agent);
  app.add_option("--max-players", options.max_players, "how many play in the world at one time")
      ->check(CLI::Range(std::uint32_t{1}, kMaxPlayers))
      ->capture_default_str()
      ->group(agent);
  app.add_option("--sandbox", raw.sandbox, "on: give up other files, programs and processes before anything is read")
      ->check(CLI::IsMember({"on", "off"}))
      ->capture_default_str()
      ->group(agent);
  app.add_option("--readable", options.readable, "in the sandbox: a folder that is read; any number")->group(agent);
  app.add_option("--writable", options.writable, "in the sandbox: a folder that is written; any number")->group(agent);
  app.add_option("--memory-mb", options.memory_mb, "in the sandbox: address space that it takes at most; 0: no limit")
      ->capture_default_str()
      ->group(agent);
}

absl::Status CheckAgentFlags(RawFlags& raw) {
  if (raw.options.identity.instance_id.empty()) return absl::InvalidArgumentError("--instance is required");
  if (raw.region == 0) return absl::InvalidArgumentError("--region 0: regions are numbered from 1");
  if (raw.incarnation == 0) return absl::InvalidArgumentError("--incarnation is required, from 1");
  raw.options.identity.incarnation = Incarnation(raw.incarnation);
  raw.options.sandbox = raw.sandbox == "on";
  if (raw.options.sandbox && raw.options.log_file.empty()) {
    return absl::InvalidArgumentError("--sandbox on needs --log-file");
  }
  return absl::OkStatus();
}

absl::Status CheckLibrary(const char* option, const std::string& path) {
  const std::filesystem::path library = path;
  std::error_code error;
  if (path.empty() || (library.extension() == ".so" && std::filesystem::is_regular_file(library, error))) {
    return absl::OkStatus();
  }
  return absl::InvalidArgumentError(absl::StrCat(option, " ", path, ": no such file, or not a .so"));
}

absl::Status CheckLibraries(const Standalone& alone) {
  if (!alone.game_module_path.empty() && !alone.game_path.empty()) {
    return absl::InvalidArgumentError("--game and --game-module: a region runs one game; use one of them");
  }
  if (!alone.movement_path.empty() && alone.game_path.empty()) {
    return absl::InvalidArgumentError("--movement is for a game in Lua, and --game is missing");
  }
  if (absl::Status status = CheckLibrary("--game-module", alone.game_module_path); !status.ok()) return status;
  return CheckLibrary("--movement", alone.movement_path);
}

absl::Status CheckStandaloneFlags(RawFlags& raw, bool has_seconds) {
  Standalone& alone = raw.standalone;
  if (alone.scene_path.empty()) return absl::InvalidArgumentError("--scene is required (or --agent-socket)");
  if (std::error_code error; !std::filesystem::is_regular_file(alone.scene_path, error)) {
    return absl::InvalidArgumentError(absl::StrCat("--scene ", alone.scene_path, ": no such file"));
  }
  if (std::error_code error; !alone.game_path.empty() && !std::filesystem::is_regular_file(alone.game_path, error)) {
    return absl::InvalidArgumentError(absl::StrCat("--game ", alone.game_path, ": no such file"));
  }
  if (absl::Status status = CheckLibraries(alone); !status.ok()) return status;
  if (alone.regions == 0 || alone.regions > kMaxRegions) {
    return absl::InvalidArgumentError(absl::StrCat("--regions ", alone.regions, ": must be 1 to ", kMaxRegions));
  }
  if (raw.region == 0 || raw.region > alone.regions) {
    return absl::InvalidArgumentError(
        absl::StrCat("--region ", raw.region, ": this instance has regions 1 to ", alone.regions));
  }
  if (alone.base_port == 0) return absl::InvalidArgumentError("--base-port 0: must be 1 to 65535");
  if (alone.base_port + kPortsPerRegion * alone.regions > 65536) {
    return absl::InvalidArgumentError(absl::StrCat("--base-port ", alone.base_port, ": ", alone.regions,
                                                   " regions take three ports each, which ends past 65535"));
  }
  if (alone.players > kUsualPlayers) {
    return absl::InvalidArgumentError(absl::StrCat("--players ", alone.players, ": must be 0 to ", kUsualPlayers));
  }
  if (alone.snapshot_rate_hz == 0 || alone.snapshot_rate_hz > kMaxTickRateHz) {
    return absl::InvalidArgumentError(
        absl::StrCat("--snapshot-rate ", alone.snapshot_rate_hz, ": must be 1 to ", kMaxTickRateHz));
  }
  if (alone.borders.ghost_depth > region::kMaxGhostDepth) {
    return absl::InvalidArgumentError(
        absl::StrCat("--ghost-depth ", alone.borders.ghost_depth, ": must be 0 to ", region::kMaxGhostDepth));
  }
  if (alone.borders.threads < 1 || alone.borders.threads > region::kMaxRegionThreads) {
    return absl::InvalidArgumentError(
        absl::StrCat("--region-threads ", alone.borders.threads, ": must be 1 to ", region::kMaxRegionThreads));
  }
  if (alone.borders.whole_up_to > region::kMaxWholeUpTo) {
    return absl::InvalidArgumentError(
        absl::StrCat("--whole-up-to ", alone.borders.whole_up_to, ": must be 0 to ", region::kMaxWholeUpTo));
  }
  if (has_seconds) {
    if (!(raw.seconds > 0) || raw.seconds > kMaxSeconds) {
      return absl::InvalidArgumentError(
          absl::StrCat("--seconds ", raw.seconds, ": must be above 0, at most ", kMaxSeconds));
    }
    alone.seconds = raw.seconds;
  }
  const auto first = static_cast<std::uint16_t>(alone.base_port + kPortsPerRegion * (raw.region - 1));
  raw.options.game_port = first;
  raw.options.link_port = static_cast<std::uint16_t>(first + 1);
  raw.options.metrics_port = static_cast<std::uint16_t>(first + 2);
  raw.options.identity.instance_id = kStandaloneInstanceId;
  raw.options.identity.incarnation = Incarnation(raw.region);  // unique in the world
  raw.options.standalone = alone;
  return absl::OkStatus();
}

absl::Status CheckMetrics(RawFlags& raw) {
  auto token = telemetry::ReadMetricsToken(raw.metrics_token_file);
  if (!token.ok()) return token.status();
  raw.options.metrics_token = *std::move(token);
  auto tls = telemetry::ReadMetricsTls(raw.metrics_tls);
  if (!tls.ok()) return tls.status();
  raw.options.metrics_tls = *std::move(tls);
  if (raw.metrics_listen.empty()) return absl::OkStatus();
  const auto address = host::ParseSocketAddress(raw.metrics_listen, host::PortRule::kFrom0);
  if (!address.ok()) {
    return absl::InvalidArgumentError(absl::StrCat("--metrics-listen ", address.status().message()));
  }
  raw.options.metrics_host = address->host;
  raw.options.metrics_port = address->port;
  return absl::OkStatus();
}

}  // namespace

std::variant<WorkerOptions, ExitNow> ParseFlags(int argc, const char* const* argv) {
  if (const std::string refused = host::RefusedOption(argc, argv); !refused.empty()) {
    return ExitNow{kExitUsage, absl::StrCat("tessera-region: ", refused, "\n")};
  }
  RawFlags raw;
  CLI::App app("Simulates one region of a Tessera world.", "tessera-region");
  Declare(app, raw);
  try {
    app.parse(argc, argv);
  } catch (const CLI::CallForHelp&) {
    return ExitNow{kExitOk, app.help()};
  } catch (const CLI::CallForVersion&) {
    return ExitNow{kExitOk, app.version() + "\n"};
  } catch (const CLI::Error& error) {
    return ExitNow{kExitUsage, absl::StrCat("tessera-region: ", error.what(), "\n")};
  }
  if (!raw.options.describe_game_module.empty()) return raw.options;
  const bool under_agent = !raw.options.agent_socket.empty();
  absl::Status status = absl::OkStatus();
  if (app.count("--region") == 0) {
    status = absl::InvalidArgumentError("--region is required");
  } else if (under_agent && !raw.standalone.scene_path.empty()) {
    status = absl::InvalidArgumentError("--agent-socket and --scene: the agent gives the scene; use one of them");
  } else if (under_agent && !raw.standalone.game_path.empty()) {
    status = absl::InvalidArgumentError("--agent-socket and --game: the agent gives the game; use one of them");
  } else if (under_agent && !raw.standalone.game_module_path.empty()) {
    status = absl::InvalidArgumentError("--agent-socket and --game-module: a module is for a region without an agent");
  } else if (under_agent && !raw.standalone.movement_path.empty()) {
    status = absl::InvalidArgumentError("--agent-socket and --movement: it is for a region without an agent");
  } else {
    status = under_agent ? CheckAgentFlags(raw) : CheckStandaloneFlags(raw, app.count("--seconds") > 0);
  }
  if (status.ok()) status = CheckMetrics(raw);
  if (!status.ok()) return ExitNow{kExitUsage, absl::StrCat("tessera-region: ", status.message(), "\n")};
  raw.options.identity.region = RegionId(raw.region);
  if (raw.options.advertise_address.empty()) raw.options.advertise_address = raw.options.bind_address;
  return raw.options;
}

}  // namespace tessera::worker
