// tessera-gateway: shows worlds to people: the page, and the WebSockets that it looks through.
#include <fmt/format.h>
#include <pthread.h>
#include <signal.h>
#include <sodium.h>
#include <spdlog/spdlog.h>
#include <systemd/sd-daemon.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"

#include "gateway/gateway.h"
#include "gateway/viewer_format.h"
#include "gateway/visitor_right.h"
#include "gateway/visual_cache.h"
#include "gateway/visual_source.h"
#include "gateway/web_server.h"
#include "host/files.h"
#include "host/program_folder.h"
#include "host/renamed_options.h"
#include "host/socket_address.h"
#include "telemetry/logging.h"
#include "telemetry/metrics_server.h"
#include "telemetry/metrics_tls.h"
#include "telemetry/metrics_token.h"
#include "trust/control_address.h"

namespace tessera::gateway {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMaxTokenFileBytes = 1024, kMaxCertificateFileBytes = 256 * 1024;

struct GatewayFlags {
  std::string listen = "127.0.0.1:7710", metrics_listen = "127.0.0.1:7711";
  std::string metrics_token_file, page, visuals, visual_cache, ready_file, token_file, key_file, certificate, key,
      log_level;
  telemetry::MetricsTlsFiles metrics_tls;
  std::vector<std::string> allow_origins;
  bool behind_proxy = false;
  GatewayOptions options;
  std::size_t max_connections = 512, max_address_connections = 0;
  std::uint64_t max_viewer_kbytes = 4000, recording_mb = 1000, recordings_mb = 10'000, visual_cache_mb = 2000;
};

int Fail(const absl::Status& status) {
  std::fprintf(stderr, "tessera-gateway: %s\n", std::string(status.message()).c_str());
  return 1;
}

// Where the page is installed, or built in a source tree; empty where it is neither.
std::string FindPage() {
  const fs::path here = host::ProgramFolder();
  std::vector<fs::path> places{here / "page", here.parent_path() / "share/tessera/page"};
  for (fs::path up = here; up.has_relative_path(); up = up.parent_path()) places.push_back(up / "web/dist");
  std::error_code error;
  for (const fs::path& place : places) {
    if (fs::exists(place / "index.html", error)) return place.string();
  }
  return "";
}

absl::Status AnnounceReady(const GatewayFlags& flags, const std::string& http, const std::string& metrics) {
  if (!flags.ready_file.empty()) {
    const std::string line = nlohmann::json({{"http", http}, {"metrics", metrics}}).dump() + "\n";
    const absl::Status status = host::WriteFile(flags.ready_file, line, host::Durability::kSurvivesProcess);
    if (!status.ok()) return absl::UnavailableError("--ready-file " + std::string(status.message()));
  }
  sd_notify(0, "READY=1");
  spdlog::info("ready http={} metrics={}", http, metrics);
  return absl::OkStatus();
}

// Makes the key of this start, where one is wanted, before anybody can ask for it.
absl::Status PlaceKey(const std::string& file, const host::SocketAddress& listen, GatewayOptions& options) {
  if (file.empty()) return absl::OkStatus();
  if (absl::Status status = CheckKeyPlaces(options.control.address, listen); !status.ok()) return status;
  options.key = MakeKey();
  const absl::Status written = host::WriteFile(file, options.key + "\n", host::Durability::kSurvivesProcess);
  if (!written.ok()) return absl::UnavailableError(absl::StrCat("--key-file ", written.message()));
  return absl::OkStatus();
}

// Those that end the program, blocked from now on: the loop asks for them.
sigset_t BlockSignals() {
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGTERM);
  sigaddset(&signals, SIGINT);
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  signal(SIGPIPE, SIG_IGN);
  return signals;
}

// Nothing: it speaks plain HTTP.
absl::StatusOr<std::optional<trust::ServerCertificate>> ReadCertificate(const GatewayFlags& flags) {
  if (flags.certificate.empty() != flags.key.empty()) {
    return absl::InvalidArgumentError("--certificate and --key are given together");
  }
  if (flags.certificate.empty()) return std::nullopt;
  auto chain = host::ReadFile(flags.certificate, kMaxCertificateFileBytes);
  if (!chain.ok()) return absl::InvalidArgumentError(absl::StrCat("--certificate ", chain.status().message()));
  auto key = host::ReadFile(flags.key, kMaxCertificateFileBytes);
  if (!key.ok()) return absl::InvalidArgumentError(absl::StrCat("--key ", key.status().message()));
  return trust::ServerCertificate{.chain = *std::move(chain), .key = *std::move(key)};
}

absl::Status Run(const GatewayFlags& flags) {
  const sigset_t signals = BlockSignals();  // before any thread is made
  if (sodium_init() < 0) return absl::InternalError("libsodium cannot be initialised");

  const auto listen = host::ParseSocketAddress(flags.listen, host::PortRule::kFrom0);
  const auto metrics_listen = host::ParseSocketAddress(flags.metrics_listen, host::PortRule::kFrom0);
  if (!listen.ok()) return listen.status();
  if (!metrics_listen.ok()) return metrics_listen.status();
  const auto metrics_token = telemetry::ReadMetricsToken(flags.metrics_token_file);
  if (!metrics_token.ok()) return metrics_token.status();
  const auto metrics_tls = telemetry::ReadMetricsTls(flags.metrics_tls);
  if (!metrics_tls.ok()) return metrics_tls.status();
  const auto certificate = ReadCertificate(flags);
  if (!certificate.ok()) return certificate.status();
  if (flags.behind_proxy && flags.max_address_connections > 0) {
    return absl::InvalidArgumentError(
        "--max-connections-per-address: not with --behind-proxy, for all come from the proxy's address");
  }
  const std::string page = flags.page.empty() ? FindPage() : flags.page;
  if (page.empty()) spdlog::warn("page not found; only the API is served");
  GatewayOptions options = flags.options;
  options.max_viewer_bytes_per_s = static_cast<double>(flags.max_viewer_kbytes) * 1000;
  options.recording_limits = {flags.recording_mb * 1'000'000, flags.recordings_mb * 1'000'000};
  if (options.control.address.empty()) options.control.address = "unix:" + trust::DefaultControlSocket();
  if (!flags.token_file.empty()) {
    auto token = host::ReadFile(flags.token_file, kMaxTokenFileBytes);
    if (!token.ok()) return absl::InvalidArgumentError(absl::StrCat("--token-file ", token.status().message()));
    absl::StripAsciiWhitespace(&*token);
    options.control.credentials.bearer_token = *std::move(token);
  } else if (const char* token = std::getenv("TESSERA_TOKEN"); token != nullptr) {
    options.control.credentials.bearer_token = token;
  }
  options.takes_tokens = certificate->has_value() || flags.behind_proxy || host::IsLoopback(listen->host);
  if (!options.takes_tokens) {
    spdlog::warn("listen={} speaks plain HTTP over a network: no access token is taken there; see --certificate",
                 host::ToString(*listen));
  }
  if (!options.players_door.empty()) {
    const auto door = trust::ParseControlAddresses(options.players_door, host::PortRule::kFrom1);
    if (!door.ok()) return absl::InvalidArgumentError(absl::StrCat("--players-door ", door.status().message()));
  }
  if (absl::Status key = PlaceKey(flags.key_file, *listen, options); !key.ok()) return key;
  const auto channel = DialControl(options.control);
  if (!channel.ok())
    return absl::Status(channel.status().code(), absl::StrCat("--control ", channel.status().message()));
  if (absl::Status folder = RecordingFolder(options.recordings_dir, {}).Open(); !folder.ok()) return folder;
  GatewayMetrics metrics;
  const auto metrics_server = telemetry::MetricsServer::Start(metrics_listen->host, metrics_listen->port,
                                                              metrics.registry, *metrics_token, *metrics_tls);
  if (!metrics_server.ok()) return metrics_server.status();
  VisualCache cache(flags.visual_cache, flags.visual_cache_mb * 1'000'000);
  if (absl::Status opened = cache.Open(); !opened.ok()) return opened;
  VisualSource visuals(*channel, std::move(cache));
  const auto server =
      WebServer::Start({.listen = *listen,
                        .page = page,
                        .visuals = flags.visuals,
                        .fetch_visual = [&visuals](const std::string& sha256) { return visuals.Get(sha256); },
                        .allow_origins = flags.allow_origins,
                        .certificate = *certificate,
                        .max_connections = flags.max_connections,
                        .max_address_connections = flags.max_address_connections},
                       metrics);
  if (!server.ok()) return server.status();
  {
    Gateway gateway(options, *channel, metrics, [&server] { (*server)->Wake(); });
    (*server)->Serve(gateway);
    if (absl::Status status = AnnounceReady(flags, (*server)->address(), (*metrics_server)->address()); !status.ok()) {
      return status;
    }
    constexpr timespec kAtOnce{};
    while (sigtimedwait(&signals, nullptr, &kAtOnce) < 0) (*server)->Service();
    sd_notify(0, "STOPPING=1");
    spdlog::info("ending");
    visuals.Stop();
    gateway.LeaveAll();
    (*server)->Stop();
  }
  return absl::OkStatus();
}

}  // namespace
}  // namespace tessera::gateway

int main(int argc, char** argv) {
  using namespace tessera;
  gateway::GatewayFlags flags;
  CLI::App app("Shows the worlds of a Tessera cluster to people, in a page that it serves.", "tessera-gateway");
  app.set_version_flag("--version", std::string("tessera-gateway ") + TESSERA_VERSION);
  if (const std::string refused = host::RefusedOption(argc, argv); !refused.empty()) {
    gateway::Fail(absl::InvalidArgumentError(refused));
    return 2;
  }
  const auto is_address = [](const std::string& text) {
    return std::string(host::ParseSocketAddress(text, host::PortRule::kFrom0).status().message());  // empty: fine
  };
  app.add_option(
         "--control", flags.options.control.address,
         "the control plane: unix:PATH or HOST:PORT#FINGERPRINT; default the socket of this user's `tessera up`")
      ->envname("TESSERA_CONTROL");
  app.add_option("--token-file", flags.token_file,
                 "a file with the secret of a viewer's access token, or an operator's where visitors play without one "
                 "of their own; default TESSERA_TOKEN; not needed at a socket");
  app.add_option("--key-file", flags.key_file,
                 "a file for a key that is made at each start: who shows it gives orders by the rights of the socket; "
                 "only with --control unix:PATH and --listen at loopback");
  app.add_option("--listen", flags.listen, "HTTP address of the page and its viewers; port 0 takes a free one")
      ->check(is_address)
      ->capture_default_str();
  app.add_option("--metrics-listen", flags.metrics_listen, "HTTP address: /metrics; port 0 takes a free one")
      ->check(is_address)
      ->capture_default_str();
  app.add_option("--metrics-token-file", flags.metrics_token_file,
                 "file with a token that scrapers must show; default none: whoever reaches the address may ask");
  telemetry::AddMetricsTlsOptions(app, flags.metrics_tls);
  app.add_option("--players-door", flags.options.players_door,
                 "the players' door, HOST:PORT#FINGERPRINT (tessera-control --players-listen), where visitors play "
                 "as guests or by tickets; default --control, where they play by the gateway's token, and by tickets "
                 "if it is a socket")
      ->envname("TESSERA_PLAYERS_DOOR");
  app.add_option("--page", flags.page, "folder of the page; else the installed one, or web/dist of the source tree");
  app.add_option("--visuals", flags.visuals,
                 "folder of meshes that worlds are drawn with, <sha256>.glb, as `tessera scene import` writes them; "
                 "those that are not in it come from the control plane")
      ->check(CLI::ExistingDirectory);
  app.add_option("--visual-cache", flags.visual_cache,
                 "folder for the meshes that came from the control plane, made where it is missing; without it they "
                 "are kept in memory alone")
      ->envname("TESSERA_VISUAL_CACHE");
  app.add_option("--visual-cache-mb", flags.visual_cache_mb,
                 "most that this folder holds, megabytes: those that were not asked for longest go first")
      ->check(CLI::Range(1, 1'000'000))
      ->capture_default_str();
  app.add_option(
      "--certificate", flags.certificate,
      "a file with the certificate that it shows, PEM, and what leads to a known authority: it speaks HTTPS");
  app.add_option("--key", flags.key, "a file with that certificate's key, PEM");
  app.add_flag(
      "--behind-proxy", flags.behind_proxy,
      "a proxy in front of it speaks HTTPS: it takes access tokens, though it hears plain HTTP over a network");
  app.add_option("--allow-origin", flags.allow_origins,
                 "a further origin whose pages may connect, e.g. https://play.example; may be repeated");
  app.add_flag("--local", flags.options.workers_are_here,
               "the whole cluster runs on this machine, so an order to end a worker kills its process");
  app.add_option("--max-connections", flags.max_connections,
                 "connections at once, of pages and viewers; who comes beyond is answered by 503")
      ->check(CLI::Range(1, 100'000))
      ->capture_default_str();
  app.add_option("--max-connections-per-address", flags.max_address_connections,
                 "connections at once of one IP address, beyond which it is answered by 429; 0: as many as all. Not "
                 "behind a proxy, whose address is that of everybody")
      ->check(CLI::Range(0, 100'000))
      ->capture_default_str();
  app.add_option("--max-viewers", flags.options.max_viewers, "viewers at once")
      ->check(CLI::Range(1, 10'000))
      ->capture_default_str();
  app.add_option("--max-players", flags.options.max_players, "viewers at once that play")
      ->check(CLI::Range(0, 1'000))
      ->capture_default_str();
  app.add_option("--max-viewer-kbytes", flags.max_viewer_kbytes,
                 "most of frames and values that one viewer is sent a second, kilobytes; bodies that are near and fast "
                 "come first")
      ->check(CLI::Range(gateway::kMinBudget_kbytes_per_s, gateway::kMaxBudget_kbytes_per_s))
      ->capture_default_str();
  app.add_option(
      "--recordings-dir", flags.options.recordings_dir,
      "folder of recordings, made where it is missing: those that viewers order are written there, and all in "
      "it can be played; without it there are none");
  app.add_option("--recording-mb", flags.recording_mb, "largest size of one recording, megabytes")
      ->check(CLI::Range(1, 1'000'000))
      ->capture_default_str();
  app.add_option("--recordings-mb", flags.recordings_mb,
                 "largest size of all in the folder; beyond it none is begun, megabytes")
      ->check(CLI::Range(1, 100'000'000))
      ->capture_default_str();
  app.add_option("--ready-file", flags.ready_file, "when ready, write the bound addresses here as one line of JSON");
  app.add_option("--log-level", flags.log_level,
                 "trace, debug, info, warning, error or off; else TESSERA_LOG, else info");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  if (absl::Status status = telemetry::InitLogging("gateway", flags.log_level); !status.ok()) {
    gateway::Fail(status);
    return 2;
  }
  const absl::Status status = gateway::Run(flags);
  return status.ok() ? 0 : gateway::Fail(status);
}
