// tessera-control: the control plane of a cluster.
#include <fmt/format.h>
#include <grpcpp/grpcpp.h>
#include <pthread.h>
#include <signal.h>
#include <sodium.h>
#include <spdlog/spdlog.h>
#include <sys/stat.h>
#include <systemd/sd-daemon.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>

#include "control_plane/backup.h"
#include "control_plane/candidate.h"
#include "control_plane/control_metrics.h"
#include "control_plane/doors.h"
#include "control_plane/etcd_restore.h"
#include "control_plane/grpc_faults.h"
#include "control_plane/grpc_server.h"
#include "control_plane/http_pages.h"
#include "control_plane/reign.h"
#include "control_plane/sqlite_store.h"
#include "control_plane/store_flags.h"
#include "host/files.h"
#include "host/renamed_options.h"
#include "host/socket_address.h"
#include "telemetry/logging.h"
#include "telemetry/metrics_server.h"
#include "telemetry/metrics_tls.h"
#include "telemetry/metrics_token.h"

namespace tessera::control {
namespace {

struct ControlFlags {
  std::string listen, players_listen, socket;
  ConnectionLimits connections;
  HttpsFlags https;
  std::string metrics_listen = "127.0.0.1:7701", metrics_token_file;
  telemetry::MetricsTlsFiles metrics_tls;
  std::string state_dir, checkpoints;
  std::string s3_endpoint, s3_region;
  std::optional<S3Settings> s3;  // where `checkpoints` names a bucket
  std::uint64_t checkpoint_reserve_mb = 256, checkpoint_quota_mb = 0, visual_quota_mb = 1000;
  StoreFlags store;
  std::string ready_file;
  std::string restore;
  std::string log_level;
  ControlSettings settings;
};

// Shorter spans take a healthy host on a busy machine for a dead one.
constexpr std::chrono::milliseconds kLeastLostAfter{1000}, kLeastFailoverAfter{500}, kLeastMoveCutAfter{1000};
constexpr std::chrono::milliseconds kLeastStartTimeout{10'000};
constexpr std::chrono::milliseconds kLongestSpan{3'600'000};

// Declares option `name`: a time in seconds, from `least` on.
void AddSpan(CLI::App& app, const std::string& name, std::chrono::milliseconds& span, std::chrono::milliseconds least,
             const std::string& about) {
  using Seconds = std::chrono::duration<double>;
  app.add_option_function<double>(
         name, [&span](double seconds) { span = std::chrono::round<std::chrono::milliseconds>(Seconds(seconds)); },
         about)
      ->check(CLI::Range(Seconds(least).count(), Seconds(kLongestSpan).count()))
      ->default_str(fmt::format("{:g}", Seconds(span).count()));
}

// Joins a second, and at once.
void AddGuestOptions(CLI::App& app, GuestLimits& guests) {
  constexpr double kMostGuestRate = 1e6;
  const auto add = [&](const std::string& name, const std::string& where, net::Rate& rate) {
    app.add_option(name, rate.per_s,
                   "joins a second of guests " + where + " at the players' doors, over a while; 0 is no limit")
        ->check(CLI::Range(0.0, kMostGuestRate))
        ->capture_default_str();
    app.add_option(name + "-burst", rate.burst, "how many of these may come at once after a rest")
        ->check(CLI::Range(1.0, kMostGuestRate))
        ->capture_default_str();
  };
  add("--guests-per-address", "from one address, of IPv6 from one /64,", guests.of_address);
  add("--guests-per-instance", "of one instance", guests.of_instance);
}

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
  return telemetry::MetricsServer::Start(parsed->host, parsed->port, metrics.registry(), *std::move(token), *tls);
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

// Tells systemd's watchdog, where the unit has one, that this process does its work. Without, systemd restarts it.
class Watchdog {
 public:
  explicit Watchdog(std::shared_ptr<PlaneGate> gate) : gate_(std::move(gate)) {
    std::uint64_t span_us = 0;
    wanted_ = sd_watchdog_enabled(0, &span_us) > 0;
  }
  // Call it about every second. One that follows has no work.
  void Beat() const {
    bool alive = true;
    if (wanted_) gate_->With([&alive](ControlPlane& plane) { alive = plane.Alive(); });
    if (wanted_ && alive) sd_notify(0, "WATCHDOG=1");
  }

 private:
  const std::shared_ptr<PlaneGate> gate_;
  bool wanted_ = false;
};

sigset_t EndSignals() {
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGTERM);
  sigaddset(&signals, SIGINT);
  return signals;
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

// Reads who asks an object store from the environment. INVALID_ARGUMENT names the option or the variable.
absl::Status CheckCheckpointFlags(ControlFlags& flags) {
  if (!IsS3Address(flags.checkpoints)) {
    if (flags.s3_endpoint.empty() && flags.s3_region.empty()) return absl::OkStatus();
    return absl::InvalidArgumentError("--s3-endpoint and --s3-region: only with --checkpoints s3://BUCKET/PREFIX");
  }
  const auto variable = [](const char* name) -> std::optional<std::string> {
    const char* value = std::getenv(name);
    if (value == nullptr) return std::nullopt;
    return value;
  };
  auto settings = MakeS3Settings(flags.checkpoints, flags.s3_endpoint, flags.s3_region, variable);
  if (!settings.ok()) return settings.status();
  flags.s3 = *std::move(settings);
  return absl::OkStatus();
}

// Bytes of the quotas, which options have in megabytes.
ControlSettings WithQuotas(const ControlFlags& flags) {
  ControlSettings settings = flags.settings;
  settings.checkpoint_quota = flags.checkpoint_quota_mb * 1'000'000;
  settings.visual_quota = flags.visual_quota_mb * 1'000'000;
  return settings;
}

ReignSettings SettingsOf(const ControlFlags& flags) {
  const std::string socket = flags.socket.empty() ? flags.state_dir + "/control.sock" : flags.socket;
  return {.doors = {.socket = std::filesystem::absolute(socket).lexically_normal().string(),
                    .operators = flags.listen,
                    .players = flags.players_listen,
                    .limits = flags.connections},
          .https = flags.https,
          .seal = flags.state_dir + "/seal.key",
          .checkpoints = flags.checkpoints.empty() ? flags.state_dir + "/checkpoints" : flags.checkpoints,
          .s3 = flags.s3,
          .checkpoint_reserve = flags.checkpoint_reserve_mb * 1'000'000,
          .store_name = flags.store.etcd ? flags.store.etcd->prefix + " in etcd" : flags.state_dir + "/control.db",
          .control = WithQuotas(flags)};
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
  const sigset_t signals = EndSignals();
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
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
  const auto is_address = [](const std::string& text) {
    return std::string(host::ParseSocketAddress(text, host::PortRule::kFrom0).status().message());  // empty: fine
  };
  app.add_option("--listen", flags.listen,
                 "address for operators and agents, HOST:PORT, gRPC over TLS; port 0 takes a free one; default none: "
                 "the socket alone")
      ->check(is_address);
  app.add_option("--players-listen", flags.players_listen,
                 "address for players, HOST:PORT, gRPC over TLS; everybody may join there; default none")
      ->check(is_address);
  app.add_option("--max-connections", flags.connections.in_all,
                 "connections that --listen, and as many that --players-listen has at once; each takes a file")
      ->check(CLI::Range(1, 1'000'000))
      ->capture_default_str();
  app.add_option("--max-connections-per-address", flags.connections.from_address,
                 "of these, from one address, of IPv6 from one /64; hosts, gateways and backends behind one address "
                 "share them")
      ->check(CLI::Range(1, 1'000'000))
      ->capture_default_str();
  app.add_option("--players-https", flags.https.listen,
                 "address for players, HOST:PORT, HTTPS with JSON; port 0 takes a free one; default none")
      ->check(is_address);
  CLI::Option* certificate = app.add_option("--players-certificate", flags.https.certificate,
                                            "PEM file with the certificate, and its chain, that --players-https shows; "
                                            "default one of the cluster's authority");
  CLI::Option* key =
      app.add_option("--players-key", flags.https.key, "PEM file with that certificate's key")->needs(certificate);
  certificate->needs(key);
  control::AddGuestOptions(app, flags.settings.guests);
  app.add_option("--socket", flags.socket,
                 "path of the socket for this user and root; default control.sock in the state folder");
  app.add_option("--metrics-listen", flags.metrics_listen,
                 "HTTP address: /metrics, /healthz, /sd/prometheus; port 0 takes a free one")
      ->check(is_address)
      ->capture_default_str();
  app.add_option("--metrics-token-file", flags.metrics_token_file,
                 "file with a token that scrapers must show; default none: whoever reaches the address may ask");
  telemetry::AddMetricsTlsOptions(app, flags.metrics_tls);
  app.add_option("--state-dir", flags.state_dir,
                 "folder of the store, the seal and checkpoints; made if it is not there")
      ->required();
  app.add_option(
      "--checkpoints", flags.checkpoints,
      "folder of the checkpoints, or s3://BUCKET/PREFIX; default checkpoints in the state folder; of several control "
      "planes one that all share");
  app.add_option("--s3-endpoint", flags.s3_endpoint,
                 "address of the object store of --checkpoints, https://HOST:PORT; default Amazon's of the region");
  app.add_option("--s3-region", flags.s3_region, "its region; default the variable AWS_REGION, else us-east-1");
  app.add_option("--checkpoint-reserve-mb", flags.checkpoint_reserve_mb,
                 "megabytes of the checkpoints' disk that are left to the store: with less free no checkpoint is made")
      ->check(CLI::Range(0, 100'000'000))
      ->capture_default_str();
  app.add_option(
         "--checkpoint-quota-mb", flags.checkpoint_quota_mb,
         "megabytes that the kept checkpoints of one world may take: the oldest go first, and one that alone is "
         "larger is not made; 0 is no limit")
      ->check(CLI::Range(0, 100'000'000))
      ->capture_default_str();
  app.add_option(
         "--visual-quota-mb", flags.visual_quota_mb,
         "megabytes of the store that files of meshes may take, which gateways draw imported levels with; 0 keeps "
         "none, and every gateway needs its own")
      ->check(CLI::Range(0, 1'000'000))
      ->capture_default_str();
  control::AddStoreOptions(app, flags.store);
  app.add_option("--restore", flags.restore,
                 "file of `tessera cluster backup`: fill the empty store from it, SQLite or etcd, and end");
  app.add_flag("--drop-set-aside", flags.settings.drop_set_aside,
               "at the start, delete the records that an earlier start has set aside since they could not be read");
  app.add_option("--ready-file", flags.ready_file, "when ready, write the bound addresses here as one line of JSON");
  control::AddSpan(app, "--lost-after", flags.settings.lost_after, control::kLeastLostAfter,
                   "seconds of silence after which a host counts as lost, at least 1");
  control::AddSpan(app, "--failover-after", flags.settings.failover_after, control::kLeastFailoverAfter,
                   "seconds of silence of a host after which others carry its regions on, at least 0.5");
  control::AddSpan(app, "--move-cut-after", flags.settings.move_cut_after, control::kLeastMoveCutAfter,
                   "seconds for which a world is DEGRADED by a cut link until one of its two regions is moved, at "
                   "least 1");
  control::AddSpan(app, "--start-timeout", flags.settings.start_timeout, control::kLeastStartTimeout,
                   "seconds that a world may take to start, or to find room again, until it is given up, at least 10");
  app.add_option("--log-level", flags.log_level,
                 "trace, debug, info, warning, error or off; else TESSERA_LOG, else info");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  if (absl::Status status = telemetry::InitLogging("control", flags.log_level); !status.ok()) {
    control::Fail(status);
    return 2;
  }
  if (absl::Status status =
          control::CheckStoreFlags(flags.store, flags.listen, flags.players_listen, flags.checkpoints);
      !status.ok()) {
    control::Fail(status);
    return 2;
  }
  if (absl::Status status = control::CheckCheckpointFlags(flags); !status.ok()) {
    control::Fail(status);
    return 2;
  }
  const absl::Status status = flags.restore.empty() ? control::Run(flags) : control::Restore(flags);
  return status.ok() ? 0 : control::Fail(status);
}
