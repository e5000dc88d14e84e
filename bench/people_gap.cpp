// A worker is killed: how much later its bodies move again on a page in a headless Chromium, and in what a viewer is
// sent, than for an SDK client beside the gateway, in frames of a page. The SDK client is read 60 times a second, as a
// game draws.
#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <csignal>
#include <iostream>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <thread>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "bench/death_watch.h"
#include "bench/failover_stage.h"
#include "bench/people_node.h"
#include "bench/people_scenes.h"
#include "bench/people_stage.h"
#include "bench/statistics.h"
#include "gateway/viewer_format.h"
#include "host/files.h"
#include "host/last_lines.h"
#include "local_cluster/command_error.h"
#include "telemetry/http_get.h"

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

// A page in a browser, by web/testing/gap_page.ts, which looks at each of its pictures. CommandError if it fails.
// Thread rule: one thread.
class WatchedPage {
 public:
  WatchedPage(const std::string& address, const std::string& instance)
      : node_(StartNode({Bundled("gap_page.mjs"), absl::StrCat("http://", address, "/#", instance), ready_}, log_)) {
    if (!node_.WaitForFile(ready_, kPageBegins)) {
      throw local::CommandError("gap_page.mjs did not begin" + host::LastLinesText(log_, 8));
    }
    address_ = local::OrThrow(host::ReadFile(ready_, 256));
  }

  // Once it has shown whose bodies they are.
  void Begin(const std::set<std::uint32_t>& regions, DeathWatch& watch) {
    Ask(absl::StrCat("/begin?regions=", absl::StrJoin(regions, ",")));
    dead_ = *regions.begin();
    watch.Begin(regions);
    enough_ = false;
  }
  // Adds what it has seen since. Asked for less often than the stage turns, for it is the page's own thread that
  // answers.
  void Look(DeathWatch& watch) {
    const auto now = Clock::now();
    if (now < next_look_) return;
    next_look_ = now + kLookEvery;
    const nlohmann::json seen = Ask("/moved");
    if (!seen.at("complaints").empty()) throw local::CommandError("the page complained: " + seen.dump());
    const std::size_t moved = seen.at("moved").size();
    enough_ = 2 * moved > seen.at("watched").get<std::size_t>();
    longest_wait_ms_ = seen.at("longest").at("wait_ms");
    longest_script_ms_ = seen.at("longest").at("script_ms");
    if (!enough_) return;
    // Both clocks are of this machine.
    const auto ahead = std::chrono::system_clock::now().time_since_epoch() - Clock::now().time_since_epoch();
    for (const auto& [id, at_ms] : seen.at("moved").items()) {
      const std::chrono::duration<double, std::milli> since_1970(at_ms.get<double>());
      const std::uint64_t body = std::stoull(id);
      watch.Look(body, dead_, {}, now);
      watch.Look(body, kSomebodyElse, {1, 0, 0},
                 Clock::time_point(std::chrono::duration_cast<Clock::duration>(since_1970 - ahead)));
    }
  }
  bool most_moved_again() const { return enough_; }
  // Since it began: from one picture to the next, and of that by the page's own script.
  double longest_wait_ms() const { return longest_wait_ms_; }
  double longest_script_ms() const { return longest_script_ms_; }

 private:
  using Clock = std::chrono::steady_clock;
  static constexpr std::uint32_t kSomebodyElse = 0;  // no region's number
  static constexpr std::chrono::seconds kPageBegins{90};
  static constexpr std::chrono::milliseconds kLookEvery{200};

  nlohmann::json Ask(const std::string& path) const {
    const telemetry::HttpAnswer answer = local::OrThrow(telemetry::HttpGet(address_, path));
    if (answer.status != 200) throw local::CommandError("gap_page.mjs " + path + ": " + answer.body);
    return nlohmann::json::parse(answer.body);
  }

  const host::TemporaryFolder folder_;
  const std::string ready_ = folder_.path() + "/ready", log_ = folder_.path() + "/log";
  host::ChildProcess node_;
  std::string address_;
  std::uint32_t dead_ = 0;
  bool enough_ = false;
  double longest_wait_ms_ = 0, longest_script_ms_ = 0;
  Clock::time_point next_look_{};
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

// By how many frames a page and a viewer were later.
struct ExtraGap {
  double page = 0, viewer = 0;
};

// All who look.
struct Onlookers {
  const WatchingViewer& viewer;
  WatchedPage& page;
  DeathWatch &by_sdk, &by_viewer;
};

absl::StatusOr<ExtraGap> KillOne(FailoverStage& stage, std::uint32_t kill_number, const Onlookers& looking) {
  const WatchingViewer& viewer = looking.viewer;
  WatchedPage& page = looking.page;
  DeathWatch &by_sdk = looking.by_sdk, &by_viewer = looking.by_viewer;
  DeathWatch by_page;
  if (absl::Status status = stage.PlayUntilWell(); !status.ok()) return status;
  if (absl::Status status = stage.PlayFor(kBeforeKill_s); !status.ok()) return status;
  const std::vector<Worker> workers = stage.Workers();
  const Worker& victim = workers[kill_number % workers.size()];
  const std::uint64_t failovers = stage.run().Latest().failovers();
  const std::set<std::uint32_t> regions{victim.region.value()};
  by_sdk.Begin(regions);
  by_viewer.Begin(regions);
  page.Begin(regions, by_page);
  // All have then seen whose bodies they were.
  const std::size_t frames = viewer.frames();
  if (absl::Status status = stage.PlayUntil("frames", [&] { return viewer.frames() > frames + 2; }); !status.ok()) {
    return status;
  }
  kill(victim.pid, SIGKILL);
  const absl::Status carried_on = stage.PlayUntil("carried on by others, for all", [&] {
    if (viewer.closed()) return true;
    if (stage.run().Latest().failovers() == failovers) return false;
    page.Look(by_page);
    return by_sdk.most_moved_again() && by_viewer.most_moved_again() && page.most_moved_again();
  });
  if (!carried_on.ok()) return carried_on;
  if (viewer.closed()) return absl::InternalError("the gateway closed the viewer");
  return ExtraGap{.page = MedianDelaySeconds(by_sdk, by_page) * kPageRate_hz,
                  .viewer = MedianDelaySeconds(by_sdk, by_viewer) * kPageRate_hz};
}

}  // namespace

absl::Status RunGap(const PeopleSize& size, Report& report) {
  BundlePrograms();
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
  WatchedPage page(gateway.address(), instance);
  const Onlookers looking{.viewer = viewer, .page = page, .by_sdk = by_sdk, .by_viewer = by_viewer};
  std::vector<double> on_page, on_socket;
  for (std::uint32_t i = 0; i < size.kills; ++i) {
    const absl::StatusOr<ExtraGap> extra = KillOne(stage, i, looking);
    if (!extra.ok()) return extra.status();
    on_page.push_back(extra->page);
    on_socket.push_back(extra->viewer);
    std::cerr << fmt::format(
        "people: gap {} of {}: {:.2f} frames later on the page, {:.2f} on its socket; longest from picture to picture "
        "{:.0f} ms, {:.0f} ms of script\n",
        i + 1, size.kills, extra->page, extra->viewer, page.longest_wait_ms(), page.longest_script_ms());
  }
  const std::string config = fmt::format("bodies={}", kGapBodies);
  report.Add("gap", kPeopleEngine, config, "kills", size.kills, "1");
  const auto add = [&](const std::string& metric, const std::vector<double>& frames) {
    report.Add("gap", kPeopleEngine, config, metric, std::ranges::max(frames), "1");
    report.Add("gap", kPeopleEngine, config, metric + "_p50", Median(frames), "1");
    report.Add("gap", kPeopleEngine, config, metric + "_p10", Quantile(frames, 0.1), "1");
    report.Add("gap", kPeopleEngine, config, metric + "_p90", Quantile(frames, 0.9), "1");
  };
  add("extra_gap_frames", on_page);
  add("extra_socket_gap_frames", on_socket);
  return absl::OkStatus();
}

}  // namespace tessera::bench
