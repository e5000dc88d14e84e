#include "control_plane/control_flags.h"

#include <fmt/format.h>

#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <utility>

#include "control_plane/s3/s3_address.h"
#include "host/socket_address.h"

namespace tessera::control {
namespace {

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

void AddDoorOptions(CLI::App& app, ControlFlags& flags) {
  app.add_option("--listen", flags.listen,
                 "address for operators and agents, HOST:PORT, gRPC over TLS; port 0 takes a free one; default none: "
                 "the socket alone")
      ->check(host::ListenAddressFault);
  app.add_option("--players-listen", flags.players_listen,
                 "address for players, HOST:PORT, gRPC over TLS; everybody may join there; default none")
      ->check(host::ListenAddressFault);
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
      ->check(host::ListenAddressFault);
  CLI::Option* certificate = app.add_option("--players-certificate", flags.https.certificate,
                                            "PEM file with the certificate, and its chain, that --players-https shows; "
                                            "default one of the cluster's authority");
  CLI::Option* key =
      app.add_option("--players-key", flags.https.key, "PEM file with that certificate's key")->needs(certificate);
  certificate->needs(key);
  AddGuestOptions(app, flags.settings.guests);
  app.add_option("--socket", flags.socket,
                 "path of the socket for this user and root; default control.sock in the state folder");
}

void AddMetricsOptions(CLI::App& app, ControlFlags& flags) {
  app.add_option("--metrics-listen", flags.metrics_listen,
                 "HTTP address: /metrics, /healthz, /sd/prometheus; port 0 takes a free one")
      ->check(host::ListenAddressFault)
      ->capture_default_str();
  app.add_option("--metrics-token-file", flags.metrics_token_file,
                 "file with a token that scrapers must show; default none: whoever reaches the address may ask");
  telemetry::AddMetricsTlsOptions(app, flags.metrics_tls);
}

// The folders, the object store, and how much they hold.
void AddStateOptions(CLI::App& app, ControlFlags& flags) {
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
}

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

}  // namespace

void AddControlOptions(CLI::App& app, ControlFlags& flags) {
  AddDoorOptions(app, flags);
  AddMetricsOptions(app, flags);
  AddStateOptions(app, flags);
  AddStoreOptions(app, flags.store);
  app.add_option("--restore", flags.restore,
                 "file of `tessera cluster backup`: fill the empty store from it, SQLite or etcd, and end");
  app.add_flag("--drop-set-aside", flags.settings.drop_set_aside,
               "at the start, delete the records that an earlier start has set aside since they could not be read");
  app.add_option("--ready-file", flags.ready_file, "when ready, write the bound addresses here as one line of JSON");
  AddSpan(app, "--lost-after", flags.settings.lost_after, kLeastLostAfter,
          "seconds of silence after which a host counts as lost, at least 1");
  AddSpan(app, "--failover-after", flags.settings.failover_after, kLeastFailoverAfter,
          "seconds of silence of a host after which others carry its regions on, at least 0.5");
  AddSpan(app, "--move-cut-after", flags.settings.move_cut_after, kLeastMoveCutAfter,
          "seconds for which a world is DEGRADED by a cut link until one of its two regions is moved, at "
          "least 1");
  AddSpan(app, "--start-timeout", flags.settings.start_timeout, kLeastStartTimeout,
          "seconds that a world may take to start, or to find room again, until it is given up, at least 10");
  app.add_option("--log-level", flags.log_level,
                 "trace, debug, info, warning, error or off; else TESSERA_LOG, else info");
}

absl::Status CheckControlFlags(ControlFlags& flags) {
  absl::Status status = CheckStoreFlags(flags.store, flags.listen, flags.players_listen, flags.checkpoints);
  return status.ok() ? CheckCheckpointFlags(flags) : status;
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

}  // namespace tessera::control
