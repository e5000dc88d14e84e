// ControlMetrics: the control plane's own metrics; docs/metrics.md lists them.
//
// Counters are there from the start. Thread rule: any thread.
#pragma once

#include <chrono>
#include <cstddef>
#include <functional>
#include <memory>
#include <string>

#include "control_plane/cluster/queries.h"
#include "control_plane/heap_metrics.h"
#include "control_plane/remembered.h"
#include "prometheus/collectable.h"
#include "prometheus/counter.h"
#include "prometheus/gauge.h"
#include "prometheus/histogram.h"
#include "prometheus/registry.h"

namespace tessera::control {

class ControlMetrics {
 public:
  ControlMetrics();

  std::shared_ptr<prometheus::Registry> registry() const { return registry_; }
  std::shared_ptr<prometheus::Collectable> heap() const { return heap_; }
  void SetLeads(bool leads) { leads_.Set(leads ? 1 : 0); }
  // By result: placed, no_room, failed.
  void CountPlacement(const absl::Status& status);
  // By result: joined, refused, limited (too many guests at once), gave_up.
  void CountSession(const absl::Status& status);
  // `took`: from the failover's map to the last region that runs by it.
  void ObserveFailover(std::chrono::nanoseconds took);
  // One write to the store, whether it succeeded or not.
  void ObserveWrite(std::chrono::nanoseconds took);
  // `door`: "operators" or "players". Connections that are open there now.
  void SetConnections(const std::string& door, std::size_t open);
  // `reason`: "address", which has as many as it may, or "door".
  void CountRefusedConnection(const std::string& door, const std::string& reason);
  // `method`: "HostService/AddHost".
  void ObserveRpc(const std::string& method, std::chrono::nanoseconds took);

 private:
  std::shared_ptr<prometheus::Registry> registry_;
  const std::shared_ptr<HeapMetrics> heap_ = std::make_shared<HeapMetrics>();
  prometheus::Family<prometheus::Counter>& placements_;
  prometheus::Family<prometheus::Counter>& sessions_;
  prometheus::Family<prometheus::Gauge>& connections_;
  prometheus::Family<prometheus::Counter>& refused_connections_;
  prometheus::Family<prometheus::Histogram>& rpc_seconds_;
  prometheus::Histogram& failover_seconds_;
  prometheus::Histogram& write_seconds_;
  prometheus::Gauge& leads_;
};

// Hosts and instances by state, how running instances fare, and writes to the store, read when scraped; the first two
// once a second at most, since they are counted under the cluster's lock.
class SummaryMetrics final : public prometheus::Collectable {
 public:
  SummaryMetrics(std::function<ClusterSummary()> count, std::function<Revision()> revision)
      : count_(std::move(count)), revision_(std::move(revision)), first_revision_(revision_()) {}
  std::vector<prometheus::MetricFamily> Collect() const override;

 private:
  mutable Remembered<ClusterSummary> count_;
  std::function<Revision()> revision_;
  Revision first_revision_;
};

}  // namespace tessera::control
