// What a worker's report may hold: what an honest worker sends, and no more. A host is believed about its own workers,
// but not that there are sixteen million players in one. Pure.
#pragma once

#include "absl/status/status.h"
#include "tessera/v1/worker_link.pb.h"

namespace tessera::control {

// INVALID_ARGUMENT "report.connected_players: has 16000000 entries, at most 1024".
absl::Status CheckReport(const v1::WorkerReport& report);

}  // namespace tessera::control
