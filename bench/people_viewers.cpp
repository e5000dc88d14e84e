// CPU and bytes of viewers, against an SDK client that watches the same world beside the gateway.
//
// In each round the gateway serves in turn a viewer that sees nothing, one that sees all, and `viewers` of that kind.
// A ratio is of one round: both sides were measured in the same seconds.
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <iostream>
#include <map>
#include <nlohmann/json.hpp>
#include <thread>

#include "bench/people_scenes.h"
#include "bench/people_stage.h"

namespace tessera::bench {
namespace {

using Clock = std::chrono::steady_clock;

// Rates between two moments, a second.
struct Rates {
  double gateway_cpu = 0, sdk_cpu = 0;  // shares of a core
  double sdk_bytes = 0, viewer_bytes = 0, viewer_frames = 0;
};

class Scales {
 public:
  Scales(local::WorldRun& run, const GatewayProcess& gateway, const SdkViewer& sdk, const Viewers& viewer)
      : run_(run), gateway_(gateway), sdk_(sdk), viewer_(viewer) {}

  Rates Weigh(double seconds) {
    const auto begin = Clock::now();
    const Rates before = Read();
    std::this_thread::sleep_for(std::chrono::duration<double>(seconds));
    const Rates after = Read();
    const double took_s = std::chrono::duration<double>(Clock::now() - begin).count();
    RequireRunning(run_);
    const auto rate = [&](double Rates::*field) { return (after.*field - before.*field) / took_s; };
    return {rate(&Rates::gateway_cpu), rate(&Rates::sdk_cpu), rate(&Rates::sdk_bytes), rate(&Rates::viewer_bytes),
            rate(&Rates::viewer_frames)};
  }

 private:
  // Since the beginning.
  Rates Read() const {
    const Viewers::Tally tally = viewer_.Sum();
    return {ProcessCpuSeconds(gateway_.pid()), sdk_.cpu_s(), static_cast<double>(sdk_.Stats().bytes_in),
            static_cast<double>(tally.bytes), static_cast<double>(tally.frames)};
  }

  local::WorldRun& run_;
  const GatewayProcess& gateway_;
  const SdkViewer& sdk_;
  const Viewers& viewer_;
};

struct ViewerCosts {
  std::vector<double> sdk_cpu, unseeing, first, further, bytes, sdk_bytes, viewer_bytes, frames;

  void Add(const Rates& blind, const Rates& one, const Rates& many, double further_viewers) {
    sdk_cpu.push_back(one.sdk_cpu);
    unseeing.push_back(blind.gateway_cpu / blind.sdk_cpu);
    first.push_back(one.gateway_cpu / one.sdk_cpu - 1);
    further.push_back((many.gateway_cpu / many.sdk_cpu - one.gateway_cpu / one.sdk_cpu) / further_viewers);
    // A busy machine leaves frames out, and with them bytes: those that came are taken for as many as were asked for.
    bytes.push_back(one.viewer_bytes / one.viewer_frames * kPageRate_hz / one.sdk_bytes);
    sdk_bytes.push_back(one.sdk_bytes);
    viewer_bytes.push_back(one.viewer_bytes);
    frames.push_back(one.viewer_frames);
  }
};

// How many of the bodies that are shown move: by more than a centimetre in a tenth of a second.
std::size_t MovingBodies(const std::string& control, const std::string& instance) {
  std::map<BodyId, Vec3d> places, later;
  {
    const SdkViewer looking(control, instance,
                            {.polls_a_read = 6, .on_read = [&](const client::Client&, const auto& shown, auto) {
                               places.swap(later);
                               later.clear();
                               for (const client::ShownBody& body : shown) later[body.id] = body.pose.position;
                             }});
    std::this_thread::sleep_for(std::chrono::seconds(1));
  }
  return static_cast<std::size_t>(std::ranges::count_if(later, [&](const auto& entry) {
    const auto before = places.find(entry.first);
    return before != places.end() && Length(entry.second - before->second) > 0.01;
  }));
}

void Tell(const ViewerCosts& costs, const PeopleSize& size, Report& report) {
  const std::string config = fmt::format("bodies={}", size.bodies);
  const auto add = [&](const char* metric, const std::vector<double>& values, const char* unit) {
    AddSpread(report, "viewers", config, metric, values, unit);
  };
  report.Add("viewers", kPeopleEngine, config, "rounds", size.rounds, "1");
  add("viewer_cpu_ratio", costs.first, "1");
  add("further_viewer_cpu_ratio", costs.further, "1");
  add("gateway_without_frames_cpu_ratio", costs.unseeing, "1");
  add("sdk_client_cpu_share", costs.sdk_cpu, "1");
  add("viewer_bytes_ratio", costs.bytes, "1");
  add("sdk_client_bytes_per_s", costs.sdk_bytes, "bytes");
  add("viewer_bytes_per_s", costs.viewer_bytes, "bytes");
  add("viewer_frames_per_s", costs.frames, "1");
}

}  // namespace

absl::Status RunViewers(const PeopleSize& size, Report& report) {
  local::WorldRun run(PlazaOptions(size.bodies));
  const GatewayProcess gateway(run.cluster().control_address());
  const SdkViewer sdk(run.cluster().control_address(), run.instance_id());
  Viewers viewer(gateway.address(), run.instance_id(), 1);
  viewer.AwaitFrames();
  SettlePlaza(run);
  report.Add("viewers", kPeopleEngine, fmt::format("bodies={}", size.bodies), "moving_bodies",
             static_cast<double>(MovingBodies(run.cluster().control_address(), run.instance_id())), "1");
  Scales scales(run, gateway, sdk, viewer);
  const std::uint32_t further = size.viewers - 1;
  ViewerCosts costs;
  for (std::uint32_t round = 0; round < size.rounds; ++round) {
    viewer.Send({{"type", "view"}, {"rate_hz", 1}, {"center", {0, 1000, 0}}, {"radius_m", 0.001}});
    std::this_thread::sleep_for(std::chrono::milliseconds(200));  // that every frame before it has gone
    const Rates blind = scales.Weigh(size.span_s);
    viewer.Send({{"type", "view"}, {"rate_hz", kPageRate_hz}});
    std::this_thread::sleep_for(std::chrono::milliseconds(200));
    const Rates one = scales.Weigh(size.span_s);
    Viewers others(gateway.address(), run.instance_id(), further);
    others.AwaitFrames();
    const Rates many = scales.Weigh(size.span_s);
    if (one.viewer_frames <= 2 * blind.viewer_frames) return absl::InternalError("the viewer was not sent its frames");
    costs.Add(blind, one, many, further);
    std::cerr << fmt::format("people: viewers {} of {}: first {:.2f}, further {:.2f}, bytes {:.2f}\n", round + 1,
                             size.rounds, costs.first.back(), costs.further.back(), costs.bytes.back());
  }
  Tell(costs, size, report);
  return absl::OkStatus();
}

}  // namespace tessera::bench
