#include "gateway/gateway_flags.h"

#include <cstdlib>
#include <utility>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "gateway/viewer_format.h"
#include "host/files.h"
#include "telemetry/metrics_token.h"
#include "trust/control_address.h"

namespace tessera::gateway {
namespace {

constexpr std::size_t kMaxTokenFileBytes = 1024;

// The control plane, the players' door, and where it listens itself.
void AddAddressOptions(CLI::App& app, GatewayFlags& flags) {
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
      ->check(host::ListenAddressFault)
      ->capture_default_str();
  app.add_option("--metrics-listen", flags.metrics_listen, "HTTP address: /metrics; port 0 takes a free one")
      ->check(host::ListenAddressFault)
      ->capture_default_str();
  app.add_option("--metrics-token-file", flags.metrics_token_file,
                 "file with a token that scrapers must show; default none: whoever reaches the address may ask");
  telemetry::AddMetricsTlsOptions(app, flags.metrics_tls);
  app.add_option("--players-door", flags.options.players_door,
                 "the players' door, HOST:PORT#FINGERPRINT (tessera-control --players-listen), where visitors play "
                 "as guests or by tickets; default --control, where they play by the gateway's token, and by tickets "
                 "if it is a socket")
      ->envname("TESSERA_PLAYERS_DOOR");
}

void AddPageOptions(CLI::App& app, GatewayFlags& flags) {
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
}

// The ways in which visitors may connect.
void AddVisitorOptions(CLI::App& app, GatewayFlags& flags) {
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
}

void AddLimitOptions(CLI::App& app, GatewayFlags& flags) {
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
      ->check(CLI::Range(kMinBudget_kbytes_per_s, kMaxBudget_kbytes_per_s))
      ->capture_default_str();
}

// Nothing: it speaks plain HTTP.
absl::StatusOr<std::optional<trust::ServerCertificate>> ReadCertificate(const GatewayFlags& flags) {
  if (flags.certificate.empty() != flags.key.empty()) {
    return absl::InvalidArgumentError("--certificate and --key are given together");
  }
  if (flags.certificate.empty()) return std::nullopt;
  auto read = trust::ReadServerCertificate({"--certificate", flags.certificate}, {"--key", flags.key});
  if (!read.ok()) return read.status();
  return *std::move(read);
}

absl::Status ReadBearerToken(const std::string& file, std::string& bearer_token) {
  if (file.empty()) {
    if (const char* token = std::getenv("TESSERA_TOKEN"); token != nullptr) bearer_token = token;
    return absl::OkStatus();
  }
  auto token = host::ReadFile(file, kMaxTokenFileBytes);
  if (!token.ok()) return absl::InvalidArgumentError(absl::StrCat("--token-file ", token.status().message()));
  absl::StripAsciiWhitespace(&*token);
  bearer_token = *std::move(token);
  return absl::OkStatus();
}

absl::Status ReadMetricsFlags(const GatewayFlags& flags, ReadFlags& read) {
  auto token = telemetry::ReadMetricsToken(flags.metrics_token_file);
  if (!token.ok()) return token.status();
  read.metrics_token = *std::move(token);
  auto tls = telemetry::ReadMetricsTls(flags.metrics_tls);
  if (!tls.ok()) return tls.status();
  read.metrics_tls = *std::move(tls);
  return absl::OkStatus();
}

}  // namespace

void AddGatewayOptions(CLI::App& app, GatewayFlags& flags) {
  AddAddressOptions(app, flags);
  AddPageOptions(app, flags);
  AddVisitorOptions(app, flags);
  AddLimitOptions(app, flags);
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
}

absl::StatusOr<ReadFlags> ReadGatewayFlags(const GatewayFlags& flags) {
  const auto listen = host::ParseSocketAddress(flags.listen, host::PortRule::kFrom0);
  const auto metrics_listen = host::ParseSocketAddress(flags.metrics_listen, host::PortRule::kFrom0);
  if (!listen.ok()) return listen.status();
  if (!metrics_listen.ok()) return metrics_listen.status();
  ReadFlags read{.listen = *listen, .metrics_listen = *metrics_listen, .options = flags.options};
  if (absl::Status status = ReadMetricsFlags(flags, read); !status.ok()) return status;
  auto certificate = ReadCertificate(flags);
  if (!certificate.ok()) return certificate.status();
  read.certificate = *std::move(certificate);
  if (flags.behind_proxy && flags.max_address_connections > 0) {
    return absl::InvalidArgumentError(
        "--max-connections-per-address: not with --behind-proxy, for all come from the proxy's address");
  }
  GatewayOptions& options = read.options;
  options.max_viewer_bytes_per_s = static_cast<double>(flags.max_viewer_kbytes) * 1000;
  options.recording_limits = {flags.recording_mb * 1'000'000, flags.recordings_mb * 1'000'000};
  if (options.control.address.empty()) options.control.address = "unix:" + trust::DefaultControlSocket();
  if (absl::Status token = ReadBearerToken(flags.token_file, options.control.credentials.bearer_token); !token.ok()) {
    return token;
  }
  options.sees_addresses = !flags.behind_proxy;
  options.takes_tokens = read.certificate.has_value() || flags.behind_proxy || host::IsLoopback(listen->host);
  if (!options.players_door.empty()) {
    const auto door = trust::ParseControlAddresses(options.players_door, host::PortRule::kFrom1);
    if (!door.ok()) return absl::InvalidArgumentError(absl::StrCat("--players-door ", door.status().message()));
  }
  return read;
}

}  // namespace tessera::gateway
