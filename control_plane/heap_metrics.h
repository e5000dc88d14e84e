// HeapMetrics: the bytes that this process holds of the heap, asked for when somebody asks.
//
//   auto heap = std::make_shared<HeapMetrics>();
//   server->AddCollectable(heap);     // tessera_control_heap_bytes
//
// Bytes of malloc that are in use, with its own words around them, in all arenas; what each thread keeps to use again
// is among them, and pages that malloc keeps free are not. A sanitizer brings a malloc of its own, whose bytes are not
// counted. Thread rule: any thread; each arena is locked for microseconds.
#pragma once

#include <vector>

#include "prometheus/collectable.h"
#include "prometheus/metric_family.h"

namespace tessera::control {

class HeapMetrics : public prometheus::Collectable {
 public:
  std::vector<prometheus::MetricFamily> Collect() const override;
};

}  // namespace tessera::control
