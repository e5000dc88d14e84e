#include <fmt/format.h>

#include <iostream>
#include <memory>

#include "bench/failover_growth.h"
#include "bench/thread_cpu.h"
#include "core/region/region.h"
#include "core/region/standby_copy.h"
#include "local_cluster/scene_file.h"

namespace tessera::bench {
namespace {

constexpr int kSettle = 180, kMeasured = 600;  // ticks

std::unique_ptr<region::Region> MakeRegion(const std::shared_ptr<const Scene>& scene) {
  auto made = std::make_unique<region::Region>(
      region::Config{RegionId(1), Incarnation(1), scene, *MakeGridMap(scene->ground(), 1), region::RegionSettings()});
  (void)made->Start();
  return made;
}

}  // namespace

absl::Status RunStandby(const FailoverSize& size, Report& report) {
  std::cerr << "failover: standby\n";
  const LoadedScene scene = local::LoadScene(local::FindScene("plaza"), size.bodies);
  const auto alone = MakeRegion(scene.scene), owner = MakeRegion(scene.scene);
  owner->SetStandby(true);
  region::StandbyCopy standby(owner->id(), owner->catalog());
  double alone_s = 0, owner_s = 0, standby_s = 0, bytes = 0, asleep = 0;
  for (int tick = 0; tick < kSettle + kMeasured; ++tick) {
    const double begin = ThreadCpuSeconds();
    (void)alone->Step();
    const double stepped = ThreadCpuSeconds();
    const region::StepResult result = owner->Step();
    const double logged = ThreadCpuSeconds();
    if (absl::Status status = standby.Receive(result.log); !status.ok()) return status;
    const double received = ThreadCpuSeconds();
    owner->LogAcknowledged(standby.tick());
    if (tick < kSettle) continue;
    alone_s += stepped - begin;
    owner_s += logged - stepped + (ThreadCpuSeconds() - received);
    standby_s += received - logged;
    bytes += static_cast<double>(result.log.size());
    asleep += static_cast<double>(owner->asleep_count());
  }
  const auto add = [&](const char* metric, double value, const char* unit) {
    report.Add("plaza", kFailoverEngine, "standby=on", metric, value, unit);
  };
  add("awake_bodies", static_cast<double>(owner->owned().size()) - asleep / kMeasured, "1");
  add("tick_without_copy", alone_s / kMeasured, "s");
  add("log_bytes_a_tick", bytes / kMeasured, "bytes");
  add("standby_owner_cpu_ratio", (owner_s - alone_s) / alone_s, "1");
  add("standby_standby_cpu_ratio", standby_s / alone_s, "1");
  add("standby_cpu_ratio", (owner_s - alone_s + standby_s) / alone_s, "1");
  return absl::OkStatus();
}

}  // namespace tessera::bench
