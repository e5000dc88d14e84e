// tessera-control: the control plane of a cluster.
#include <fmt/format.h>
#include <pthread.h>
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
#include <optional>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "control_plane/authority.h"
#include "control_plane/backup.h"
#include "control_plane/checkpoint_files.h"
#include "control_plane/control_metrics.h"
#include "control_plane/control_plane.h"
#include "control_plane/grpc_server.h"
#include "control_plane/http_pages.h"
#include "control_plane/https_door.h"
#include "control_plane/secrets.h"
#include "control_plane/sqlite_store.h"
#include "control_plane/store.h"
#include "host/files.h"
#include "host/renamed_options.h"
#include "host/socket_address.h"
#include "telemetry/logging.h"
#include "telemetry/metrics_server.h"
#include "trust/certificate.h"

namespace tessera::control {
namespace {

struct ControlFlags {
  std::string listen, players_listen, socket;
  std::string players_https, players_certificate, players_key;  // the last two are paths
  std::string metrics_listen = "127.0.0.1:7701";
  std::string state_dir;
  std::string ready_file;
  std::string restore;
  std::string log_level;
  ControlSettings settings;
};

// A chain of a few certificates.
constexpr std::size_t kMaxCertificateFileBytes = 64 * 1024;

// Shorter spans take a healthy host on a busy machine for a dead one.
constexpr std::chrono::milliseconds kLeastLostAfter{1000}, kLeastFailoverAfter{500}, kLongestSpan{3'600'000};

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

int Fail(const absl::Status& status) {
  std::fprintf(stderr, "tessera-control: %s\n", std::string(status.message()).c_str());
  return 1;
}

absl::StatusOr<std::unique_ptr<SqliteStore>> OpenStore(const std::string& state_dir) {
  if (absl::Status status = host::MakePrivateFolder(state_dir); !status.ok()) {
    return absl::UnavailableError("--state-dir " + std::string(status.message()));
  }
  umask(077);  // the store holds instances' keys, and the socket lets in who can open it
  return SqliteStore::Open(state_dir + "/control.db");
}

// A store that never held anything beside checkpoints was emptied, or is another cluster's: a new cluster in its place
// would number its worlds from the beginning, over those that the checkpoints belong to.
absl::Status CheckBelongTogether(const Store& store, const CheckpointFiles& files, const std::string& state_dir) {
  const std::vector<std::string> instances = files.Instances();
  if (store.revision() != 0 || instances.empty()) return absl::OkStatus();
  return absl::FailedPreconditionError(
      absl::StrCat(state_dir, "/checkpoints holds checkpoints of ",
                   instances.size() == 1 ? "" : "worlds, the first of them ", instances.front(), ", but ", state_dir,
                   "/control.db is empty: put the store back, or, for a new cluster, move the checkpoints away"));
}

absl::StatusOr<std::unique_ptr<telemetry::MetricsServer>> StartHttp(const std::string& address,
                                                                    const ControlMetrics& metrics) {
  const auto parsed = host::ParseSocketAddress(address, host::PortRule::kFrom0);
  if (!parsed.ok()) return parsed.status();
  return telemetry::MetricsServer::Start(parsed->host, parsed->port, metrics.registry());
}

// Who listens on this machine alone needs none.
absl::StatusOr<std::optional<Authority>> AuthorityFor(const ControlFlags& flags, Store& store) {
  const bool https = !flags.players_https.empty() && flags.players_certificate.empty();
  if (flags.listen.empty() && flags.players_listen.empty() && !https) return std::nullopt;
  auto authority = OpenAuthority(store, flags.state_dir + "/seal.key", SystemRandomBytes);
  if (!authority.ok()) return authority.status();
  spdlog::info("authority fingerprint={}", authority->fingerprint);
  return *std::move(authority);
}

// Null: there is to be none. Its certificate is the operator's own, or one of the cluster's authority.
absl::StatusOr<std::unique_ptr<HttpsDoor>> StartHttps(const ControlFlags& flags,
                                                      const std::optional<Authority>& authority, ControlPlane& plane,
                                                      ControlMetrics& metrics) {
  if (flags.players_https.empty()) return nullptr;
  auto listen = host::ParseSocketAddress(flags.players_https, host::PortRule::kFrom0);
  if (!listen.ok()) return listen.status();
  HttpsSettings settings{.listen = *std::move(listen), .certificate = {}, .key = {}};
  if (!flags.players_certificate.empty()) {
    auto certificate = host::ReadFile(flags.players_certificate, kMaxCertificateFileBytes);
    if (!certificate.ok()) return certificate.status();
    auto key = host::ReadFile(flags.players_key, kMaxCertificateFileBytes);
    if (!key.ok()) return key.status();
    settings.certificate = *std::move(certificate);
    settings.key = *std::move(key);
  } else {
    auto own = trust::IssueServer(authority->signer, MakeSerial(SystemRandomBytes));
    if (!own.ok()) return own.status();
    settings.certificate = own->certificate + authority->signer.certificate;
    settings.key = std::move(own->key);
  }
  return HttpsDoor::Start(std::move(settings), plane, metrics);
}

absl::Status AnnounceReady(const ControlFlags& flags, const GrpcServer& grpc, const HttpsDoor* https,
                           const std::string& http_address) {
  const std::string https_address = https == nullptr ? "" : https->address();
  if (!flags.ready_file.empty()) {
    const nlohmann::json ready{{"socket", grpc.socket()},
                               {"grpc", grpc.operators()},
                               {"players", grpc.players()},
                               {"players_https", https_address},
                               {"http", http_address}};
    const std::string line = ready.dump() + "\n";
    const absl::Status status = host::WriteFile(flags.ready_file, line, host::Durability::kSurvivesProcess);
    if (!status.ok()) return absl::UnavailableError("--ready-file " + std::string(status.message()));
  }
  sd_notify(0, "READY=1");
  spdlog::info("ready socket={} grpc={} players={} players_https={} http={}", grpc.socket(), grpc.operators(),
               grpc.players(), https_address, http_address);
  return absl::OkStatus();
}

// Fills the empty store from a backup, and says what it holds. The seal of the backup's control plane must be there, or
// the doors that speak TLS could not be opened.
absl::Status Restore(const ControlFlags& flags) {
  const auto file = host::ReadFile(flags.restore, kMaxBackupBytes);
  if (!file.ok()) return absl::UnavailableError("--restore: " + std::string(file.status().message()));
  const auto store = OpenStore(flags.state_dir);
  if (!store.ok()) return store.status();
  const auto report = RestoreBackup(*file, **store);
  if (!report.ok()) return report.status();
  const std::string seal = flags.state_dir + "/seal.key";
  std::printf(
      "restored: hosts %zu, instances %zu\n%s", report->hosts, report->instances,
      std::filesystem::exists(seal) ? "" : ("put " + seal + " of the control plane before this one there\n").c_str());
  std::printf("now start tessera-control: it takes up what runs, and orders nothing before it knows\n");
  return absl::OkStatus();
}

sigset_t EndSignals() {
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGTERM);
  sigaddset(&signals, SIGINT);
  return signals;
}

absl::Status Run(const ControlFlags& flags) {
  // Signals are blocked before any thread is made, so that all inherit it and `sigwait` alone takes them.
  const sigset_t signals = EndSignals();
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  signal(SIGPIPE, SIG_IGN);
  if (sodium_init() < 0) return absl::InternalError("libsodium cannot be initialised");

  // Ports are tried first of all, so that one in use costs one line and touches nothing.
  for (const auto& [address, what] :
       {std::pair(flags.listen, "grpc"), std::pair(flags.players_listen, "players"),
        std::pair(flags.players_https, "players' https"), std::pair(flags.metrics_listen, "http")}) {
    if (address.empty()) continue;
    const auto parsed = host::ParseSocketAddress(address, host::PortRule::kFrom0);
    if (!parsed.ok()) return parsed.status();
    if (absl::Status status = host::CheckBindable(*parsed, what); !status.ok()) return status;
  }
  const auto store = OpenStore(flags.state_dir);
  if (!store.ok()) return store.status();
  auto files = CheckpointFiles::Open(flags.state_dir + "/checkpoints");
  if (!files.ok()) return files.status();
  if (absl::Status status = CheckBelongTogether(**store, **files, flags.state_dir); !status.ok()) return status;
  auto authority = AuthorityFor(flags, **store);
  if (!authority.ok()) return authority.status();
  ControlMetrics metrics;
  const Now now{std::chrono::steady_clock::now().time_since_epoch(),
                std::chrono::system_clock::now().time_since_epoch()};
  auto cluster = Cluster::Load(**store, flags.settings, SystemRandomBytes, now);
  if (!cluster.ok()) return cluster.status();
  ControlPlane plane(**store, *std::move(cluster), *std::move(files));
  const auto http = StartHttp(flags.metrics_listen, metrics);
  if (!http.ok()) return http.status();
  const std::string socket = flags.socket.empty() ? flags.state_dir + "/control.sock" : flags.socket;
  const GrpcDoors doors{.socket = std::filesystem::absolute(socket).lexically_normal().string(),
                        .operators = flags.listen,
                        .players = flags.players_listen};
  const auto https = StartHttps(flags, *authority, plane, metrics);
  if (!https.ok()) return https.status();
  const auto grpc = GrpcServer::Start(doors, *std::move(authority), plane, metrics);
  if (!grpc.ok()) return grpc.status();
  const auto summary = std::make_shared<SummaryMetrics>(
      [&plane, &metrics] {
        for (const std::chrono::nanoseconds took : plane.TakeFailovers()) metrics.ObserveFailover(took);
        return plane.Call([](Cluster& c, Now) { return Summarise(c.state()); });
      },
      [&plane] { return plane.store_revision(); });
  (*http)->AddCollectable(summary);
  AddPages(**http, plane);
  if (absl::Status status = AnnounceReady(flags, **grpc, https->get(), (*http)->address()); !status.ok()) return status;

  int received = 0;
  sigwait(&signals, &received);
  sd_notify(0, "STOPPING=1");
  spdlog::info("ending signal={}", received);
  plane.Stop();
  return absl::OkStatus();
}

}  // namespace
}  // namespace tessera::control

int main(int argc, char** argv) {
  using namespace tessera;
  control::ControlFlags flags;
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
  app.add_option("--players-https", flags.players_https,
                 "address for players, HOST:PORT, HTTPS with JSON; port 0 takes a free one; default none")
      ->check(is_address);
  CLI::Option* certificate = app.add_option("--players-certificate", flags.players_certificate,
                                            "PEM file with the certificate, and its chain, that --players-https shows; "
                                            "default one of the cluster's authority");
  CLI::Option* key =
      app.add_option("--players-key", flags.players_key, "PEM file with that certificate's key")->needs(certificate);
  certificate->needs(key);
  app.add_option("--socket", flags.socket,
                 "path of the socket for this user and root; default control.sock in the state folder");
  app.add_option("--metrics-listen", flags.metrics_listen,
                 "HTTP address: /metrics, /healthz, /sd/prometheus; port 0 takes a free one")
      ->check(is_address)
      ->capture_default_str();
  app.add_option("--state-dir", flags.state_dir, "folder of the store and checkpoints; made if it is not there")
      ->required();
  app.add_option("--restore", flags.restore, "file of `tessera cluster backup`: fill the empty store from it, and end");
  app.add_option("--ready-file", flags.ready_file, "when ready, write the bound addresses here as one line of JSON");
  control::AddSpan(app, "--lost-after", flags.settings.lost_after, control::kLeastLostAfter,
                   "seconds of silence after which a host counts as lost, at least 1");
  control::AddSpan(app, "--failover-after", flags.settings.failover_after, control::kLeastFailoverAfter,
                   "seconds of silence of a host after which others carry its regions on, at least 0.5");
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
  const absl::Status status = flags.restore.empty() ? control::Run(flags) : control::Restore(flags);
  return status.ok() ? 0 : control::Fail(status);
}
