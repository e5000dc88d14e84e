// The pages that the control plane serves over HTTP beside /metrics: health, and service discovery for Prometheus
// (http_sd).
#pragma once

#include <functional>
#include <memory>
#include <mutex>
#include <shared_mutex>
#include <string>
#include <vector>

#include "control_plane/cluster/queries.h"
#include "control_plane/control_plane.h"
#include "telemetry/metrics_server.h"

namespace tessera::control {

// The whole list: one group for each process, labelled `component` and, as far as it has them, `host`,
// `instance_id`, `region`. `own_address`: where the control plane's /metrics is.
std::string ScrapeTargetsJson(const std::vector<ScrapeTarget>& targets, const std::string& own_address);

// PlaneGate: the control plane that pages show, while there is one. A control plane that follows another has none.
//
// Thread rule: any thread. `Set` waits until nobody uses the one before.
class PlaneGate {
 public:
  void Set(ControlPlane* plane) {
    const std::lock_guard lock(mutex_);
    plane_ = plane;
  }
  // False: there is none, and nothing was called.
  bool With(const std::function<void(ControlPlane&)>& use) const {
    const std::shared_lock lock(mutex_);
    if (plane_ == nullptr) return false;
    use(*plane_);
    return true;
  }

 private:
  mutable std::shared_mutex mutex_;
  ControlPlane* plane_ = nullptr;
};

// Adds /healthz and /sd/prometheus. Without a plane the second lists this process alone: the leader lists the rest.
void AddPages(telemetry::MetricsServer& server, const std::shared_ptr<PlaneGate>& gate);

}  // namespace tessera::control
