#include <fmt/format.h>

#include <algorithm>
#include <iostream>

#include "bench/failover_growth.h"
#include "host/temporary_folder.h"
#include "local_cluster/checkpoint_file.h"
#include "local_cluster/connection.h"
#include "local_cluster/instance_watch.h"
#include "local_cluster/local_cluster.h"

namespace tessera::bench {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::chrono::seconds kRestorePatience{60};

// Makes a world of so many bodies, lets it run, and writes it to `file`; the tick that it was at.
absl::Status Save(const FailoverSize& size, const std::string& file, std::uint64_t& tick) {
  local::RunOptions options = StageOptions(size);
  options.bodies = size.restored_bodies;
  options.bots = 0;
  FailoverStage stage(options);
  if (absl::Status status = stage.PlayUntilWell(); !status.ok()) return status;
  v1::CheckpointInstanceRequest request;
  request.set_id(stage.run().instance_id());
  local::Connection& connection = stage.run().connection();
  tick = connection
             .Call("instance checkpoint", connection.instances(), &v1::InstanceService::Stub::CheckpointInstance,
                   request, std::chrono::milliseconds(kRestorePatience))
             .checkpoint()
             .tick();
  local::ExportCheckpoint(connection, stage.run().instance_id(), tick, file, kRestorePatience);
  return absl::OkStatus();
}

bool AllStep(const v1::Instance& instance, std::uint64_t after) {
  return instance.state() == v1::INSTANCE_STATE_RUNNING && !instance.region_status().empty() &&
         std::ranges::all_of(instance.region_status(), [&](const v1::RegionStatus& status) {
           return status.report().phase() == v1::WORKER_PHASE_RUNNING && status.report().tick() >= after;
         });
}

std::uint64_t OwnedIn(const v1::Instance& instance) {
  std::uint64_t owned = 0;
  for (const v1::RegionStatus& status : instance.region_status()) owned += status.report().owned();
  return owned;
}

}  // namespace

absl::Status RunRestore(const FailoverSize& size, Report& report) {
  const host::TemporaryFolder files;
  const std::string file = files.path() + "/world.tessera";
  std::uint64_t tick = 0;
  if (absl::Status status = Save(size, file, tick); !status.ok()) return status;
  std::vector<double> took_ms;
  double bodies = 0;
  for (std::uint32_t run = 0; run < std::min<std::uint32_t>(size.runs, 5); ++run) {
    std::cerr << fmt::format("failover: restore {}\n", run + 1);
    const host::TemporaryFolder folder;
    local::LocalCluster cluster({.state_dir = folder.path(), .hosts = 2, .capacity = 8});
    local::Connection connection(cluster.control_address());
    const auto begin = Clock::now();
    const std::string id = local::ImportCheckpoint(connection, file, {}).id();
    local::InstanceWatch watch(connection, id);
    if (!watch.WaitUntil([&](const v1::Instance& now) { return AllStep(now, tick); }, kRestorePatience)) {
      return absl::InternalError(fmt::format("never: restored; {}", watch.Latest().ShortDebugString()));
    }
    took_ms.push_back(std::chrono::duration<double, std::milli>(Clock::now() - begin).count());
    // It truly goes on, with all that it had.
    if (!watch.WaitUntil([&](const v1::Instance& now) { return AllStep(now, tick + 60); }, kRestorePatience)) {
      return absl::InternalError("the restored world stands still");
    }
    bodies = static_cast<double>(OwnedIn(watch.Latest()));
  }
  std::ranges::sort(took_ms);
  const auto add = [&](const char* metric, double value, const char* unit) {
    report.Add("plaza", kFailoverEngine, "restore=import", metric, value, unit);
  };
  add("runs", static_cast<double>(took_ms.size()), "1");
  add("bodies", bodies, "1");
  add("restore_ms", took_ms[(took_ms.size() - 1) / 2], "ms");
  add("restore_ms_max", took_ms.back(), "ms");
  return absl::OkStatus();
}

}  // namespace tessera::bench
