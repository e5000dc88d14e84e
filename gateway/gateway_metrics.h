// GatewayMetrics: the gateway's own metrics; docs/metrics.md lists them. Thread rule: any thread.
#pragma once

#include <memory>

#include "prometheus/counter.h"
#include "prometheus/gauge.h"
#include "prometheus/histogram.h"
#include "prometheus/registry.h"

namespace tessera::gateway {

struct GatewayMetrics {
  GatewayMetrics();

  std::shared_ptr<prometheus::Registry> registry = std::make_shared<prometheus::Registry>();
  prometheus::Gauge &worlds, &viewers, &players, &connections, &recordings;
  prometheus::Counter &frames, &frame_bytes, &other_bytes, &late_frames, &limited_frames, &deferred_bodies;
  prometheus::Counter &messages, &bad_messages;
  prometheus::Counter &refused_full, &refused_address, &refused_origin;
  prometheus::Counter &orders_done, &orders_failed, &orders_refused;
  prometheus::Counter& tickets_refused;
  prometheus::Histogram& frame_seconds;
};

}  // namespace tessera::gateway
