#include "control_plane/heap_metrics.h"

#include <malloc.h>

namespace tessera::control {

std::vector<prometheus::MetricFamily> HeapMetrics::Collect() const {
  const struct mallinfo2 heap = mallinfo2();
  prometheus::ClientMetric metric;
  metric.gauge.value = static_cast<double>(heap.uordblks + heap.hblkhd);
  return {{.name = "tessera_control_heap_bytes",
           .help = "Bytes of the heap that are in use",
           .type = prometheus::MetricType::Gauge,
           .metric = {metric}}};
}

}  // namespace tessera::control
