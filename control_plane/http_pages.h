// The pages that the control plane serves over HTTP beside /metrics: health, and service discovery for Prometheus
// (http_sd).
#pragma once

#include <string>
#include <vector>

#include "control_plane/cluster/queries.h"
#include "control_plane/control_plane.h"
#include "telemetry/metrics_server.h"

namespace tessera::control {

// The whole list: one group for each process, labelled `component` and, as far as it has them, `host`,
// `instance_id`, `region`. `own_address`: where the control plane's /metrics is.
std::string ScrapeTargetsJson(const std::vector<ScrapeTarget>& targets, const std::string& own_address);

// Adds /healthz and /sd/prometheus. `plane` outlives the server.
void AddPages(telemetry::MetricsServer& server, ControlPlane& plane);

}  // namespace tessera::control
