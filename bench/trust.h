// The suite trust: what attacks get, and what they cost. Real clusters on this machine; quiet and attacked spans take
// turns within one run. `--only` selects, and `--csv` keeps what is known after each scene.
//
//   attacks   strangers, guests and a host with a valid certificate at a control plane's doors: what gets through, what
//             its memory grows by, and an operator's call meanwhile against none
//   create    making a world by the door with TLS, against the socket, or another version's command
//   ticks     a region's tick under 100 000 hellos a second, and under a player's flood, against none
//   evict     a host that is evicted by force while people play
//   churn     a control plane's memory over joins and leaves, and over worlds made and deleted
//
// Attackers share the machine with those whom they attack, so ratios of time say more than they would cost elsewhere.
#pragma once

#include "absl/status/status.h"
#include "bench/report.h"
#include "bench/suite.h"

namespace tessera::bench {

absl::Status RunTrust(const SuiteOptions& options, Report& report);

}  // namespace tessera::bench
