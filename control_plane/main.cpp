// tessera-control: the control plane of a cluster.
#include <fmt/format.h>
#include <grpcpp/grpcpp.h>
#include <malloc.h>
#include <signal.h>
#include <sodium.h>
#include <spdlog/spdlog.h>
#include <sys/stat.h>
#include <systemd/sd-daemon.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>

#include "control_plane/backup.h"
#include "control_plane/candidate.h"
#include "control_plane/control_flags.h"
#include "control_plane/control_metrics.h"
#include "control_plane/doors.h"
#include "control_plane/etcd_restore.h"
#include "control_plane/grpc_faults.h"
#include "control_plane/grpc_server.h"
#include "control_plane/http_pages.h"
#include "control_plane/reign.h"
#include "control_plane/sqlite_store.h"
#include "control_plane/watchdog.h"
#include "host/end_signals.h"
#include "host/files.h"
#include "host/renamed_options.h"
#include "host/socket_address.h"
#include "telemetry/logging.h"
#include "telemetry/metrics_server.h"
#include "telemetry/metrics_tls.h"
#include "telemetry/metrics_token.h"

namespace tessera::control {
namespace {

// Arenas of malloc, which makes up to eight for each processor by itself: with fewer, memory grows less over much
// coming and going (docs/decisions/0104).
constexpr int kArenas = 2;

int Fail(const absl::Status& status) {
  std::fprintf(stderr, "tessera-control: %s\n", std::string(status.message()).c_str());
  return 1;
}

absl::StatusOr<std::unique_ptr<telemetry::MetricsServer>> StartHttp(const ControlFlags& flags,
                                                                    const ControlMetrics& metrics) {
  const auto parsed = host::ParseSocketAddress(flags.metrics_listen, host::PortRule::kFrom0);
  if (!parsed.ok()) return parsed.status();
  auto token = telemetry::ReadMetricsToken(flags.metrics_token_file);
  if (!token.ok()) return token.status();
  const auto tls = telemetry::ReadMetricsTls(flags.metrics_tls);
  if (!tls.ok()) return tls.status();
  auto server =
      telemetry::MetricsServer::Start(parsed->host, parsed->port, metrics.registry(), *std::move(token), *tls);
  if (server.ok()) (*server)->AddCollectable(metrics.heap());
  return server;
}

// `doors`: as bound.
absl::Status AnnounceReady(const ControlFlags& flags, const GrpcDoors& doors, const std::string& https_address,
                           const std::string& http_address) {
  if (!flags.ready_file.empty()) {
    const nlohmann::json ready{{"socket", doors.socket},
                               {"grpc", doors.operators},
                               {"players", doors.players},
                               {"players_https", https_address},
                               {"http", http_address}};
    const std::string line = ready.dump() + "\n";
    const absl::Status status = host::WriteFile(flags.ready_file, line, host::Durability::kSurvivesProcess);
    if (!status.ok()) return absl::UnavailableError("--ready-file " + std::string(status.message()));
  }
  sd_notify(0, "READY=1");
  spdlog::info("ready socket={} grpc={} players={} players_https={} http={}", doors.socket, doors.operators,
               doors.players, https_address, http_address);
  return absl::OkStatus();
}

absl::StatusOr<RestoreReport> RestoreIntoFile(const ControlFlags& flags, const std::string& backup) {
  const auto store = SqliteStore::Open(flags.state_dir + "/control.db");
  if (!store.ok()) return store.status();
  return RestoreBackup(backup, **store);
}

absl::StatusOr<RestoreReport> RestoreIntoEtcd(const ControlFlags& flags, const std::string& backup) {
  ForwardGrpcLog();
  const auto client = ConnectStore(flags.store);
  if (!client.ok()) return client.status();
  return RestoreIntoEtcd(**client, flags.store.etcd->prefix, flags.store.self, backup);
}

// Fills the empty store from a backup, and says what it holds. The seal of the backup's control plane must be there, or
// the doors that speak TLS could not be opened.
absl::Status Restore(const ControlFlags& flags) {
  const auto file = host::ReadFile(flags.restore, kMaxBackupBytes);
  if (!file.ok()) return absl::UnavailableError("--restore: " + std::string(file.status().message()));
  if (absl::Status status = host::MakePrivateFolder(flags.state_dir); !status.ok()) {
    return absl::UnavailableError("--state-dir " + std::string(status.message()));
  }
  umask(077);
  const auto report = flags.store.etcd ? RestoreIntoEtcd(flags, *file) : RestoreIntoFile(flags, *file);
  if (!report.ok()) return report.status();
  const std::string seal = flags.state_dir + "/seal.key";
  std::printf(
      "restored: hosts %zu, instances %zu\n%s", report->hosts, report->instances,
      std::filesystem::exists(seal) ? "" : ("put " + seal + " of the control plane before this one there\n").c_str());
  std::printf("now start tessera-control: it takes up what runs, and orders nothing before it knows\n");
  return absl::OkStatus();
}

// Ports are tried first of all, so that one in use costs one line and touches nothing.
absl::Status CheckPorts(const ControlFlags& flags) {
  for (const auto& [address, what] :
       {std::pair(flags.listen, "grpc"), std::pair(flags.players_listen, "players"),
        std::pair(flags.https.listen, "players' https"), std::pair(flags.metrics_listen, "http")}) {
    if (address.empty()) continue;
    const auto parsed = host::ParseSocketAddress(address, host::PortRule::kFrom0);
    if (!parsed.ok()) return parsed.status();
    if (absl::Status status = host::CheckBindable(*parsed, what); !status.ok()) return status;
  }
  return absl::OkStatus();
}

// The only control plane of its cluster: the store is a file of its own.
absl::Status RunAlone(const ControlFlags& flags, const sigset_t& signals) {
  const auto store = SqliteStore::Open(flags.state_dir + "/control.db");
  if (!store.ok()) return store.status();
  ControlMetrics metrics;
  const auto http = StartHttp(flags, metrics);
  if (!http.ok()) return http.status();
  const Pages pages{.server = **http};
  AddPages(**http, pages.gate);
  const auto reign = Reign::Begin(**store, SettingsOf(flags), metrics, pages);
  if (!reign.ok()) return reign.status();
  const GrpcServer& grpc = (*reign)->grpc();
  const GrpcDoors bound{
      .socket = grpc.socket(), .operators = grpc.operators(), .players = grpc.players(), .limits = {}};
  if (absl::Status status = AnnounceReady(flags, bound, (*reign)->https_address(), (*http)->address()); !status.ok()) {
    return status;
  }
  const Watchdog watchdog(pages.gate);
  const timespec second{.tv_sec = 1, .tv_nsec = 0};
  int received = -1;
  while ((received = sigtimedwait(&signals, nullptr, &second)) < 0) watchdog.Beat();
  sd_notify(0, "STOPPING=1");
  spdlog::info("ending signal={}", received);
  return absl::OkStatus();
}

// One of several: the store is in etcd.
absl::Status RunElected(const ControlFlags& flags, const sigset_t& signals) {
  ForwardGrpcLog();
  const auto client = ConnectStore(flags.store);
  if (!client.ok()) return client.status();
  ControlMetrics metrics;
  const auto http = StartHttp(flags, metrics);
  if (!http.ok()) return http.status();
  const Pages pages{.server = **http};
  AddPages(**http, pages.gate);
  const ReignSettings settings = SettingsOf(flags);
  Candidate candidate(**client, flags.store.etcd->prefix, flags.store.self, settings, metrics, pages);
  bool ending = false;
  const Watchdog watchdog(pages.gate);
  const auto ended = [&] {
    watchdog.Beat();
    const timespec at_once{};
    if (const int received = ending ? 0 : sigtimedwait(&signals, nullptr, &at_once); received > 0) {
      ending = true;
      sd_notify(0, "STOPPING=1");
      spdlog::info("ending signal={}", received);
    }
    return ending;
  };
  const GrpcDoors bound{.socket = "unix:" + settings.doors.socket,
                        .operators = flags.listen,
                        .players = flags.players_listen,
                        .limits = {}};
  return candidate.Run(ended, [&] { return AnnounceReady(flags, bound, flags.https.listen, (*http)->address()); });
}

// A stranger may stop a control plane through a door beyond this machine.
void WarnOfGrpcFaults(const ControlFlags& flags) {
  const std::string faults = KnownGrpcFaults(grpc::Version());
  for (const auto& [option, address] :
       {std::pair("--listen", flags.listen), std::pair("--players-listen", flags.players_listen)}) {
    const auto door = host::ParseSocketAddress(address, host::PortRule::kFrom0);
    if (faults.empty() || !door.ok() || host::IsLoopback(door->host)) continue;
    spdlog::warn(
        "{}={} is served by gRPC {}, which has known faults ({}): keep it from strangers, who may stop this "
        "program through it; players may come in by --players-https",
        option, address, grpc::Version(), faults);
  }
}

absl::Status Run(const ControlFlags& flags) {
  // Signals are blocked before any thread is made, so that all inherit it and this one alone takes them.
  const sigset_t signals = host::BlockSignals({SIGTERM, SIGINT});
  signal(SIGPIPE, SIG_IGN);
  if (sodium_init() < 0) return absl::InternalError("libsodium cannot be initialised");
  if (absl::Status status = CheckPorts(flags); !status.ok()) return status;
  if (absl::Status status = host::MakePrivateFolder(flags.state_dir); !status.ok()) {
    return absl::UnavailableError("--state-dir " + std::string(status.message()));
  }
  WarnOfGrpcFaults(flags);
  umask(077);  // the store holds instances' keys, and the socket lets in who can open it
  return flags.store.etcd ? RunElected(flags, signals) : RunAlone(flags, signals);
}

}  // namespace
}  // namespace tessera::control

int main(int argc, char** argv) {
  using namespace tessera;
  mallopt(M_ARENA_MAX, control::kArenas);
  control::ControlFlags flags;
  flags.settings.release = TESSERA_VERSION;
  CLI::App app(
      "The control plane of a Tessera cluster: places worlds on hosts, starts and watches them, lets players in.",
      "tessera-control");
  app.set_version_flag("--version", std::string("tessera-control ") + TESSERA_VERSION);
  if (const std::string refused = host::RefusedOption(argc, argv); !refused.empty()) {
    control::Fail(absl::InvalidArgumentError(refused));
    return 2;
  }
  control::AddControlOptions(app, flags);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  if (absl::Status status = telemetry::InitLogging("control", flags.log_level); !status.ok()) {
    control::Fail(status);
    return 2;
  }
  if (absl::Status status = control::CheckControlFlags(flags); !status.ok()) {
    control::Fail(status);
    return 2;
  }
  const absl::Status status = flags.restore.empty() ? control::Run(flags) : control::Restore(flags);
  return status.ok() ? 0 : control::Fail(status);
}
