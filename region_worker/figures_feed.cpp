#include "region_worker/figures_feed.h"

#include <cmath>

#include "telemetry/process_metrics.h"

namespace tessera::worker {
namespace {

replication::WorkFigures WorkOf(const prometheus::Histogram& histogram) {
  const auto shown = histogram.Collect().histogram;
  return {.count = shown.sample_count, .total_ns = static_cast<std::uint64_t>(std::llround(shown.sample_sum * 1e9))};
}

}  // namespace

replication::RegionFigures FiguresOf(const region::Region& region, const WorkerMetrics& metrics, std::size_t clients) {
  const telemetry::MemoryReading memory = telemetry::ReadMemory();
  return {.tick = region.tick(),
          .owned = region.owned().size(),
          .ghosts = region.ghost_count(),
          .asleep = region.asleep_count(),
          .clients = clients,
          .step = WorkOf(metrics.step),
          .physics = WorkOf(metrics.physics),
          .prediction = WorkOf(metrics.prediction),
          .snapshot_full = WorkOf(metrics.snapshot_full),
          .snapshot_delta = WorkOf(metrics.snapshot_delta),
          .memory = {.process_virtual_bytes = memory.process_virtual_bytes,
                     .process_physical_bytes = memory.process_physical_bytes,
                     .host_virtual_usable_bytes = memory.host_virtual_available_bytes,
                     .host_virtual_total_bytes = memory.host_virtual_total_bytes,
                     .host_physical_usable_bytes = memory.host_physical_available_bytes,
                     .host_physical_total_bytes = memory.host_physical_total_bytes}};
}

void FiguresFeed::SendIfDue(const region::Region& region, GamePort& port, TimePoint now) {
  if (now < due_ || port.clients().empty()) return;
  due_ = now + kInterval;
  port.SendToAll(replication::EncodeRegionFigures(FiguresOf(region, metrics_, port.clients().size())));
}

}  // namespace tessera::worker
