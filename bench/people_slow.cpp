// Viewers that read at a tenth of the rate: what becomes of the gateway's memory and of another viewer's delay.
//
// Each round: the other viewer alone; then with many that read everything, from which the memory counts; then those
// read a tenth.
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <iostream>
#include <thread>

#include "bench/people_scenes.h"
#include "bench/people_stage.h"

namespace tessera::bench {
namespace {

using Clock = std::chrono::steady_clock;

constexpr double kShareThatIsRead = 0.1;
// So that what is not read is soon the gateway's matter, and not the kernel's.
constexpr int kSlowBuffer_bytes = 32768;
constexpr std::chrono::milliseconds kMemoryLook{250};

// The mean delay of the viewer's frames in that time, s. `meanwhile` is done again and again.
double DelayOver(double seconds, const Viewers& viewer, const std::function<void()>& meanwhile) {
  const Viewers::Tally before = viewer.Sum();
  for (const auto end = Clock::now() + std::chrono::duration<double>(seconds); Clock::now() < end;) {
    std::this_thread::sleep_for(kMemoryLook);
    meanwhile();
  }
  const Viewers::Tally after = viewer.Sum();
  return (after.delay_sum_s - before.delay_sum_s) /
         static_cast<double>(std::max<std::uint64_t>(1, after.frames - before.frames));
}

struct SlowOutcome {
  std::vector<double> memory, grown_bytes, delay, hop, alone_ms, beside_ms, read_share;
};

void SlowRound(const PeopleSize& size, local::WorldRun& run, const GatewayProcess& gateway, const SdkViewer& sdk,
               const Viewers& viewer, SlowOutcome& outcome) {
  const double alone_s = DelayOver(size.slow_span_s, viewer, [] {});
  Viewers slow(gateway.address(), run.instance_id(), size.slow_viewers, kSlowBuffer_bytes);
  slow.AwaitFrames();
  const std::uint64_t before = slow.Sum().bytes;
  const double reading_s = size.slow_span_s / 2;
  std::this_thread::sleep_for(std::chrono::duration<double>(reading_s));
  const double rate = static_cast<double>(slow.Sum().bytes - before) / reading_s / size.slow_viewers;
  const double resident = ResidentBytes(gateway.pid());
  slow.ReadAtMost(kShareThatIsRead * rate);
  const std::uint64_t slow_from = slow.Sum().bytes;
  double highest = 0;
  const double beside_s =
      DelayOver(size.slow_span_s, viewer, [&] { highest = std::max(highest, ResidentBytes(gateway.pid())); });
  const double read = static_cast<double>(slow.Sum().bytes - slow_from) / size.slow_span_s / size.slow_viewers;
  // People see the world as far behind as the client in the gateway shows it, and then the way to them.
  const double behind_s = sdk.Stats().snapshot_delay_s;
  RequireRunning(run);
  outcome.memory.push_back(highest / resident);
  outcome.grown_bytes.push_back(highest - resident);
  outcome.delay.push_back((beside_s + behind_s) / (alone_s + behind_s));
  outcome.hop.push_back(beside_s / alone_s);
  outcome.alone_ms.push_back(1e3 * alone_s);
  outcome.beside_ms.push_back(1e3 * beside_s);
  outcome.read_share.push_back(read / rate);
}

}  // namespace

absl::Status RunSlowViewers(const PeopleSize& size, Report& report) {
  local::WorldRun run(PlazaOptions(size.bodies));
  const GatewayProcess gateway(run.cluster().control_address());
  const SdkViewer sdk(run.cluster().control_address(), run.instance_id());
  Viewers viewer(gateway.address(), run.instance_id(), 1);
  viewer.AwaitFrames();
  SettlePlaza(run);
  SlowOutcome outcome;
  for (std::uint32_t round = 0; round < size.slow_rounds; ++round) {
    SlowRound(size, run, gateway, sdk, viewer, outcome);
    std::cerr << fmt::format("people: slow {} of {}: memory {:.3f}, delay {:.3f} ({:.1f} ms, alone {:.1f})\n",
                             round + 1, size.slow_rounds, outcome.memory.back(), outcome.delay.back(),
                             outcome.beside_ms.back(), outcome.alone_ms.back());
  }
  const std::string config = fmt::format("bodies={} slow={}", size.bodies, size.slow_viewers);
  report.Add("slow", kPeopleEngine, config, "rounds", size.slow_rounds, "1");
  AddSpread(report, "slow", config, "slow_viewer_memory_ratio", outcome.memory, "1");
  AddSpread(report, "slow", config, "slow_viewer_memory_grown", outcome.grown_bytes, "bytes");
  AddSpread(report, "slow", config, "slow_viewer_delay_ratio", outcome.delay, "1");
  AddSpread(report, "slow", config, "gateway_delay_ratio", outcome.hop, "1");
  AddSpread(report, "slow", config, "gateway_delay_alone_ms", outcome.alone_ms, "ms");
  AddSpread(report, "slow", config, "gateway_delay_beside_slow_ms", outcome.beside_ms, "ms");
  AddSpread(report, "slow", config, "slow_viewers_read_share", outcome.read_share, "1");
  return absl::OkStatus();
}

}  // namespace tessera::bench
