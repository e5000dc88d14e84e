// A worker is killed: how much later its bodies move again in what a viewer is sent than for an SDK client beside the
// gateway, in frames of a page. The SDK client is read 60 times a second, as a game draws.
#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <csignal>
#include <iostream>
#include <thread>

#include "bench/death_watch.h"
#include "bench/failover_stage.h"
#include "bench/people_scenes.h"
#include "bench/people_stage.h"
#include "bench/statistics.h"
#include "gateway/viewer_format.h"

namespace tessera::bench {
namespace {

constexpr std::uint32_t kGapBodies = 600;
constexpr double kBeforeKill_s = 0.3;

// A viewer that decodes what it is sent, on a thread of its own.
class WatchingViewer {
 public:
  WatchingViewer(const std::string& address, const std::string& instance, DeathWatch& watch)
      : watch_(watch), socket_(address, instance), thread_([this] { Run(); }) {}
  ~WatchingViewer() {
    stop_ = true;
    thread_.join();
  }
  bool closed() const { return closed_; }
  std::size_t frames() const { return frames_; }

 private:
  void Run() {
    while (!stop_ && !closed_) {
      socket_.Take(std::chrono::milliseconds(5));
      closed_ = socket_.closed.has_value();
      if (socket_.decoder.frames == frames_) continue;
      frames_ = socket_.decoder.frames;
      const auto now = DeathWatch::TimePoint::clock::now();
      for (const auto& [id, body] : socket_.decoder.bodies) watch_.Look(id, body.owner, body.position, now);
    }
  }

  DeathWatch& watch_;
  gateway::ViewerSocket socket_;
  std::atomic<std::size_t> frames_ = 0;
  std::atomic<bool> stop_ = false, closed_ = false;
  std::thread thread_;
};

// In the steps of a viewer, so that both take the same for a movement.
void LookAtAll(DeathWatch& watch, const client::Client& client, const std::vector<client::ShownBody>& shown,
               client::TimePoint now) {
  const auto& world = client.World();
  for (const client::ShownBody& body : shown) {
    const auto seen = world.find(body.id);
    if (seen == world.end()) continue;
    const auto steps = [](double m) { return std::llround(m * gateway::kPositionSteps_per_m); };
    const Vec3d& at = body.pose.position;
    watch.Look(body.id.value(), seen->second.region.value(), {steps(at.x), steps(at.y), steps(at.z)}, now);
  }
}

// By how many frames the viewer was later.
absl::StatusOr<double> KillOne(FailoverStage& stage, std::uint32_t kill_number, const WatchingViewer& viewer,
                               DeathWatch& by_sdk, DeathWatch& by_viewer) {
  if (absl::Status status = stage.PlayUntilWell(); !status.ok()) return status;
  if (absl::Status status = stage.PlayFor(kBeforeKill_s); !status.ok()) return status;
  const std::vector<Worker> workers = stage.Workers();
  const Worker& victim = workers[kill_number % workers.size()];
  const std::uint64_t failovers = stage.run().Latest().failovers();
  const std::set<std::uint32_t> regions{victim.region.value()};
  by_sdk.Begin(regions);
  by_viewer.Begin(regions);
  // Both have then seen whose bodies they were.
  const std::size_t frames = viewer.frames();
  if (absl::Status status = stage.PlayUntil("frames", [&] { return viewer.frames() > frames + 2; }); !status.ok()) {
    return status;
  }
  kill(victim.pid, SIGKILL);
  const absl::Status carried_on = stage.PlayUntil("carried on by others, for both", [&] {
    return viewer.closed() ||
           (stage.run().Latest().failovers() > failovers && by_sdk.most_moved_again() && by_viewer.most_moved_again());
  });
  if (!carried_on.ok()) return carried_on;
  if (viewer.closed()) return absl::InternalError("the gateway closed the viewer");
  return MedianDelaySeconds(by_sdk, by_viewer) * kPageRate_hz;
}

}  // namespace

absl::Status RunGap(const PeopleSize& size, Report& report) {
  FailoverStage stage(
      {.scene = local::FindScene("plaza"), .regions = 4, .bodies = kGapBodies, .bots = 2, .hosts = 2, .capacity = 8});
  const std::string& control = stage.run().cluster().control_address();
  const std::string& instance = stage.run().instance_id();
  const GatewayProcess gateway(control);
  DeathWatch by_sdk, by_viewer;
  const SdkViewer sdk(control, instance,
                      {.polls_a_read = 1, .on_read = [&](const auto& client, const auto& shown, auto now) {
                         LookAtAll(by_sdk, client, shown, now);
                       }});
  const WatchingViewer viewer(gateway.address(), instance, by_viewer);
  std::vector<double> frames;
  for (std::uint32_t i = 0; i < size.kills; ++i) {
    const absl::StatusOr<double> extra = KillOne(stage, i, viewer, by_sdk, by_viewer);
    if (!extra.ok()) return extra.status();
    frames.push_back(*extra);
    std::cerr << fmt::format("people: gap {} of {}: {:.2f} frames later\n", i + 1, size.kills, *extra);
  }
  const std::string config = fmt::format("bodies={}", kGapBodies);
  report.Add("gap", kPeopleEngine, config, "kills", size.kills, "1");
  report.Add("gap", kPeopleEngine, config, "extra_gap_frames", std::ranges::max(frames), "1");
  report.Add("gap", kPeopleEngine, config, "extra_gap_frames_p50", Median(frames), "1");
  report.Add("gap", kPeopleEngine, config, "extra_gap_frames_p10", Quantile(frames, 0.1), "1");
  report.Add("gap", kPeopleEngine, config, "extra_gap_frames_p90", Quantile(frames, 0.9), "1");
  return absl::OkStatus();
}

}  // namespace tessera::bench
