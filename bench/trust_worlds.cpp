// A world under attack: its ticks while strangers or a player flood a region, and a host that is evicted.
#include <fmt/format.h>

#include <atomic>
#include <chrono>
#include <functional>
#include <iostream>
#include <memory>
#include <thread>
#include <vector>

#include "bench/failover_stage.h"
#include "bench/scrape.h"
#include "bench/statistics.h"
#include "bench/trust_scenes.h"
#include "client_sdk/control_session.h"
#include "local_cluster/connection.h"
#include "local_cluster/scene_file.h"
#include "local_cluster/world_run.h"
#include "net/endpoint.h"
#include "net/testing/spoofed_flood.h"
#include "telemetry/http_get.h"

namespace tessera::bench {
namespace {

using Clock = std::chrono::steady_clock;
using std::chrono::milliseconds;

constexpr double kHellosPerSecond = 100'000;
constexpr std::size_t kStrangersAddresses = 256;
constexpr char kTickHistogram[] = "tessera_region_step_seconds", kLateTicks[] = "tessera_region_late_ticks_total";

// Runs until it is destroyed; `per_second` is then how many datagrams went out.
class TickFlood {
 public:
  using Run = std::function<std::uint64_t(const std::atomic<bool>& stopped)>;  // datagrams sent
  explicit TickFlood(Run run)
      : begin_(Clock::now()), thread_([this, run = std::move(run)] { sent_ = run(stopped_); }) {}
  ~TickFlood() { Stop(); }
  TickFlood(const TickFlood&) = delete;
  TickFlood& operator=(const TickFlood&) = delete;
  double Stop() {
    stopped_ = true;
    if (thread_.joinable()) {
      thread_.join();
      per_second_ = static_cast<double>(sent_) / std::chrono::duration<double>(Clock::now() - begin_).count();
    }
    return per_second_;
  }

 private:
  const Clock::time_point begin_;
  std::atomic<bool> stopped_ = false;
  std::uint64_t sent_ = 0;
  double per_second_ = 0;
  std::thread thread_;
};

std::uint64_t FloodWithHellos(std::uint16_t port, const std::atomic<bool>& stopped) {
  net::SpoofedFlood flood(kStrangersAddresses);
  const auto begin = Clock::now();
  for (std::uint32_t sent = 0; !stopped;) {
    const double passed_s = std::chrono::duration<double>(Clock::now() - begin).count();
    for (const auto due = static_cast<std::uint32_t>(passed_s * kHellosPerSecond); sent < due && !stopped; ++sent) {
      flood.Send(port, net::BlindHello(sent));
    }
    flood.Drain();
    std::this_thread::sleep_for(milliseconds(1));
  }
  return flood.datagrams();
}

// A player joins, connects to the first region, and sends what is no input as fast as it can. Thrown out, it ends, and
// another one takes its place.
std::uint64_t FloodAsPlayer(const std::string& control, const std::string& instance, const std::atomic<bool>& stopped) {
  std::uint64_t sent = 0;
  const std::vector<std::uint8_t> junk(100, 0x55);
  while (!stopped) {
    client::JoinCall call{.instance_id = instance, .player_name = "flood", .ticket = {}, .returning = {}};
    call.deadline = milliseconds(10'000);
    const auto session = client::JoinInstance(control, call);
    auto endpoint = net::Endpoint::Create({.bind_address = "127.0.0.1", .max_peers = 2});
    if (!session.ok() || !endpoint.ok()) break;
    const client::RegionEndpoint& region = session->regions.front();
    const auto peer =
        (*endpoint)->Connect(region.host, region.port, region.region, region.incarnation, session->credentials);
    if (!peer.ok()) break;
    bool connected = false, ended = false;
    while (!stopped && !ended) {
      for (const net::Event& event : (*endpoint)->Service(milliseconds(connected ? 0 : 5))) {
        connected |= event.kind == net::Event::Kind::kConnected;
        ended |= event.kind == net::Event::Kind::kDisconnected;
      }
      for (int i = 0; connected && !ended && i < 256; ++i) {
        sent += (*endpoint)->Send(*peer, net::Delivery::kUnsequenced, junk).ok() ? 1 : 0;
      }
      (*endpoint)->Flush();
    }
    (void)client::LeaveInstance(control, instance, session->credentials, milliseconds(5000));
  }
  return sent;
}

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

TickSpan MeasureTicks(local::WorldRun& run, const TickMetrics& metrics, double seconds, const TickFlood::Run& flood) {
  std::unique_ptr<TickFlood> flooding;
  if (flood) flooding = std::make_unique<TickFlood>(flood);
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
  const std::string control = run.cluster().control_address(), instance = run.instance_id();
  const auto port = static_cast<std::uint16_t>(address.game_port());
  const std::vector<std::pair<std::string, TickFlood::Run>> floods = {
      {"hellos", [port](const std::atomic<bool>& stopped) { return FloodWithHellos(port, stopped); }},
      {"player", [&](const std::atomic<bool>& stopped) { return FloodAsPlayer(control, instance, stopped); }}};
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

absl::Status RunEvictions(const TrustSize& size, Report& report) {
  FailoverOutcome outcome;
  std::vector<double> seconds;
  for (std::uint32_t i = 0; i < size.evictions; ++i) {
    const FailoverSize world{
        .runs = 1, .bodies = size.bodies, .bots = 4, .control_away_s = 0, .scale_rounds = 0, .restored_bodies = 0};
    local::RunOptions options = StageOptions(world);
    options.regions = size.regions;
    options.capacity = size.regions;
    FailoverStage stage(options);
    if (absl::Status status = stage.PlayUntilWell(); !status.ok()) return status;
    const std::vector<Worker> victims = stage.WorkersOn(0);
    v1::RemoveHostRequest request;
    request.set_name("local-1");
    request.set_force(true);
    const auto begin = Clock::now();
    stage.run().connection().Call("host remove", stage.run().connection().hosts(), &v1::HostService::Stub::RemoveHost,
                                  request);
    const absl::Status carried_on = stage.PlayUntil("carried on without the evicted host", [&] {
      const v1::Instance latest = stage.run().Latest();
      return latest.state() == v1::INSTANCE_STATE_RUNNING && latest.failovers() > 0 && stage.WorkersOn(0).empty();
    });
    if (!carried_on.ok()) return carried_on;
    seconds.push_back(std::chrono::duration<double>(Clock::now() - begin).count());
    outcome.runs += 1;
    if (absl::Status status = stage.PlayOn(); !status.ok()) return status;
    stage.TakeCensus(outcome);
    std::cerr << fmt::format("trust: evict: {} of {} regions, {:.2f} s\n", victims.size(), size.regions,
                             seconds.back());
  }
  const std::string config = fmt::format("regions={}", size.regions);
  report.Add("evict", kTrustEngine, config, "evictions", outcome.runs, "1");
  report.Add("evict", kTrustEngine, config, "evict_dropped", outcome.clients_dropped, "1");
  report.Add("evict", kTrustEngine, config, "evict_lost", outcome.lost, "1");
  report.Add("evict", kTrustEngine, config, "evict_duplicated", outcome.duplicated, "1");
  report.Add("evict", kTrustEngine, config, "evict_seconds", Quantile(seconds, 1), "s");
  return absl::OkStatus();
}

}  // namespace tessera::bench
