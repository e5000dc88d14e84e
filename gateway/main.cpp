// tessera-gateway: shows worlds to people: the page, and the WebSockets that it looks through.
#include <signal.h>
#include <sodium.h>
#include <spdlog/spdlog.h>
#include <systemd/sd-daemon.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "gateway/gateway.h"
#include "gateway/gateway_flags.h"
#include "gateway/visitor_right.h"
#include "gateway/visual_cache.h"
#include "gateway/visual_source.h"
#include "gateway/web_server.h"
#include "host/end_signals.h"
#include "host/files.h"
#include "host/program_folder.h"
#include "host/renamed_options.h"
#include "host/socket_address.h"
#include "telemetry/logging.h"
#include "telemetry/metrics_server.h"

namespace tessera::gateway {
namespace {

namespace fs = std::filesystem;

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

absl::Status Run(const GatewayFlags& flags) {
  // Before any thread is made; the loop asks for them.
  const sigset_t signals = host::BlockSignals({SIGTERM, SIGINT});
  signal(SIGPIPE, SIG_IGN);
  if (sodium_init() < 0) return absl::InternalError("libsodium cannot be initialised");

  auto read = ReadGatewayFlags(flags);
  if (!read.ok()) return read.status();
  const host::SocketAddress& listen = read->listen;
  GatewayOptions& options = read->options;
  const std::string page = flags.page.empty() ? FindPage() : flags.page;
  if (page.empty()) spdlog::warn("page not found; only the API is served");
  if (!options.takes_tokens) {
    spdlog::warn("listen={} speaks plain HTTP over a network: no access token is taken there; see --certificate",
                 host::ToString(listen));
  }
  if (absl::Status key = PlaceKey(flags.key_file, listen, options); !key.ok()) return key;
  const auto channel = DialControl(options.control);
  if (!channel.ok())
    return absl::Status(channel.status().code(), absl::StrCat("--control ", channel.status().message()));
  if (absl::Status folder = RecordingFolder(options.recordings_dir, {}).Open(); !folder.ok()) return folder;
  GatewayMetrics metrics;
  const auto metrics_server = telemetry::MetricsServer::Start(read->metrics_listen.host, read->metrics_listen.port,
                                                              metrics.registry, read->metrics_token, read->metrics_tls);
  if (!metrics_server.ok()) return metrics_server.status();
  VisualCache cache(flags.visual_cache, flags.visual_cache_mb * 1'000'000);
  if (absl::Status opened = cache.Open(); !opened.ok()) return opened;
  VisualSource visuals(*channel, std::move(cache));
  const auto server =
      WebServer::Start({.listen = listen,
                        .page = page,
                        .visuals = flags.visuals,
                        .fetch_visual = [&visuals](const std::string& sha256) { return visuals.Get(sha256); },
                        .allow_origins = flags.allow_origins,
                        .certificate = read->certificate,
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
  gateway::AddGatewayOptions(app, flags);
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
