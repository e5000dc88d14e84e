// A world that fills up: what a join takes while it is empty, and when ten thousand play.
#include <fmt/format.h>

#include <atomic>
#include <chrono>
#include <iostream>
#include <mutex>
#include <thread>
#include <vector>

#include "bench/statistics.h"
#include "bench/trust_scenes.h"
#include "bench/trust_stage.h"
#include "client_sdk/control_session.h"
#include "local_cluster/command_error.h"

namespace tessera::bench {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::uint32_t kFillThreads = 16;

// Guests join from threads of their own until `players` have.
class WorldFilling {
 public:
  WorldFilling(std::string control, std::string instance)
      : control_(std::move(control)), instance_(std::move(instance)) {}

  // How long each of the next `players` took, s.
  std::vector<double> Join(std::uint32_t players) {
    std::atomic<std::uint32_t> next = 0;
    std::vector<double> took_s;
    std::string failure;
    std::mutex mutex;
    std::vector<std::thread> threads;
    for (std::uint32_t i = 0; i < kFillThreads; ++i) {
      threads.emplace_back([&] {
        while (next++ < players) {
          const auto begin = Clock::now();
          const auto session = client::JoinInstance(control_, Call());
          const double seconds = std::chrono::duration<double>(Clock::now() - begin).count();
          const std::lock_guard lock(mutex);
          if (session.ok()) took_s.push_back(seconds);
          if (!session.ok()) failure = std::string(session.status().message());
          if (!failure.empty()) return;
        }
      });
    }
    for (std::thread& thread : threads) thread.join();
    if (!failure.empty()) throw local::CommandError(fmt::format("full: after {} joins: {}", took_s.size(), failure));
    return took_s;
  }
  // Why nobody more is let in; empty: somebody was.
  std::string Refusal() { return std::string(client::JoinInstance(control_, Call()).status().message()); }

 private:
  client::JoinCall Call() const {
    client::JoinCall call{.instance_id = instance_, .player_name = "guest", .ticket = {}, .returning = {}};
    call.deadline = std::chrono::milliseconds(60'000);
    return call;
  }

  std::string control_, instance_;
};

void ReportJoins(const std::string& config, const std::vector<double>& took_s, double seconds, Report& report) {
  report.Add("full", kTrustEngine, config, "join_ms_p50", 1e3 * Median(took_s), "ms");
  report.Add("full", kTrustEngine, config, "join_ms_p99", 1e3 * Quantile(took_s, 0.99), "ms");
  report.Add("full", kTrustEngine, config, "joins_per_s", static_cast<double>(took_s.size()) / seconds, "1");
  std::cerr << fmt::format("trust: full: {}: {:.0f} joins a second, {:.0f} ms p50, {:.0f} ms p99\n", config,
                           static_cast<double>(took_s.size()) / seconds, 1e3 * Median(took_s),
                           1e3 * Quantile(took_s, 0.99));
}

}  // namespace

absl::Status RunFull(const TrustSize& size, Report& report) {
  TrustStage stage;
  const std::string world = stage.CreateWorldFor(size.full_players);
  WorldFilling filling(stage.target().socket, world);
  const double before_mb = stage.ControlMegabytes();
  const std::uint32_t part = std::max(1U, size.full_players / 20);
  const auto begin = Clock::now();
  const auto join = [&](const std::string& config, std::uint32_t players) {
    const auto start = Clock::now();
    const std::vector<double> took_s = filling.Join(players);
    ReportJoins(config, took_s, std::chrono::duration<double>(Clock::now() - start).count(), report);
  };
  join("first", part);
  join("between", size.full_players - 2 * part);
  join("last", part);
  const double filled_s = std::chrono::duration<double>(Clock::now() - begin).count();
  const std::string refusal = filling.Refusal();
  if (refusal.find("is full") == std::string::npos) {
    return absl::InternalError(
        fmt::format("one more than {} is not refused as it should: \"{}\"", size.full_players, refusal));
  }
  const v1::Instance now = stage.World(world);
  const std::string config = fmt::format("players={}", size.full_players);
  report.Add("full", kTrustEngine, config, "players", now.players(), "1");
  report.Add("full", kTrustEngine, config, "filled_s", filled_s, "s");
  report.Add("full", kTrustEngine, config, "control_memory_mb", stage.ControlMegabytes() - before_mb, "MB");
  double p99_s = 0;
  for (const v1::RegionStatus& region : now.region_status())
    p99_s = std::max(p99_s, region.report().step().p99_seconds());
  report.Add("full", kTrustEngine, config, "tick_ms_p99", 1e3 * p99_s, "ms");
  if (now.state() == v1::INSTANCE_STATE_RUNNING) return absl::OkStatus();
  return absl::InternalError(fmt::format("full: the world is no more RUNNING: {}", now.reason()));
}

}  // namespace tessera::bench
