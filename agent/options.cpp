#include "agent/options.h"

#include <arpa/inet.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <system_error>
#include <thread>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "agent/limits.h"
#include "host/files.h"
#include "host/program_folder.h"
#include "host/renamed_options.h"
#include "host/socket_address.h"
#include "trust/control_address.h"

namespace tessera::agent {
namespace {

constexpr char kTokenEnvironment[] = "TESSERA_JOIN_TOKEN";
constexpr std::uint32_t kMaxCapacity = 10'000;
// 90 days, and 4 s to 10 years: a shorter one would be asked for all the time.
constexpr double kDefaultCertificateHours = 2160, kLeastCertificateHours = .001, kMostCertificateHours = 87'600;

// Half of the machine's, so that no single worker takes it all, but no less than one needs with its threads' stacks,
// and no more than a region of a million bodies has use for.
std::uint64_t DefaultWorkerMegabytes() {
  const auto machine_mb =
      static_cast<std::uint64_t>(sysconf(_SC_PHYS_PAGES)) * static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE)) >> 20;
  return std::clamp(machine_mb / 2, kLeastWorkerMemory_mb, kMostDefaultMemory_mb);
}

struct AgentFlags {
  std::string control = "unix:" + trust::DefaultControlSocket(), join_token, join_token_file,
              state_dir = "/var/lib/tessera/agent";
  std::string advertise = "127.0.0.1", bind, metrics = "127.0.0.1:7702", metrics_token_file, region_binary, ready_file,
              game_modules, release_programs, log_level;
  telemetry::MetricsTlsFiles metrics_tls;
  std::string ports = "7800-8799";
  std::uint32_t capacity = 0;
  std::string worker_sandbox = "on", worker_cgroups = "off";
  std::uint32_t worker_tasks = kUsualWorkerTasks;
  std::uint64_t worker_memory_mb = DefaultWorkerMegabytes();
  double certificate_hours = kDefaultCertificateHours;
  bool stop_workers = false, die_with_parent = false;
};

void Declare(CLI::App& app, AgentFlags& f) {
  app.set_version_flag("--version", "tessera-agent " TESSERA_VERSION);
  app.add_option(
         "--control", f.control,
         "the control plane: unix:PATH, or HOST:PORT, which is TLS; default the socket of this user's `tessera up`")
      ->envname("TESSERA_CONTROL");
  auto* token =
      app.add_option("--join-token", f.join_token,
                     "from `tessera host add`; the first time only. Others on this machine see it here: better "
                     "the file or the environment's TESSERA_JOIN_TOKEN");
  app.add_option("--join-token-file", f.join_token_file, "a file that holds it; once admitted, it is not read")
      ->excludes(token);
  app.add_option("--state-dir", f.state_dir, "where this host's identity, sockets, logs and scenes are kept")
      ->envname("TESSERA_AGENT_STATE_DIR")
      ->capture_default_str();
  app.add_option("--advertise-address", f.advertise, "where clients and other hosts reach this one")
      ->capture_default_str();
  app.add_option(
      "--bind-address", f.bind,
      "IPv4 address on which workers listen; default 127.0.0.1 if the advertised one is loopback, else 0.0.0.0");
  app.add_option("--port-range", f.ports, "ports of workers, three each, FIRST-LAST")->capture_default_str();
  app.add_option("--capacity", f.capacity, "how many workers this host takes; default 8 a core");
  app.add_option("--metrics-listen", f.metrics,
                 "ADDRESS:PORT of /metrics; port 0 takes a free one; workers serve theirs at the same address")
      ->capture_default_str();
  app.add_option("--metrics-token-file", f.metrics_token_file,
                 "file with a token that scrapers must show, to workers too; default none: whoever reaches the address "
                 "may ask");
  telemetry::AddMetricsTlsOptions(app, f.metrics_tls);
  app.add_option("--region-binary", f.region_binary, "the worker program; default tessera-region beside this one");
  app.add_option(
      "--release-programs", f.release_programs,
      "folder with a folder for each release whose worker program this host keeps, for worlds that began with "
      "it; default ../lib/tessera/releases from this program's");
  app.add_option("--game-modules", f.game_modules,
                 "folder of shared libraries that worlds may run as games, which are trusted; default none");
  app.add_option("--worker-sandbox", f.worker_sandbox,
                 "off: workers may open whatever this user may, as native games that read files of their own need")
      ->check(CLI::IsMember({"on", "off"}))
      ->capture_default_str();
  app.add_option("--worker-memory-mb", f.worker_memory_mb,
                 "address space of a worker in the sandbox; default half of the machine's memory; 0: no limit");
  app.add_option("--worker-cgroups", f.worker_cgroups,
                 "on: each worker has a control group of its own, which bounds memory that it really uses, and tasks; "
                 "for a unit with Delegate=memory pids")
      ->check(CLI::IsMember({"on", "off"}))
      ->capture_default_str();
  app.add_option("--worker-tasks", f.worker_tasks, "threads of a worker in its control group; 0: no limit")
      ->check(CLI::Range(std::uint32_t{0}, kMostWorkerTasks))
      ->capture_default_str();
  app.add_option("--certificate-hours", f.certificate_hours,
                 "life of this host's certificate: it asks for the next one when two thirds of it are over")
      ->check(CLI::Range(kLeastCertificateHours, kMostCertificateHours))
      ->capture_default_str();
  app.add_option("--ready-file", f.ready_file, "written with one line of JSON once admitted");
  app.add_flag("--stop-workers", f.stop_workers,
               "end the workers at the end, instead of leaving them to the next agent");
  app.add_flag("--die-with-parent", f.die_with_parent,
               "end as on SIGTERM when the parent process dies; workers then die with this one, however it ends");
  app.add_option("--log-level", f.log_level, "trace, debug, info, warning, error or off; else TESSERA_LOG, else info");
}

absl::StatusOr<host::SocketAddress> ParseAddress(const char* option, const std::string& text, host::PortRule ports) {
  auto address = host::ParseSocketAddress(text, ports);
  if (!address.ok()) return absl::InvalidArgumentError(absl::StrCat(option, " ", address.status().message()));
  return address;
}

absl::Status CheckAddresses(const AgentFlags& f, AgentOptions& options) {
  if (!host::IsHostName(f.advertise)) {
    return absl::InvalidArgumentError(
        absl::StrCat("--advertise-address \"", f.advertise, "\" is neither an address nor a host name"));
  }
  options.advertise_address = f.advertise;
  options.bind_address = f.bind.empty() ? DefaultBindAddress(f.advertise) : f.bind;
  in_addr ignored{};
  if (inet_pton(AF_INET, options.bind_address.c_str(), &ignored) != 1) {
    return absl::InvalidArgumentError(absl::StrCat("--bind-address \"", f.bind, "\" is not an IPv4 address"));
  }
  if (auto control = trust::ParseControlAddresses(f.control, host::PortRule::kFrom1); !control.ok()) {
    return absl::InvalidArgumentError(absl::StrCat("--control ", control.status().message()));
  }
  options.control = f.control;
  auto metrics = ParseAddress("--metrics-listen", f.metrics, host::PortRule::kFrom0);
  if (!metrics.ok()) return metrics.status();
  options.metrics_host = metrics->host;
  options.metrics_port = metrics->port;
  // Workers get the paths too, and the folder that they start in is theirs to choose.
  const auto whole = [](const std::string& path) {
    return path.empty() ? path : std::filesystem::absolute(path).string();
  };
  options.metrics_token_file = whole(f.metrics_token_file);
  options.metrics_tls = {.certificate = whole(f.metrics_tls.certificate),
                         .key = whole(f.metrics_tls.key),
                         .client_authority = whole(f.metrics_tls.client_authority)};
  return absl::OkStatus();
}

absl::Status CheckModules(const AgentFlags& f, AgentOptions& options) {
  if (f.game_modules.empty()) return absl::OkStatus();
  std::error_code error;
  if (!std::filesystem::is_directory(f.game_modules, error)) {
    return absl::InvalidArgumentError(absl::StrCat("--game-modules ", f.game_modules, ": no such folder"));
  }
  options.game_modules = std::filesystem::absolute(f.game_modules, error).lexically_normal().string();
  return absl::OkStatus();
}

absl::Status CheckReleaseFolder(const AgentFlags& f, AgentOptions& options) {
  std::error_code error;
  if (!f.release_programs.empty() && !std::filesystem::is_directory(f.release_programs, error)) {
    return absl::InvalidArgumentError(absl::StrCat("--release-programs ", f.release_programs, ": no such folder"));
  }
  const std::string folder =
      f.release_programs.empty() ? host::ProgramFolder() + "/../lib/tessera/releases" : f.release_programs;
  options.release_programs = std::filesystem::absolute(folder, error).lexically_normal().string();
  return absl::OkStatus();
}

absl::Status CheckCapacity(const AgentFlags& f, AgentOptions& options) {
  auto ports = PortRange::Parse(f.ports);
  if (!ports.ok()) return absl::InvalidArgumentError(absl::StrCat("--port-range ", ports.status().message()));
  options.ports = *std::move(ports);
  const std::uint32_t room = options.ports.places();
  const std::uint32_t cores = std::max(std::thread::hardware_concurrency(), 1U);
  options.capacity = f.capacity > 0 ? f.capacity : std::min(cores * kRegionsPerCore, room);
  if (options.capacity > kMaxCapacity) {
    return absl::InvalidArgumentError(absl::StrCat("--capacity must be at most ", kMaxCapacity, ", got ", f.capacity));
  }
  if (options.capacity > room) {
    return absl::InvalidArgumentError(
        absl::StrCat("--capacity ", f.capacity, ": --port-range ", f.ports, " has room for ", room, " workers only"));
  }
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<std::string> ReadJoinToken(const AgentOptions& options) {
  if (options.join_token_file.empty()) return options.join_token;
  absl::StatusOr<std::string> text = host::ReadFile(options.join_token_file, kMaxTokenBytes);
  if (!text.ok()) return absl::InvalidArgumentError(absl::StrCat("--join-token-file ", text.status().message()));
  std::string token(absl::StripAsciiWhitespace(*text));
  if (token.empty()) {
    return absl::InvalidArgumentError(absl::StrCat("--join-token-file ", options.join_token_file, ": is empty"));
  }
  return token;
}

std::string DefaultBindAddress(const std::string& address) {
  return absl::StartsWith(address, "127.") || address == "localhost" ? "127.0.0.1" : "0.0.0.0";
}

std::string MetricsAddressOfHost(const std::string& metrics_host) {
  const bool everywhere = metrics_host == "0.0.0.0" || metrics_host == "::";
  const bool loopback = absl::StartsWith(metrics_host, "127.") || metrics_host == "localhost" || metrics_host == "::1";
  return everywhere || loopback ? "" : metrics_host;
}

absl::StatusOr<AgentOptions> ParseOptions(int argc, char** argv) {
  if (const std::string refused = host::RefusedOption(argc, argv); !refused.empty()) {
    return absl::InvalidArgumentError(refused);
  }
  CLI::App app{"The agent of one host: starts, watches and ends the region workers that the control plane wants here."};
  AgentFlags f;
  Declare(app, f);
  try {
    app.parse(argc, argv);
  } catch (const CLI::Success& success) {  // --help, --version
    std::exit(app.exit(success));
  } catch (const CLI::ParseError& error) {
    return absl::InvalidArgumentError(absl::StrCat(error.what(), "; see --help"));
  }
  AgentOptions options;
  if (absl::Status status = CheckAddresses(f, options); !status.ok()) return status;
  if (absl::Status status = CheckCapacity(f, options); !status.ok()) return status;
  if (absl::Status status = CheckModules(f, options); !status.ok()) return status;
  if (absl::Status status = CheckReleaseFolder(f, options); !status.ok()) return status;
  options.join_token = f.join_token;
  options.join_token_file = f.join_token_file;
  if (const char* token = std::getenv(kTokenEnvironment); token != nullptr && f.join_token.empty()) {
    options.join_token = token;
  }
  options.state_dir = f.state_dir;
  options.region_binary_given = !f.region_binary.empty();
  options.region_binary = f.region_binary.empty() ? host::ProgramFolder() + "/tessera-region" : f.region_binary;
  options.ready_file = f.ready_file;
  options.log_level = f.log_level;
  if (f.worker_memory_mb != 0 && f.worker_memory_mb < kLeastWorkerMemory_mb) {
    return absl::InvalidArgumentError(
        absl::StrCat("--worker-memory-mb must be 0 or at least ", kLeastWorkerMemory_mb, ", got ", f.worker_memory_mb));
  }
  options.worker_sandbox = f.worker_sandbox == "on";
  options.worker_memory_mb = f.worker_memory_mb;
  options.worker_cgroups = f.worker_cgroups == "on";
  options.worker_tasks = f.worker_tasks;
  options.certificate_life_s = f.certificate_hours * 3600;
  options.stop_workers = f.stop_workers;
  options.die_with_parent = f.die_with_parent;
  return options;
}

}  // namespace tessera::agent
