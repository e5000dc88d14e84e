// A world under attack: its ticks while strangers or a player flood a region.
#include <arpa/inet.h>
#include <fmt/format.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <chrono>
#include <iostream>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "bench/flood_seat.h"
#include "bench/scrape.h"
#include "bench/statistics.h"
#include "bench/trust_scenes.h"
#include "local_cluster/connection.h"
#include "local_cluster/scene_file.h"
#include "local_cluster/world_run.h"
#include "telemetry/http_get.h"

namespace tessera::bench {
namespace {

using Clock = std::chrono::steady_clock;
using std::chrono::milliseconds;

constexpr char kTickHistogram[] = "tessera_region_step_seconds", kLateTicks[] = "tessera_region_late_ticks_total";

// A port of the loopback interface that nobody reads: what comes fills its buffer, and is dropped then.
class UnreadPort {
 public:
  UnreadPort() {
    sockaddr_in any{};
    any.sin_family = AF_INET;
    any.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    sockaddr_in bound{};
    socklen_t size = sizeof bound;
    if (bind(fd_, reinterpret_cast<const sockaddr*>(&any), sizeof any) != 0 ||
        getsockname(fd_, reinterpret_cast<sockaddr*>(&bound), &size) != 0) {
      throw local::CommandError("ticks: no port of the loopback interface is to be had");
    }
    port_ = ntohs(bound.sin_port);
  }
  ~UnreadPort() { close(fd_); }
  UnreadPort(const UnreadPort&) = delete;
  UnreadPort& operator=(const UnreadPort&) = delete;
  std::uint16_t port() const { return port_; }

 private:
  const int fd_ = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  std::uint16_t port_ = 0;
};

Samples Metrics(const std::string& address) {
  const auto page = telemetry::HttpGet(address, "/metrics");
  if (!page.ok()) throw local::CommandError("the region shows no metrics: " + std::string(page.status().message()));
  return ParseMetrics(page->body);
}

struct TickSpan {
  double p99_s = 0, neighbours_p99_s = 0;
  double late_ticks = 0;  // in both regions
  double flood_per_s = 0;
};

// The metrics of the region that is flooded, and of its neighbour.
struct TickMetrics {
  std::string flooded, neighbour;
};

TickSpan MeasureTicks(local::WorldRun& run, const TickMetrics& metrics, double seconds,
                      const std::optional<FloodSeat>& flood) {
  std::unique_ptr<RunningFlood> flooding;
  if (flood) flooding = std::make_unique<RunningFlood>(*flood);
  const auto play = [&](double span_s) {
    const auto end = Clock::now() + std::chrono::duration<double>(span_s);
    if (!run.PlayUntil([&] { return Clock::now() >= end; }, milliseconds(static_cast<int>(span_s * 1e3) + 60'000))) {
      throw local::CommandError("ticks: the world or a player ended: " + run.WhyOver());
    }
  };
  play(seconds / 4);  // the flood is at its height
  const Samples before = Metrics(metrics.flooded), neighbours_before = Metrics(metrics.neighbour);
  play(seconds);
  const Samples after = Metrics(metrics.flooded), neighbours_after = Metrics(metrics.neighbour);
  return {
      QuantileBetween(before, after, kTickHistogram, 0.99),
      QuantileBetween(neighbours_before, neighbours_after, kTickHistogram, 0.99),
      after.at(kLateTicks) - before.at(kLateTicks) + neighbours_after.at(kLateTicks) - neighbours_before.at(kLateTicks),
      flooding ? flooding->Stop() : 0};
}

}  // namespace

absl::Status RunFloodedTicks(const TrustSize& size, Report& report) {
  local::WorldRun run({.scene = local::FindScene("plaza"), .regions = 2, .bodies = size.bodies, .bots = 2});
  const v1::Instance world = run.Latest();
  const v1::RegionAddress address = world.region_status(0).report().address();
  const TickMetrics metrics{fmt::format("127.0.0.1:{}", address.metrics_port()),
                            fmt::format("127.0.0.1:{}", world.region_status(1).report().address().metrics_port())};
  const auto port = static_cast<std::uint16_t>(address.game_port());
  const UnreadPort unread;
  const std::vector<std::pair<std::string, FloodSeat>> floods = {
      {"hellos", {.kind = "hellos", .port = port, .control = "none", .instance = "none"}},
      {"elsewhere", {.kind = "hellos", .port = unread.port(), .control = "none", .instance = "none"}},
      {"overheard",
       {.kind = "overheard", .port = port, .control = run.cluster().control_address(), .instance = run.instance_id()}},
      {"player",
       {.kind = "player", .port = port, .control = run.cluster().control_address(), .instance = run.instance_id()}}};
  MeasureTicks(run, metrics, size.span_s, {});  // bodies are on their way
  for (const auto& [config, flood] : floods) {
    std::vector<double> ratios, neighbours, quiet_ms, flooded_ms, rates, late_quiet, late;
    for (std::uint32_t round = 0; round < size.rounds; ++round) {
      const TickSpan quiet = MeasureTicks(run, metrics, size.span_s, {});
      const TickSpan flooded = MeasureTicks(run, metrics, size.span_s, flood);
      quiet_ms.push_back(1e3 * quiet.p99_s);
      flooded_ms.push_back(1e3 * flooded.p99_s);
      ratios.push_back(flooded.p99_s / quiet.p99_s);
      neighbours.push_back(flooded.neighbours_p99_s / quiet.neighbours_p99_s);
      late_quiet.push_back(quiet.late_ticks);
      late.push_back(flooded.late_ticks);
      rates.push_back(flooded.flood_per_s);
    }
    report.Add("ticks", kTrustEngine, config, "tick_p99_ratio", Median(ratios), "1");
    report.Add("ticks", kTrustEngine, config, "tick_p99_ratio_highest", Quantile(ratios, 1), "1");
    report.Add("ticks", kTrustEngine, config, "tick_p99_quiet_ms", Median(quiet_ms), "ms");
    report.Add("ticks", kTrustEngine, config, "tick_p99_ms", Median(flooded_ms), "ms");
    report.Add("ticks", kTrustEngine, config, "neighbour_p99_ratio", Median(neighbours), "1");
    report.Add("ticks", kTrustEngine, config, "late_ticks_quiet", Median(late_quiet), "1");
    report.Add("ticks", kTrustEngine, config, "late_ticks", Median(late), "1");
    report.Add("ticks", kTrustEngine, config, "flood_per_s", Median(rates), "1");
    std::cerr << fmt::format("trust: ticks: {}: ratio {:.2f} at {:.0f} a second\n", config, Median(ratios),
                             Median(rates));
  }
  return absl::OkStatus();
}

}  // namespace tessera::bench
